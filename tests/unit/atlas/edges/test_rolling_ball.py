"""Rolling ball: the rounding of an edge or corner by a ball that touches its faces."""

import numpy as np
import pytest

from touchatlas.atlas.edges.rolling_ball import (
    ball_radius,
    radius_slope,
    rounded_corner,
    rounded_edge,
)

RADIUS = 2.0


def across(degrees: float, height: float = 0.0, radius: float = RADIUS):
    """Points (n, 2) at a height over the ball of two lines whose normals (2, 2) have an angle, and
    the directions (n, 2) from its centre, strictly between both normals."""
    angle = np.deg2rad(degrees)
    normals = np.array([[1.0, 0.0], [np.cos(angle), np.sin(angle)]])
    centre = np.linalg.solve(normals, [-radius, -radius])
    turn = np.linspace(0.01, 0.99, 40) * angle
    outward = np.column_stack([np.cos(turn), np.sin(turn)])
    return centre + (radius + height) * outward, normals, outward


@pytest.mark.parametrize("degrees", [25.0, 60.0, 90.0, 130.0])
def test_the_radius_of_a_ball_is_found_from_two_distances(degrees):
    """An identity, to rounding over the square of the small sine near the faces."""
    points, normals, _ = across(degrees)
    first, second = (points @ normals.T).T
    found = ball_radius(first, second, np.full(len(first), np.cos(np.deg2rad(degrees))))
    assert found == pytest.approx(RADIUS, rel=1e-9)


def test_no_ball_passes_a_point_outside_of_a_face():
    assert np.isnan(ball_radius(np.array([0.1]), np.array([-1.0]), np.zeros(1))).all()


def test_faces_of_parallel_planes_are_no_error_whatever_rounding_makes_of_their_cosine():
    """No ball rounds the edge of two that face alike; between two that face away from each other it
    has half of their distance."""
    beyond = np.array([1.0, 1.0 + 1e-15, -1.0, -1.0 - 1e-15])
    found = ball_radius(np.full(4, -1.0), np.full(4, -3.0), beyond)
    assert np.isnan(found[:2]).all() and found[2:] == pytest.approx(2.0)


@pytest.mark.parametrize("degrees", [25.0, 60.0, 90.0, 130.0])
@pytest.mark.parametrize("height", [-0.5, 0.0, 0.7])
def test_the_distance_from_a_rounded_edge_is_that_from_its_ball(degrees, height):
    """An identity, and its gradient is the direction from the centre."""
    points, normals, outward = across(degrees, height)
    first, second = (points @ normals.T).T
    cosine = np.full(len(first), np.cos(np.deg2rad(degrees)))
    found, weights = rounded_edge(first, second, cosine, RADIUS)
    assert found == pytest.approx(height, abs=1e-12)
    assert weights @ normals == pytest.approx(outward, abs=1e-12)


def test_a_rounded_edge_goes_over_into_its_faces_without_a_jump():
    """Where the ball touches a face the distances agree to second order of the offset along it."""
    points, normals, _ = across(90.0)
    offset = 1e-6
    touch = np.array([0.0, -RADIUS])
    beside = touch + offset * np.array([[0.0, 1.0], [0.0, -1.0]])
    found, _ = rounded_edge(*(beside @ normals.T).T, np.zeros(2), RADIUS)
    assert np.abs(np.diff(found)) < offset**2


def test_beside_the_ball_the_larger_distance_counts():
    found, weights = rounded_edge(np.array([0.5, -9.0]), np.array([-9.0, -1.0]), np.zeros(2), 2.0)
    assert found.tolist() == [0.5, -1.0]
    assert weights.tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_a_radius_of_zero_is_a_sharp_edge():
    """Outside of both faces it is the distance from the edge, else the larger one."""
    found, _ = rounded_edge(np.array([3.0, -1.0]), np.array([4.0, -2.0]), np.zeros(2), 0.0)
    assert found == pytest.approx([5.0, -1.0])


def test_the_slope_by_the_radius_matches_finite_differences():
    """Central differences of a smooth function err by the square of the step."""
    points, normals, _ = across(60.0, 0.3)
    pair, cosine, step = (points @ normals.T).T, np.full(len(points), 0.5), 1e-4
    ahead, behind = (rounded_edge(*pair, cosine, RADIUS + s)[0] for s in (step, -step))
    slope = radius_slope(rounded_edge(*pair, cosine, RADIUS)[1])
    inner = slice(2, -2)
    assert slope[inner] == pytest.approx(((ahead - behind) / (2.0 * step))[inner], abs=1e-7)


def test_the_distance_from_a_rounded_corner_is_that_from_its_ball():
    """An identity for any three planes; beyond the cone of their normals the ball says nothing."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(3, 3)) + 2.0 * np.eye(3)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    centre = np.linalg.solve(normals, np.full(3, -RADIUS))
    weights = rng.uniform(0.05, 1.0, (50, 3))
    outward = weights @ normals
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    points = centre + (RADIUS + 0.4) * outward
    columns = np.broadcast_to(normals, (50, 3, 3)), np.full(50, RADIUS)
    found, normal, ball = rounded_corner(points @ normals.T, *columns)
    assert ball.all()
    assert found == pytest.approx(0.4, abs=1e-12)
    assert normal == pytest.approx(outward, abs=1e-12)
    assert not rounded_corner((centre - outward) @ normals.T, *columns)[2].any()


def test_the_ball_of_a_corner_is_no_nearer_than_any_of_its_faces_says():
    """An offset from the centre is no shorter than its part along a normal."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(2000, 3, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    distances, radius = rng.normal(size=(2000, 3)), rng.uniform(0.1, 2.0, 2000)
    found, _, ball = rounded_corner(distances, normals, radius)
    least = np.abs(distances + radius[:, None]).max(axis=1) - radius
    assert ball.sum() > 100
    assert (found[ball] > least[ball] - 1e-9).all()
