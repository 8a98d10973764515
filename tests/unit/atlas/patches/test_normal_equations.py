"""The sums that a patch is solved from, and the variance that follows from them."""

import numpy as np
import pytest

from tests.explored import bumpy, explored
from touchatlas.atlas.patches.normal_equations import absorb, solve
from touchatlas.patch.geometry.polynomial import monomials


@pytest.mark.parametrize("seed", range(3))
def test_sums_of_samples_do_not_depend_on_their_order(seed):
    """A patch that is fitted to its samples one by one, in any order, ends with the sums of all of
    them at once: rounding apart, 1e-9 of the largest."""
    atlas = explored("sphere", max_touches=25).atlas
    table, membership = atlas.table, atlas.membership
    rng, names = np.random.default_rng(seed), ("moments", "rhs", "sum_of_squares", "count")
    for row in rng.choice(table.rows, 5, replace=False).tolist():
        whole = {name: np.array(getattr(table, name)[row]) for name in names}
        for name in names:
            getattr(table, name)[row] = 0.0
        for index in np.array_split(rng.permutation(membership.fitted[row]), 7):
            every = np.ones((1, len(index)), bool)
            absorb(table, np.array([row]), membership.pool, index, every)
        for name, sums in whole.items():
            error = np.abs(getattr(table, name)[row] - sums).max()
            assert error <= 1e-9 * np.abs(sums).max(), name


def test_variance_is_that_of_the_covariance():
    """phi^t C phi, and the polynomial that it is: rounding apart, times the 441 products."""
    atlas, rng = explored("sphere", max_touches=25).atlas, np.random.default_rng(0)
    table, rows = atlas.table, atlas.table.rows[:5]
    points = rng.uniform(-0.6, 0.6, (3, len(rows), 50))
    terms = monomials(table.basis, *points)[: table.basis.size].transpose(1, 0, 2)
    variance = table.variance_at(rows, terms)
    for i, row in enumerate(rows.tolist()):
        covariance = atlas.patch(row).covariance
        expected = np.einsum("tn,ts,sn->n", terms[i], covariance, terms[i])
        assert np.abs(variance[i] - expected).max() <= 441 * 2.3e-16 * np.abs(covariance).max()


def test_a_patch_that_is_solved_again_loses_its_residual():
    table = bumpy().atlas.table
    before = set(table.residuals)
    row = min(before)
    solve(table, np.array([row]))
    assert set(table.residuals) == before - {row}
