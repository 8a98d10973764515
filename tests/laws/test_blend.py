"""The blend: the signed distance, the normal and the deviation that an atlas gives at points."""

from functools import lru_cache

import numpy as np
import pytest

from tests.explored import Explored, explored, learned
from tests.sharp import explored_sharp, sharp_object

BALL = 33.0


@lru_cache
def known(name: str) -> Explored:
    return explored_sharp(name) if name == "block" else explored(name)


def directions(count: int) -> np.ndarray:
    """(n, 3) unit vectors at random."""
    out = np.random.default_rng(0).normal(size=(count, 3))
    return out / np.linalg.norm(out, axis=1)[:, None]


def near(name: str, off: float, count: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) at a distance off a body, length, outside where it is positive; and the outward
    normals of the body (n, 3) at their feet."""
    points, normals = sharp_object(name).sample(count, np.random.default_rng(1))
    return points + off * normals, normals


@pytest.mark.parametrize("off", [-0.3, -0.05, 0.0, 0.05, 0.3])
@pytest.mark.parametrize("name", ["sphere", "bottle"])
def test_gradient_of_the_distance_is_the_normal(name, off):
    """On the surface the two differ by how fast the weights of sextics that disagree change: they
    differ by a fraction of the noise, 0.02, over distances of their radius, 16. Off it the distance
    is of first order, and its gradient errs by twice the distance times the curvature."""
    atlas, h = known(name).atlas, 1e-4
    at, _ = near(name, off, 300)
    bend = np.abs(sharp_object(name).principal_curvatures(near(name, 0.0, 300)[0])[:2]).max()
    sides = [atlas.blend(at + h * e).distance - atlas.blend(at - h * e).distance for e in np.eye(3)]
    found = atlas.blend(at)
    error = (np.stack(sides, axis=1) / (2.0 * h) - found.normal)[found.known]
    limit = 4.0 * 0.02 / 16.0 + 2.0 * abs(off) * bend
    assert found.known.mean() > 0.99
    assert np.quantile(np.linalg.norm(error, axis=1), 0.99) < limit


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "bottle", "block"])
@pytest.mark.parametrize("off", [-0.5, 0.0, 0.5])
def test_the_distance_near_the_surface_is_that_of_the_body(name, off):
    """Off the surface by half a millimetre, to the tolerance of 0.1 in 99 of 100 places: that much
    of the surface is known to it at the end. Points beside an edge are left out: the nearest point
    is of another face."""
    obj = sharp_object(name)
    points, normals = near(name, off)
    if name == "block":
        clear = np.sort(np.abs(points), axis=1)[:, 1] < 20.0 - abs(off)
        points, normals = points[clear], normals[clear]
    found = known(name).atlas.blend(points)
    assert found.known.mean() > 0.99
    error = (np.abs(found.distance - off))[found.known]
    assert (error <= obj.tolerance).mean() >= 0.99
    alike = (found.normal * normals).sum(axis=1)[found.known] > np.cos(np.deg2rad(5.0))
    assert alike.mean() > 0.97


@pytest.mark.parametrize("name", ["sphere", "ellipsoid", "bottle"])
def test_intervals_of_two_deviations_hold_nineteen_of_twenty_errors(name):
    """Errors of places near each other are alike, so that 1,000 places count as some 40 sextics:
    the share has a standard error of 0.035."""
    points, _ = near(name, 0.0)
    found = known(name).atlas.blend(points)
    inside = np.abs(found.distance) <= 1.96 * found.deviation
    assert inside[found.known].mean() >= 0.95 - 2.0 * 0.035


def test_far_from_all_samples_nothing_is_known():
    """In the middle of the ball, and a radius above it."""
    far = np.concatenate([np.zeros((1, 3)), 2.0 * BALL * directions(20)])
    found = known("sphere").atlas.blend(far)
    assert not found.known.any()
    for name in ("distance", "deviation", "gaussian_curvature", "normal"):
        assert np.isnan(getattr(found, name)).all()
    assert (found.patch == -1).all()


def test_opposite_a_single_touch_nothing_is_known():
    """The samples of one touch lie on one side of the ball."""
    touch = known("sphere").touches[0]
    found = learned([touch], 0.1).blend(BALL * directions(500))
    toward = directions(500) @ (touch.contact / np.linalg.norm(touch.contact))
    assert found.known[toward > 0.995].all()
    assert not found.known[toward < 0.0].any()


def test_the_curvature_of_a_ball_is_that_of_its_radius():
    """1 / r^2. The radius of one law of a thousand samples is sure to 0.02 / sqrt(1000), 2e-5 of
    it; ten times twice that is allowed."""
    found = known("sphere").atlas.blend(BALL * directions(300))
    bends = found.gaussian_curvature[found.known]
    assert bends * BALL**2 == pytest.approx(1.0, abs=4e-4)


def test_no_points_are_no_answers():
    assert len(known("sphere").atlas.blend(np.zeros((0, 3))).distance) == 0
