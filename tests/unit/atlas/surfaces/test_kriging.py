"""Kriging of residuals: a Gaussian process in closed form, its length by likelihood, its intervals
by sampling."""

import numpy as np
import pytest

from touchatlas.atlas.surfaces.fit_free_form import fit_free_form
from touchatlas.atlas.surfaces.kriging import krige, matern

UP = np.array([0.0, 0.0, 1.0])
NOISE = 0.01


def flat(points):
    return np.column_stack([points, np.zeros(len(points))])


def drawn(points, length: float, amplitude: float, rng):
    """Heights (n,) of a Gaussian process over points (n, 2)."""
    away = np.linalg.norm(points[:, None] - points, axis=2)
    covariance = amplitude**2 * matern(away, length) + 1e-10 * np.eye(len(points))
    return np.linalg.cholesky(covariance) @ rng.normal(size=len(points))


def kriged(points, heights, stds, radius: float = 1.0):
    return krige(flat(points), np.tile(UP, (len(points), 1)), heights, stds, radius)


def test_of_few_samples_it_is_the_posterior_mean_of_a_gaussian_process():
    """Rasmussen and Williams, "Gaussian Processes for Machine Learning", 2006, equations 2.23 and
    2.24, with three fifths of each variance as noise."""
    rng = np.random.default_rng(0)
    points, asked = rng.uniform(size=(12, 2)), rng.uniform(size=(5, 2))
    heights, stds = rng.normal(size=12), rng.uniform(0.1, 0.3, 12)
    process = kriged(points, heights, stds)
    amplitude = np.sqrt(process.variance)
    # The amplitude at a point is the mean of those of the samples.
    own, length = amplitude.mean(), process.length
    between = np.linalg.norm(points[:, None] - points, axis=2)
    among = amplitude[:, None] * amplitude * matern(between, length) + np.diag(0.6 * stds**2)
    away = np.linalg.norm(asked[:, None] - points, axis=2)
    toward = own * amplitude * matern(away, length)
    mean = toward @ np.linalg.solve(among, heights)
    variance = own**2 - np.einsum("mk,mk->m", toward, np.linalg.solve(among, toward.T).T)
    found = process.at(flat(asked), np.tile(UP, (5, 1)))
    assert np.allclose(found, [mean, variance], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("length", [0.04, 0.16])
def test_the_likeliest_length_is_that_of_the_process(length):
    """To the next of the lengths that are compared, which are twice as long."""
    rng = np.random.default_rng(1)
    points = rng.uniform(size=(900, 2))
    heights = drawn(points, length, 1.0, rng) + NOISE * rng.normal(size=900)
    found = kriged(points, heights, np.full(900, NOISE)).length
    assert length / 2.0 <= found <= 2.0 * length


def test_intervals_hold_the_share_that_they_state():
    """0.95 of 400 places, to 0.1: the thirty samples that tell the amplitude lie within two
    correlation lengths, as about five independent ones, and 1.96 deviations of a Student t of five
    degrees of freedom hold 0.89."""
    rng = np.random.default_rng(2)
    points = rng.uniform(size=(1600, 2))
    heights = drawn(points, 0.08, 1.0, rng)
    seen, rest = slice(None, 1200), slice(1200, None)
    noisy = heights[seen] + NOISE * rng.normal(size=1200)
    process = kriged(points[seen], noisy, np.full(1200, NOISE))
    mean, variance = process.at(flat(points[rest]), np.tile(UP, (400, 1)))
    held = np.abs(mean - heights[rest]) <= 1.96 * np.sqrt(variance)
    assert abs(held.mean() - 0.95) < 0.1


def test_a_sample_of_much_noise_tells_little():
    """At one place of two surveys the mean weighs each with its inverse variance: it is that of
    the sure one where the other has ten times its noise, within 1 %."""
    rng = np.random.default_rng(3)
    points = rng.uniform(size=(300, 2))
    heights = drawn(points, 0.16, 1.0, rng)
    both = np.concatenate([points, points + 1e-6])
    vague = heights + 10.0 * NOISE * rng.normal(size=300)
    stds = np.repeat([NOISE, 10.0 * NOISE], 300)
    found = kriged(both, np.concatenate([heights, vague]), stds).at(
        flat(points), np.tile(UP, (300, 1))
    )[0]
    assert np.abs(found - heights).mean() < 0.01


def test_samples_that_face_elsewhere_tell_nothing():
    """Of the other side of a wall."""
    rng = np.random.default_rng(4)
    points = rng.uniform(size=(200, 2))
    turned = krige(flat(points), np.tile(-UP, (200, 1)), np.ones(200), np.full(200, 0.1), 1.0)
    mean, variance = turned.at(flat(points[:20]), np.tile(UP, (20, 1)))
    assert (mean == 0.0).all() and (variance == 0.0).all()


def test_a_rough_surface_is_nearer_than_its_sextics():
    """Ripples that are as short as the sextics, which need 98 samples: kriging takes at least a
    tenth of the mean error amid samples."""
    rng = np.random.default_rng(6)
    x, y = rng.uniform(size=(2, 2000))
    points = np.column_stack([x, y, _rippled(x, y) + 1e-3 * rng.normal(size=len(x))])
    surface = fit_free_form(points, np.tile(UP, (len(points), 1)), 1e-3, 0.5)
    x, y = rng.uniform(0.1, 0.9, (2, 1000))
    asked = np.column_stack([x, y, _rippled(x, y)])
    with_rest, alone = surface.values(asked)[:, 0], surface.at(asked)[:, 0]
    assert np.abs(with_rest).mean() < 0.9 * np.abs(alone).mean()


def _rippled(x, y):
    """Heights of ripples of wave lengths of 0.16 and 0.12."""
    return 0.01 * np.sin(40.0 * x) * np.sin(52.0 * y)


@pytest.mark.parametrize("std", [1e-9, 1e-12])
def test_samples_that_coincide_are_followed_however_sure_they_are(std):
    """Two samples of one height at each place have a covariance that is singular to rounding; at
    them the residual is that height, to a hundred thousandth of the amplitude."""
    places = np.linspace(0.0, 1.0, 10)
    points = np.repeat(np.column_stack([places, places**2]), 2, axis=0)
    heights = np.repeat(0.1 * np.cos(9.0 * places), 2)
    residual, variance = kriged(points, heights, np.full(20, std)).at(
        flat(points), np.tile(UP, (20, 1))
    )
    assert np.allclose(residual, heights, rtol=0.0, atol=1e-6)
    assert (variance >= 0.0).all() and (variance < 1e-6).all()
