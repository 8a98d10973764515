"""A motion, another unit, and the Darboux frame of any shape leave the patch the same."""

import numpy as np
import pytest

from tests.laws.patch_scenes import NOISE, fit_of, scene_of
from tests.truths import ORIGIN, UP, graph_contours, moved
from touchatlas.patch import FitOptions, fit_patch
from touchatlas.sim.study.cases import random_rotation
from touchatlas.sim.study.scenes import SURFACES


@pytest.mark.parametrize("noise", [0.0, 1e-4, NOISE])
@pytest.mark.parametrize("surface", SURFACES)
def test_a_motion_moves_the_heights_by_rounding_alone(surface, noise):
    """Umbilics and exact contacts too: their directions follow the first section, and heights
    are refined to the last digits. The tolerance, 1e-9, is that of the slopes of a frame."""
    for draw in range(2):
        rng = np.random.default_rng([6, draw])
        scene = scene_of(surface, draw, noise=noise, tilt=0.3 * draw)
        rotation, shift = random_rotation(rng), 50.0 * rng.normal(size=3)
        there = moved(scene.contours, rotation, shift, 7.3)
        one = fit_of(scene).patch
        two = fit_patch(7.3 * rotation @ scene.contact + shift, there, rotation @ scene.normal)
        points = 7.3 * scene.verifying @ rotation.T + shift
        error = two.patch.signed_distance(points) / 7.3 - one.signed_distance(scene.verifying)
        assert np.abs(error).max() < 1e-9 * one.radius


VANISHING, TOLERANCES = [1, 2, 4], np.array([1.0, 1.0, 10.0])
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
    the same of the least noise that differs from none."""
    patch = fit_patch(ORIGIN, odd_contours(seed), UP, options=options).patch
    rest = np.abs(patch.polynomial.coefficients[VANISHING]) / TOLERANCES
    noise = max(patch.noise_std / patch.radius, 1e-6)
    assert rest.max() <= 0.5 * noise / np.sqrt(patch.count)
