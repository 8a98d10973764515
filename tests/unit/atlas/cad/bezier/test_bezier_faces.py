"""Bezier faces within a bound of a surface, as few as it takes."""

import numpy as np
import pytest

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball, ball_of, cube_quads
from touchatlas.atlas.cad.bezier.bezier import face_points
from touchatlas.atlas.cad.bezier.bezier_faces import bezier_faces


def bumpy(points):
    """Distance, of first order, from a ball with a bump of a tenth of it around the x-axis."""
    distance, normal = ball(points)
    bump = 0.1 * RADIUS * np.exp(8.0 * (normal[:, 0] - 1.0))
    across = np.eye(3)[0] - normal[:, :1] * normal
    slope = normal - (8.0 * bump / (distance + RADIUS))[:, None] * across
    length = np.linalg.norm(slope, axis=1)
    return (distance - bump) / length, slope / length[:, None]


@pytest.mark.parametrize("bound", [1e-1, 1e-3, 1e-4])
def test_faces_are_within_the_bound(bound):
    tree, errors = bezier_faces(*cube_quads(), ball, bound)
    assert errors.max() <= bound
    t = np.linspace(0.0, 1.0, 21)
    u, v = (x.ravel() for x in np.meshgrid(t, t))
    points = face_points(np.array(tree.controls), u, v).reshape(-1, 3)
    assert np.abs(ball(points)[0]).max() <= 1.3 * bound


def test_a_thousandth_of_the_bound_takes_a_few_times_more_faces():
    """As the error falls with the fourth power of the size at least: less than 1000^(2 / 4)."""
    counts = [len(bezier_faces(*cube_quads(), ball, bound)[0].faces) for bound in (1e-1, 1e-4)]
    assert counts[0] == 6 < counts[1] <= 6 * 16


def test_only_faces_of_the_bump_are_halved():
    tree, errors = bezier_faces(*cube_quads(), bumpy, 1e-2)
    middles = face_points(np.array(tree.controls), [0.5], [0.5])[:, 0]
    assert errors.max() <= 1e-2
    assert (middles[:, 0] < -0.9 * RADIUS).sum() == 1
    assert (middles[:, 0] > 0.5 * RADIUS).sum() >= 16


def test_faces_scale():
    tree, errors = bezier_faces(*cube_quads(), ball, 1e-3)
    small, its = bezier_faces(*cube_quads(1e-3 * RADIUS), ball_of(1e-3 * RADIUS), 1e-6)
    assert its == pytest.approx(1e-3 * errors, rel=1e-6)
    assert np.array(small.controls) == pytest.approx(1e-3 * np.array(tree.controls), rel=1e-6)


def test_where_a_surface_jumps_by_less_than_two_bounds_faces_stay():
    """Halves of faces across a jump are no nearer to it."""

    def torn(points):
        distance, normal = ball(points)
        return distance - 0.1 * (points[:, 0] > 0.3), normal

    tree, errors = bezier_faces(*cube_quads(), torn, 0.04)
    assert 0.04 < errors.max() < 0.08
    assert len(tree.faces) < 100
