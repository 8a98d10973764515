"""Pieces are fitted without bias, and know how sure they are."""

import numpy as np
import pytest

from touchatlas.atlas.pieces.fit_cylinder import refined_cylinder
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.laws import law_of
from touchatlas.sim.study.cases import random_rotation

NOISE = 0.02


def _ball(u, v):
    direction = np.stack([np.sin(u), np.cos(u) * np.sin(v), np.cos(u) * np.cos(v)], 1)
    return 9.0 * direction, direction


def _tube(u, along):
    direction = np.stack([np.sin(u), 0 * u, np.cos(u)], 1)
    return 5.0 * direction + along[:, None] * np.array([0.0, 1.0, 0.0]), direction


def _ring(u, v):
    """Of radii 12 and 4: the outer half of a tube, a third of the way round."""
    radial = np.stack([np.sin(u), np.cos(u), 0 * u], 1)
    normal = np.cos(v)[:, None] * radial + np.sin(v)[:, None] * np.array([0.0, 0.0, 1.0])
    return 12.0 * radial + 4.0 * normal, normal


def _funnel(u, along):
    """Of a half angle of 0.3 rad, between heights of 12 and 20, a third of the way round."""
    height, radial = 16.0 + along, np.stack([np.sin(u), np.cos(u), 0 * u], 1)
    axis = np.array([0.0, 0.0, 1.0])
    points = height[:, None] * (np.tan(0.3) * radial + axis)
    return points, np.cos(0.3) * radial - np.sin(0.3) * axis


def _saddle(x, y):
    normal = np.stack([-0.1 * x, 0.1 * y, 1.0 + 0 * x], 1)
    points = np.stack([x, y, 0.05 * (x * x - y * y)], 1)
    return points, normal / np.linalg.norm(normal, axis=1)[:, None]


def _wave(x, y):
    slope = 0.003 * x * x
    normal = np.stack([-slope, 0 * y, 1.0 + 0 * x], 1)
    return np.stack([x, y, 0.001 * x**3], 1), normal / np.linalg.norm(normal, axis=1)[:, None]


LAWFUL = {
    Kind.PLANE: lambda a, b: (np.stack([a, b, 0 * a], 1), np.stack([0 * a, 0 * a, 0 * a + 1], 1)),
    Kind.SPHERE: lambda a, b: _ball(a / 9.0, b / 9.0),
    Kind.CYLINDER: lambda a, b: _tube(a / 5.0, b),
    Kind.CONE: lambda a, b: _funnel(a / 4.0, b),
    Kind.TORUS: lambda a, b: _ring(a / 4.0, b / 3.0),
    Kind.QUADRIC: _saddle,
    Kind.QUARTIC: _wave,
    Kind.SEXTIC: _wave,
}


def drawn(kind: Kind, rng, count: int = 200):
    """Exact points and normals of a surface of a kind."""
    return LAWFUL[kind](*rng.uniform(-4.0, 4.0, (2, count)))


@pytest.mark.parametrize("kind", list(Kind))
def test_errors_are_as_large_as_predicted(kind):
    """Mean square of error over predicted deviation over 60 draws and 200 points. Errors of one
    draw are of ``parameters`` numbers, so the mean is 1 within 3 sqrt(2 / (60 parameters)). The
    prior of polynomials holds here, so their errors are smaller."""
    rng, squares = np.random.default_rng(0), []
    for _ in range(60):
        points, normals = drawn(kind, rng)
        piece = fit_piece(kind, points + NOISE * rng.normal(size=points.shape), normals, NOISE)
        distance, _, variance = piece.predicted(points)
        squares.append(np.mean(distance**2 / variance))
    spread = 3.0 * np.sqrt(2.0 / (60 * kind.parameters))
    assert np.mean(squares) < 1.0 + spread
    assert kind >= Kind.QUARTIC or np.mean(squares) > 1.0 - spread


