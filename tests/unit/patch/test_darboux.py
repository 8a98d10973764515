"""The frame of a patch is the Darboux frame of its polynomial, whatever the shape."""

import numpy as np
import pytest

from tests.truths import graph_contours
from touchatlas.patch.fit.fit_patch import FitOptions, fit_patch
from touchatlas.patch.fit.smoothness import scaled_noise

UP, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)
# Of x, y and x y; the last is bound ten times less well.
VANISHING, SHARE = [1, 2, 4], np.array([1.0, 1.0, 10.0])
# On these whole turns overstep, and swing to and fro.
SWINGING = (129, 178, 304, 309, 1078, 1472, 1535, 1954, 2240)
SWINGING_HEIGHTS = (205, 304, 309, 492, 507, 1234, 1393)


def odd_contours(seed):
    """Three sections, not quite even, of five random waves that a quartic may not follow."""
    rng = np.random.default_rng(seed)
    rng.integers(4)
    waves, phase = rng.normal(size=(5, 2)) * rng.uniform(0.3, 2.0), rng.uniform(0, 2 * np.pi, 5)
    size = 0.3 * rng.normal(size=5) * rng.uniform(0.1, 1.0)

    def height(x, y):
        along = np.multiply.outer(x, waves[:, 0]) + np.multiply.outer(y, waves[:, 1])
        return (np.sin(along + phase) - np.sin(phase)) @ size

    noise = (0.0, 1e-4, 1e-3, 1e-2)[rng.integers(4)]
    angles = 0.2 + np.pi / 3 * np.arange(3) + rng.uniform(-0.2, 0.2, 3)
    count = int(rng.integers(7, 25))
    return graph_contours(height, 1.0, count, noise, rng, angles, (0.0, 0.3)[rng.integers(2)])


@pytest.mark.parametrize(
    ("seed", "options"),
    [(seed, FitOptions()) for seed in (*range(60), *SWINGING)]
    + [(seed, FitOptions(height_only=True, adaptive=False)) for seed in SWINGING_HEIGHTS],
)
def test_linear_and_cross_terms_vanish_to_the_noise(seed, options):
    """To half of what noise of so many samples leaves uncertain of a mean; exact contacts to
    the same of the least noise that is told from none."""
    patch = fit_patch(ORIGIN, odd_contours(seed), UP, options=options).patch
    rest = np.abs(patch.polynomial.coefficients[VANISHING]) / SHARE
    assert rest.max() <= 0.5 * scaled_noise(patch.noise_std, patch.radius) / np.sqrt(patch.count)
