"""Free-form surfaces of few, coincident or exact samples, thin walls and tubes, and far places."""

import numpy as np
import pytest

from touchatlas.atlas.surfaces.fit_free_form import fit_free_form

# Radius of a ball, the noise of its samples, and the largest radius of a sextic on it.
BALL, NOISE, RADIUS = 10.0, 0.02, 5.0
# Extent and half thickness of a wall: it is a hundredth of the extent thick.
EXTENT, HALF = 28.0, 0.14


def ball(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a ball and its normals (n, 3)."""
    normals = np.random.default_rng(0).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return BALL * normals, normals


def all_values(surface) -> np.ndarray:
    """(n, 5) values of a surface on, about and far beyond the ball; they are numbers."""
    asked = np.random.default_rng(1).normal(size=(300, 3)) * np.linspace(0.0, 50.0, 300)[:, None]
    values = surface.values(asked)
    assert np.isfinite(values).all()
    assert (values[:, 4] >= 0.0).all()
    assert np.isfinite(surface.shape_operators(asked)).all()
    return values


@pytest.mark.parametrize("count", [1, 2, 5, 48])
def test_few_samples_are_a_surface_through_them(count):
    points, normals = ball(count)
    found = fit_free_form(points, normals, NOISE, RADIUS)
    assert np.abs(found.values(points)[:, 0]).max() < 2.0 * NOISE
    all_values(found)


def test_one_contour_is_a_surface_through_it():
    angle = np.linspace(0.0, 2.0 * np.pi, 80, endpoint=False)
    normals = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    found = fit_free_form(BALL * normals, normals, NOISE, RADIUS)
    assert np.abs(found.values(BALL * normals)[:, 0]).max() < NOISE
    all_values(found)


@pytest.mark.parametrize(("std", "radius"), [(NOISE, 0.0), (NOISE, RADIUS), (0.0, 0.0)])
def test_samples_of_one_place_are_a_plane(std, radius):
    points, normals = (np.repeat(x, 60, axis=0) for x in ball(1))
    found = fit_free_form(points, normals, std, radius)
    assert found.values(points)[:, :4] == pytest.approx(np.insert(normals, 0, 0.0, axis=1))
    all_values(found)


def test_samples_that_are_there_twice_tell_as_much_as_of_half_the_variance():
    points, normals = ball(400)
    once = fit_free_form(points, normals, NOISE / np.sqrt(2.0), RADIUS)
    twice = fit_free_form(*(np.repeat(x, 2, axis=0) for x in (points, normals)), NOISE, RADIUS)
    assert twice.at(points)[:, 0] == pytest.approx(once.at(points)[:, 0], abs=0.2 * NOISE)


@pytest.mark.parametrize("std", [0.0, 1e-300, 1e-12, 1e-6])
def test_exact_samples_are_met(std):
    """A sextic leaves out (r / R)^8 / 128 of the radius R of a ball at half of it, and less where
    several are averaged; kriging knows it."""
    points, normals = ball(2000)
    found = fit_free_form(points, normals, std, RADIUS)
    assert np.abs(found.values(points)[:, 0]).max() < 1e-4 * BALL
    all_values(found)


def wall(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of both sides of a bent wall, in turn, and normals."""
    x, y = np.random.default_rng(seed).uniform(-10.0, 10.0, (2, count))
    side = np.where(np.arange(count) % 2, 1.0, -1.0)
    normals = np.stack([-0.1 * np.cos(x / 5.0), 0.0 * x, np.ones(count)], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    middle = np.stack([x, y, 0.5 * np.sin(x / 5.0)], axis=1)
    return middle + HALF * side[:, None] * normals, side[:, None] * normals


def test_a_side_of_a_thin_wall_is_the_mean_of_all_sextics_that_face_as_it_does():
    """The formula of the method, with every sextic at every point."""
    points, normals = wall(3000, seed=0)
    found = fit_free_form(points, normals, NOISE, EXTENT / 4.0)
    asked, sextics = points[::20] + 0.2 * HALF * normals[::20], found.sextics
    count = len(sextics)
    numbers = np.repeat(np.arange(count), len(asked))
    values = sextics.values(numbers, np.tile(asked, (count, 1)))[0].reshape(count, -1, 4)
    side = found.sides(asked)
    away = np.linalg.norm(asked - sextics.origins[:, None], axis=2) / sextics.radii[:, None]
    weight = np.maximum(1.0 - (away / 0.9) ** 2, 0.0) ** 3 / sextics.radii[:, None] ** 3
    weight *= np.maximum(sextics.axes[:, 2] @ side.T - 0.2, 0.0)
    weight[(values[..., 1:] * side).sum(axis=2) <= 0.0] = 0.0
    mean = (weight * values[..., 0]).sum(axis=0) / weight.sum(axis=0)
    assert found.at(asked)[:, 0] == pytest.approx(mean, abs=1e-9 * EXTENT)


@pytest.mark.parametrize("off", [-0.05, 0.0, 0.05, 1.0])
def test_the_sides_of_a_thin_wall_do_not_mix(off):
    """Samples of a side are 0.7 apart, more than the wall is thick: that nearest to a point is
    often of the other side."""
    found = fit_free_form(*wall(1500, 0), NOISE, 0.25 * EXTENT)
    points, normals = wall(2000, 1)
    inner = np.abs(points[:, :2]).max(axis=1) < 8.0
    points, normals = points[inner], normals[inner]
    values = found.values(points + off * normals)
    own = (values[:, 1:4] * normals).sum(axis=1) > 0.99
    # Where the nearest sample of the other side is four times nearer, the other side has a point.
    assert own.mean() > 0.998
    assert values[own, 0] == pytest.approx(off, abs=NOISE)


@pytest.mark.parametrize("bore", [0.1, 0.3, 2.0])
def test_a_tube_may_be_thinner_than_a_sextic(bore):
    around, along = np.random.default_rng(0).uniform(0.0, 1.0, (2, 1500))
    around = 2.0 * np.pi * around
    normals = np.stack([0.0 * around, np.cos(around), np.sin(around)], axis=1)
    points = np.column_stack([20.0 * along, bore * normals[:, 1:]])
    found = fit_free_form(points, normals, 0.005, RADIUS)
    values = found.values(points + 0.02 * normals)
    assert values[:, 0] == pytest.approx(0.02, abs=0.005)
    assert (values[:, 1:4] * normals).sum(axis=1).min() > 0.99


def test_many_samples_at_fewer_places_than_parameters_are_no_error():
    """Half of the 200 samples at each of 60 places are five noises out and half five in. Steps
    ahead made the size of cubic terms 1e22 radii, and no covariance had a factor."""
    rng = np.random.default_rng(5)
    normals = rng.normal(size=(60, 3))
    normals = np.repeat(normals / np.linalg.norm(normals, axis=1)[:, None], 200, axis=0)
    off = 5.0 * NOISE * np.tile([-1.0, 1.0], 6000) + NOISE * rng.normal(size=12000)
    all_values(fit_free_form((BALL + off)[:, None] * normals, normals, NOISE, RADIUS))
