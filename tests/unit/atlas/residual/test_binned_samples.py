"""Samples that are merged in bins."""

import numpy as np
import pytest

from tests.explored import explored
from tests.residuals import (
    BASIS,
    places_on_a_saddle,
    samples_at,
)
from touchatlas.atlas.residual.binned_samples import SIDE, PatchSamples, merged
from touchatlas.atlas.residual.hyperparameters import (
    ResidualScale,
)
from touchatlas.atlas.residual.learn_residuals import samples_of


def test_merged_samples_keep_polynomials_and_weight():
    """Means of a polynomial's heights are its coefficients times means of its monomials."""
    rng = np.random.default_rng(8)
    feet = places_on_a_saddle(rng, 3, 3000)
    samples = samples_at(feet, np.zeros((3, 3000)))
    coefficients = rng.normal(size=(3, BASIS.size))
    height = np.einsum("mt,tmn->mn", coefficients, samples.terms)
    weight = rng.uniform(0.5, 1.0, (3, 3000))
    weight[2, 100:] = 0.0
    few = merged(
        PatchSamples(feet, samples.terms, height, weight, samples.noise), np.full(len(feet), SIDE)
    )
    assert few.weight.shape[1] <= 224 and np.count_nonzero(few.weight[2]) <= 100
    assert few.weight.sum(axis=1) == pytest.approx(weight.sum(axis=1))
    fitted = np.einsum("mt,tmn->mn", coefficients, few.terms)
    assert few.height[few.used] == pytest.approx(fitted[few.used], abs=1e-12)


def test_a_short_correlation_length_takes_more_bins_and_a_long_one_as_many():
    """Bins are a third of the correlation length wide: a sixteenth to an eighth of a radius."""
    atlas = explored("torus").atlas
    table, rows = atlas.table, atlas.table.rows[:20]
    radius = float(table.radius[rows].max())

    def count(residual_scale):
        return np.count_nonzero(
            samples_of(table, atlas.membership, rows, residual_scale).used, axis=1
        )

    usual, long = count(None), count(ResidualScale(1.0, radius))
    assert (usual == long).all()
    fine, finest = (
        count(ResidualScale(1.0, 0.28 * radius)),
        count(ResidualScale(1.0, 1e-3 * radius)),
    )
    assert usual.sum() < fine.sum() < finest.sum()
