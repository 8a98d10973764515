"""Refits: many at once are what each is alone, and a subset of samples refuses what all would."""

import numpy as np
import pytest

from touchatlas.patch import DarbouxFrame, FitOptions, UnfitError
from touchatlas.patch.fit.refit_patch import refit_patch, refit_patches
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack

NOISE = 1e-3


FRAME = DarbouxFrame(np.zeros(3), np.eye(3))


def wavy(count: int, wave: float, seed: int) -> np.ndarray:
    """Noisy samples of z = (x^2 - y^2)/5 + wave sin 9x over the unit disc."""
    rng = np.random.default_rng(seed)
    angle, r = rng.uniform(0.0, 2.0 * np.pi, count), np.sqrt(rng.uniform(0.0, 1.0, count))
    x, y = r * np.cos(angle), r * np.sin(angle)
    z = 0.2 * (x * x - y * y) + wave * np.sin(9.0 * x) + NOISE * rng.normal(size=count)
    return np.stack([x, y, z], axis=1)


def test_many_refits_are_what_each_is_alone():
    """One of them doubtful, and shorter than the others; up to rounding of other sums."""
    parts = [wavy(200, 0.0, 0), wavy(140, 0.02, 1), wavy(170, 0.0, 2)]
    offsets, weight = np.zeros((3, 200, 3)), np.zeros((3, 200))
    for i, points in enumerate(parts):
        offsets[i, : len(points)], weight[i, : len(points)] = points, 1.0
    axes, one = np.tile(np.eye(3), (3, 1, 1)), np.ones(3)
    stack = Stack(np.zeros((3, 3)), axes, offsets, 0.0 * offsets, weight, one, NOISE * one, one)
    together = refit_patches(stack, 0.0, SmoothnessPrior(), FitOptions())
    for points, fit in zip(parts, together, strict=True):
        alone = refit_patch(FRAME, points, 0.0 * points, NOISE, 1.0, 0.0, 1.0)
        assert (fit.length_ratio, fit.z_scale) == (alone.length_ratio, alone.z_scale)
        places = points[::10]
        gap = fit.patch.signed_distance(places) - alone.patch.signed_distance(places)
        assert np.abs(gap).max() < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_one_polynomial_is_refused_waves_of_many_deviations_and_granted_none(seed):
    many = 2000
    smooth = wavy(many, 0.0, seed)
    assert refit_patch(FRAME, smooth, 0.0 * smooth, NOISE, 1.0, 0.0, None).patch.count == many
    with pytest.raises(UnfitError, match="no one polynomial"):
        refit_patch(FRAME, (bad := wavy(many, 0.02, seed)), 0.0 * bad, NOISE, 1.0, 0.0, None)
