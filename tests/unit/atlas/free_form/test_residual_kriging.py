"""Kriging of residuals: texture is known between its samples, noise is not taken for it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from touchatlas.atlas.free_form.residual_kriging import amplitudes_of, krige, nearest_of

# Standard deviation of a sample, radius of the polynomials, and wave length and amplitude of a
# texture on a plane of a half-length.
STD, RADIUS, WAVE, HEIGHT, HALF = 0.02, 4.0, 3.0, 0.2, 10.0


def plane(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a plane and normals (n, 3)."""
    points = np.random.default_rng(seed).uniform(-HALF, HALF, (count, 3)) * [1.0, 1.0, 0.0]
    return points, np.tile([0.0, 0.0, 1.0], (count, 1))


def texture(points) -> np.ndarray:
    """(n,) heights at points (n, 3)."""
    x, y, _ = 2.0 * np.pi * points.T / WAVE
    return HEIGHT * np.sin(x) * np.cos(y)


def corrected(found, points) -> np.ndarray:
    """(n, 5) distance, normal and variance of a plane at points (n, 3), with what is predicted."""
    values = np.zeros((len(points), 5))
    values[:, 0], values[:, 3] = points[:, 2], 1.0
    found.correct(points, values)
    return values


def test_texture_is_known_between_its_samples():
    """Samples are 0.45 apart, a seventh of a wave. Nine in ten lie within 1.96 deviations."""
    points, normals = plane(2000, 0)
    noise = STD * np.random.default_rng(1).normal(size=2000)
    found = krige(points, normals, texture(points) + noise, RADIUS, STD)
    asked = plane(1000, 2)[0] * 0.9
    values = corrected(found, asked)
    off = values[:, 0] + texture(asked)
    assert np.sqrt((off**2).mean()) < 0.15 * HEIGHT
    assert (np.abs(off) < 1.96 * np.sqrt(values[:, 4])).mean() > 0.9


def test_noise_is_no_texture():
    """Up to six tenths of the variance of a sample are noise: the rest is lack of fit."""
    points, normals = plane(2000, 0)
    noise = np.sqrt(0.6) * STD * np.random.default_rng(1).normal(size=2000)
    values = corrected(krige(points, normals, noise, RADIUS, STD), points)
    assert np.abs(values[:, 0]).max() < STD
    assert (values[:, 0] == 0.0).mean() > 0.5


def test_far_from_samples_residuals_are_as_uncertain_as_they_are_large():
    points, normals = plane(2000, 0)
    found = krige(points, normals, texture(points), RADIUS, STD)
    values = corrected(found, np.array([[HALF + 20.0 * RADIUS, 0.0, 0.0]]))
    assert values[0, 0] == pytest.approx(0.0, abs=1e-3 * HEIGHT)
    # The mean square of the texture is a quarter of the square of its height.
    assert np.sqrt(values[0, 4]) == pytest.approx(0.5 * HEIGHT, rel=0.3)


def test_samples_of_the_other_side_tell_nothing():
    points, normals = plane(2000, 0)
    under = np.concatenate([points, points - [0.0, 0.0, 0.01]])
    rest = np.concatenate([texture(points), np.full(2000, 5.0)])
    both = krige(under, np.concatenate([normals, -normals]), rest, RADIUS, STD)
    # Half of the 24 nearest samples are of the other side: these would tell 25 heights.
    assert corrected(both, points)[:, 0] == pytest.approx(-texture(points), abs=0.3 * HEIGHT)


def test_amplitudes_are_those_of_the_place():
    """Thirty samples tell a deviation to an eighth."""
    points, normals = plane(2000, 0)
    size = np.where(points[:, 0] > 0.0, 10.0, 0.0) * STD
    near = nearest_of(cKDTree(points), np.arange(2000))
    rest = size * np.random.default_rng(1).normal(size=2000)
    found = amplitudes_of(normals[near], rest[near], STD)
    assert (near[:, 0] == np.arange(2000)).all()
    assert np.median(found[points[:, 0] > 2.0]) == pytest.approx(10.0 * STD, rel=0.05)
    assert (found[points[:, 0] < -2.0] == 0.0).all()


@pytest.mark.parametrize("count", [1, 2, 30])
def test_few_and_coincident_samples_are_kriged(count):
    points, normals = (np.repeat(x, count, axis=0) for x in plane(1, 0))
    values = corrected(krige(points, normals, np.full(count, HEIGHT), RADIUS, STD), points)
    # Of a variance HEIGHT^2 - 0.6 STD^2, and noise of 0.6 STD^2: all but half a hundredth.
    assert values[:, 0] == pytest.approx(-HEIGHT, rel=0.01)
    assert (values[:, 4] >= 0.0).all()