@pytest.mark.parametrize("kind", list(Kind))
def test_normals_and_curvatures_match_finite_differences(kind):
    rng = np.random.default_rng(1)
    points, normals = drawn(kind, rng)
    piece = fit_piece(kind, points, normals, NOISE)
    at, step = piece.feet(points[:20]), 1e-5
    shape = piece.shape_operators(at)
    distance, normal = piece.at(at)
    assert np.abs((normal * normals[:20]).sum(axis=1) - 1.0).max() < 1e-3
    for axis in np.eye(3):
        ahead, behind = piece.at(at + step * axis), piece.at(at - step * axis)
        slope = (ahead[0] - behind[0]) / (2.0 * step)
        assert np.abs(slope - normal @ axis).max() < 1e-6
        turned = (ahead[1] - behind[1]) / (2.0 * step)
        tangent = axis - (normal @ axis)[:, None] * normal
        # The derivative along the tangent part; across it normals turn as well.
        expected = (shape @ tangent[..., None])[..., 0]
        across = piece.at(at + step * normal)[1] - piece.at(at - step * normal)[1]
        turned -= (normal @ axis)[:, None] * across / (2.0 * step)
        assert np.abs(turned - expected).max() < 1e-6


@pytest.mark.parametrize("kind", list(Kind))
def test_a_piece_moves_turns_and_scales_with_its_samples(kind):
    rng = np.random.default_rng(2)
    points, normals = drawn(kind, rng)
    points = points + NOISE * rng.normal(size=points.shape)
    turn, shift, scale = random_rotation(rng), rng.normal(size=3), 250.0
    piece = fit_piece(kind, points, normals, NOISE)
    moved_points = scale * points @ turn.T + shift
    moved = fit_piece(kind, moved_points, normals @ turn.T, scale * NOISE)
    distance, normal, variance = piece.predicted(points)
    other = moved.predicted(moved_points)
    assert np.allclose(other[0], scale * distance, atol=1e-8 * scale)
    assert np.allclose(other[1], normal @ turn.T, atol=1e-8)
    assert np.allclose(other[2], scale**2 * variance, rtol=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_boss_and_a_hole_have_the_same_radius(side):
    rng = np.random.default_rng(3)
    points, normals = drawn(Kind.CYLINDER, rng)
    noisy = points + NOISE * rng.normal(size=points.shape)
    piece = fit_piece(Kind.CYLINDER, noisy, side * normals, NOISE)
    cylinder = refined_cylinder(piece, noisy, NOISE)
    assert cylinder.outward == side
    std = np.sqrt(cylinder.covariance[2, 2])
    assert abs(cylinder.radius - 5.0) < 3.0 * std < 0.05
    assert abs(cylinder.axis[1]) > np.cos(0.01)


@pytest.mark.parametrize("kind", [Kind.CYLINDER, Kind.CONE, Kind.TORUS])
def test_flat_samples_are_of_no_kind_that_is_bent(kind):
    points, normals = drawn(Kind.PLANE, np.random.default_rng(4))
    assert fit_piece(kind, points, normals, NOISE) is None


@pytest.mark.parametrize("kind", LAWFUL)
def test_a_surface_that_is_loosened_is_less_sure_by_that_variance_in_its_middle(kind):
    """A cone and a torus, which may move as a whole, are so at all of their points."""
    points, normals = drawn(kind, np.random.default_rng(6))
    piece = fit_piece(kind, points, normals, NOISE)
    at = points if kind in (Kind.CONE, Kind.TORUS) else piece.feet(piece.origin[None])
    more = piece.loosened(0.3**2).predicted(at)[2] - piece.predicted(at)[2]
    # The gradient at the foot of the origin is 1 to the noise of the fit.
    assert np.allclose(more, 0.3**2, rtol=0.02)


def test_a_flat_start_leads_to_no_cylinder():
    """A quadric that is a plane says nothing of an axis, whatever the samples are."""
    rng = np.random.default_rng(5)
    flat = fit_piece(Kind.QUADRIC, *drawn(Kind.PLANE, rng), NOISE)
    assert refined_cylinder(flat, drawn(Kind.CYLINDER, rng)[0], NOISE) is None


@pytest.mark.parametrize("part", [0.35, 1.0, 2.0, np.pi])
def test_a_part_of_a_ring_leads_to_the_whole(part):
    """A ring of radii 40 and 15, from a third of a quarter of its tube to all of it, turned at
    random, twelve draws: both radii within 5 of the predicted deviations, and the samples within
    their noise. Rings that are more than noise off are as wrong as none is."""
    rng, found = np.random.default_rng(7), 0
    for _ in range(12):
        u, v = part * rng.uniform(-1.0, 1.0, (2, 400)) + rng.uniform(-3.0, 3.0, (2, 1))
        radial, turn = np.stack([np.cos(u), np.sin(u), 0 * u], 1), random_rotation(rng)
        normals = np.cos(v)[:, None] * radial + np.sin(v)[:, None] * np.array([0.0, 0.0, 1.0])
        points = (40.0 * radial + 15.0 * normals) @ turn.T + NOISE * rng.normal(size=(400, 3))
        piece = fit_piece(Kind.TORUS, points, normals @ turn.T, NOISE)
        if piece is None or np.sqrt(np.mean(piece.at(points)[0] ** 2)) > 1.2 * NOISE:
            continue
        found += 1
        off = piece.scale * piece.coefficients[6:] - [40.0, 15.0]
        std = piece.scale * np.sqrt(np.diagonal(piece.covariance)[6:])
        assert (np.abs(off) < 5.0 * std).all()
    assert found >= 11


@pytest.mark.parametrize("kind", [Kind.PLANE, Kind.SPHERE, *list(Kind)[Kind.QUADRIC :]])
def test_a_linear_fit_gives_a_piece_of_flat_samples(kind):
    """It follows them within their noise: the prior holds what they leave open."""
    points, normals = drawn(Kind.PLANE, np.random.default_rng(6))
    piece = fit_piece(kind, points, normals, NOISE)
    assert piece is not None and np.abs(piece.at(points)[0]).max() < NOISE


@pytest.mark.parametrize(("kind", "radius"), [(Kind.SPHERE, 9.0), (Kind.CYLINDER, 5.0)])
def test_distances_of_spheres_and_cylinders_are_exact_far_from_them(kind, radius):
    """By the closed forms |x| - r, and that across the axis y. To first order half of the radius
    inside would be 0.75 of it away: the radii of fillets on round walls came out too large."""
    rng = np.random.default_rng(0)
    points, normals = LAWFUL[kind](*rng.uniform(-8.0, 8.0, (2, 400)))
    piece = fit_piece(kind, points, normals, 1e-3)
    far = rng.uniform(-20.0, 20.0, (500, 3))
    across = far[:, ::2] if kind is Kind.CYLINDER else far
    true = np.linalg.norm(across, axis=1) - radius
    # The samples are exact; the priors of the fit move its coefficients by some 1e-8.
    assert np.abs(piece.at(far)[0] - true).max() < 1e-5


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cone_and_a_countersink_have_the_same_angle_and_apex(side):
    points, normals = drawn(Kind.CONE, np.random.default_rng(7))
    noisy = points + NOISE * np.random.default_rng(8).normal(size=points.shape)
    law = law_of(fit_piece(Kind.CONE, noisy, side * normals, NOISE), noisy, NOISE)
    assert law.words.startswith("cone" if side > 0.0 else "hollow cone")
    assert abs(law.numbers["half_angle"] - 0.3) < 3.0 * law.numbers["half_angle_std"] < 0.02
    assert np.linalg.norm(law.numbers["apex"]) < 4.0 * np.sqrt(3.0) * law.numbers["apex_std"] < 1.0
    assert law.numbers["axis"][2] > np.cos(4.0 * law.numbers["axis_std"])


def test_a_cylinder_is_no_cone():
    """Its apex would be farther than samples show."""
    points, normals = drawn(Kind.CYLINDER, np.random.default_rng(9))
    noisy = points + 1e-3 * NOISE * np.random.default_rng(8).normal(size=points.shape)
    assert fit_piece(Kind.CONE, noisy, normals, 1e-3 * NOISE) is None


def test_an_elliptic_cone_is_no_cone_but_a_quadric():
    """With half axes of 1 and 0.8: its samples are up to a tenth of a radius off any round one."""
    rng = np.random.default_rng(10)
    u, height = rng.uniform(-np.pi, np.pi, 400), rng.uniform(12.0, 20.0, 400)
    x, y, slope = np.cos(u), 0.8 * np.sin(u), 0.3 * np.ones(400)
    points = np.stack([0.3 * height * x, 0.3 * height * y, height], axis=1)
    normals = np.stack([x, y / 0.64, -slope], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert fit_piece(Kind.CONE, points, normals, NOISE) is None
    quadric = fit_piece(Kind.QUADRIC, points, normals, NOISE)
    assert np.abs(quadric.at(points)[0]).max() < NOISE
