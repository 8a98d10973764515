"""Edges lie where two surfaces intersect, smooth rims where their normals agree."""

import numpy as np

from touchatlas.atlas.edges.edge_curves import (
    curvature_jump,
    intersection_points,
    rim_slope,
    valley_points,
)
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind

NOISE, RADIUS = 0.02, 5.0


def flat(rng, count: int = 300):
    """A plane z = 0 for x < 0, and its normals."""
    x, y = rng.uniform(-20.0, 0.0, count), rng.uniform(-10.0, 10.0, count)
    return np.stack([x, y, 0 * x], axis=1), np.tile([0.0, 0.0, 1.0], (count, 1))


def fillet(rng, count: int = 300):
    """A quarter of a cylinder that goes on from the plane at x = 0, downward."""
    u, y = rng.uniform(0.0, np.pi / 2, count), rng.uniform(-10.0, 10.0, count)
    normals = np.stack([np.sin(u), 0 * u, np.cos(u)], axis=1)
    return RADIUS * normals + np.stack([0 * u, y, 0 * u - RADIUS], axis=1), normals


def piece_of(kind, surface, rng):
    points, normals = surface
    return fit_piece(kind, points + NOISE * rng.normal(size=points.shape), normals, NOISE)


def test_the_rim_of_a_fillet_is_where_the_normals_agree():
    """Twenty draws: predicted deviations are right within 3 / sqrt(2 * 20), and a few hundredths
    of a millimetre. Starts are up to 1.5 beside the rim."""
    rng, ratios = np.random.default_rng(0), []
    for _ in range(20):
        plane, tube = (
            piece_of(Kind.PLANE, flat(rng), rng),
            piece_of(Kind.CYLINDER, fillet(rng), rng),
        )
        y = rng.uniform(-9.0, 9.0, 40)
        start = np.stack([rng.uniform(-1.5, 1.5, 40), y, 0 * y], axis=1)
        curve = valley_points(plane, tube, start, 4.0)
        assert len(curve.points) == 40
        ratios.append(np.mean((curve.points[:, 0] / curve.deviation) ** 2))
        assert np.sqrt((curve.points[:, 0] ** 2).mean()) < 0.1
    assert abs(np.sqrt(np.mean(ratios)) - 1.0) < 3.0 / np.sqrt(40)


def test_the_curvature_jumps_by_that_of_the_fillet_across_the_rim():
    rng = np.random.default_rng(1)
    plane, tube = piece_of(Kind.PLANE, flat(rng), rng), piece_of(Kind.CYLINDER, fillet(rng), rng)
    across, jump = curvature_jump(plane, tube, np.zeros((3, 3)))
    assert abs(jump - 1.0 / RADIUS) < 0.01
    assert np.abs(across[:, 0]).min() > 0.999


def test_two_balls_meet_in_their_circle():
    """Balls of radius 5 with centres 6 apart meet in a circle of radius 4."""
    rng = np.random.default_rng(2)
    direction = rng.normal(size=(600, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    left, right = np.array([-3.0, 0.0, 0.0]), np.array([3.0, 0.0, 0.0])
    balls = [piece_of(Kind.SPHERE, (5.0 * direction + c, direction), rng) for c in (left, right)]
    angle = np.linspace(0.0, 6.0, 30)
    start = np.stack([0.3 + 0 * angle, 4.3 * np.cos(angle), 4.3 * np.sin(angle)], axis=1)
    curve = intersection_points(*balls, start, 2.0)
    off = np.hypot(curve.points[:, 0], np.hypot(*curve.points[:, 1:].T) - 4.0)
    assert len(off) == 30 and off.max() < 4.0 * curve.deviation.max() < 0.05


def test_parallel_planes_have_no_edge():
    """The two sides of a wall."""
    rng = np.random.default_rng(3)
    points, normals = flat(rng)
    top = piece_of(Kind.PLANE, (points, normals), rng)
    bottom = piece_of(Kind.PLANE, (points - [0.0, 0.0, 1.0], -normals), rng)
    assert not len(intersection_points(top, bottom, points[:50], 5.0).points)


def test_rim_slopes_bound_what_a_piece_leaves_out():
    """A cubic over a plane, a sphere's kin and a quartic: z = a x^n on [-1, 1] with n = 2, 3, 5;
    least squares of lower degree leave a multiple of the Legendre polynomial, whose slope at the
    end is half that of the bound, which is for corners."""
    x = np.linspace(-1.0, 1.0, 20001)
    for kind, degree in ((Kind.PLANE, 2), (Kind.CYLINDER, 3), (Kind.QUARTIC, 5)):
        left = np.polynomial.Polynomial.fit(x, x**degree, degree - 1)
        rest = np.polynomial.Polynomial.basis(degree) - left.convert()
        misfit = float(np.sqrt((rest(x) ** 2).mean()))
        slope = rim_slope(kind, misfit, 1.0)
        assert np.isclose(2.0 * rest.deriv(1)(1.0), slope, rtol=1e-3)
