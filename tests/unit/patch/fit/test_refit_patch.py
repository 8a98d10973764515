"""Refits: many at once are what each is alone, and follow one polynomial but no waves."""

import numpy as np

from touchatlas.patch import FitOptions
from touchatlas.patch.fit.refit_patch import refit_patches
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack

NOISE = 1e-3


def wavy(count: int, wave: float, seed: int) -> np.ndarray:
    """Noisy samples of z = (x^2 - y^2)/5 + wave sin 9x over the unit disc."""
    rng = np.random.default_rng(seed)
    angle, r = rng.uniform(0.0, 2.0 * np.pi, count), np.sqrt(rng.uniform(0.0, 1.0, count))
    x, y = r * np.cos(angle), r * np.sin(angle)
    z = 0.2 * (x * x - y * y) + wave * np.sin(9.0 * x) + NOISE * rng.normal(size=count)
    return np.stack([x, y, z], axis=1)


def refits(*parts):
    """Patches of samples (n, 3) each over the unit disc, from frames along the axes."""
    count, most = len(parts), max(map(len, parts))
    offsets, weight = np.zeros((count, most, 3)), np.zeros((count, most))
    for i, points in enumerate(parts):
        offsets[i, : len(points)], weight[i, : len(points)] = points, 1.0
    axes, one = np.tile(np.eye(3), (count, 1, 1)), np.ones(count)
    given = axes, offsets, 0.0 * offsets, weight, one, NOISE * one, one
    return refit_patches(Stack(np.zeros((count, 3)), *given), 0.0, SmoothnessPrior(), FitOptions())


def test_many_refits_are_what_each_is_alone():
    """One of them doubtful, and shorter than the others; up to rounding of other sums."""
    parts = [wavy(200, 0.0, 0), wavy(140, 0.02, 1), wavy(170, 0.0, 2)]
    for points, fit in zip(parts, refits(*parts), strict=True):
        (alone,) = refits(points)
        assert fit is not None and alone is not None
        assert (fit.length_ratio, fit.z_scale) == (alone.length_ratio, alone.z_scale)
        places = points[::10]
        gap = fit.patch.signed_distance(places) - alone.patch.signed_distance(places)
        assert np.abs(gap).max() < 1e-9


def test_a_refit_explains_samples_of_one_polynomial_within_their_noise():
    """The root mean square of 2,000 samples is known to 2 per cent. Waves of twenty deviations,
    shorter than the degree follows, are left out."""
    parts = wavy(2000, 0.0, 3), wavy(2000, 0.02, 3)
    for points, fit, least, most in zip(
        parts, refits(*parts), (0.94, 5.0), (1.06, np.inf), strict=True
    ):
        assert fit is not None
        distance = fit.patch.signed_distance(points)
        assert least < np.sqrt((distance**2).mean()) / NOISE < most
