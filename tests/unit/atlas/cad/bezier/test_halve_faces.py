"""Halved faces and their neighbours share the curves of their edges."""

import numpy as np
import pytest

from tests.unit.atlas.cad.smooth_bodies import RADIUS, ball, cube_quads
from touchatlas.atlas.cad.bezier.bezier import curve_points, face_points
from touchatlas.atlas.cad.bezier.bezier_brep import traces
from touchatlas.atlas.cad.bezier.bezier_tree import BezierTree, first_tree
from touchatlas.atlas.cad.bezier.halve_faces import with_halved

T = np.linspace(0.0, 1.0, 9)


def largest_gap(tree: BezierTree) -> float:
    """Largest distance of the edges of faces from the curves that they share, length."""
    worst = 0.0
    for uses, control in zip(tree.faces, tree.controls, strict=True):
        for use, first, last in traces(tree, uses):
            along = first + T[:, None] * (last - first)
            off = face_points(control, *along.T) - curve_points(tree.control(use), T)
            worst = max(worst, float(np.abs(off).max()))
    return worst


@pytest.fixture
def tree():
    return first_tree(*cube_quads(), ball, 3)


def test_neighbouring_faces_share_their_edge_curves(tree):
    """A face beside others that were halved twice keeps its side, of which they have quarters."""
    assert largest_gap(tree) < 1e-13 * RADIUS
    for chosen in ([0], [0, 6, 7], [1, 2], range(9)):
        tree, _ = with_halved(tree, list(chosen), ball)
        assert largest_gap(tree) < 1e-13 * RADIUS


def test_a_halved_face_is_four_and_its_neighbours_stay(tree):
    halved, numbers = with_halved(tree, [2], ball)
    assert numbers.tolist() == [[2, 6, 7, 8]]
    assert len(halved.faces) == len(halved.controls) == 9
    for k in (0, 1, 3, 4, 5):
        assert (halved.controls[k] == tree.controls[k]).all()
    assert len(tree.faces) == 6 and all(side.halves is None for side in tree.sides)


def test_halves_of_all_faces_are_nearer_to_a_ball(tree):
    """The error of a bicubic face falls with the fourth power of its size at least."""
    halved, _ = with_halved(tree, range(6), ball)
    u, v = (x.ravel() for x in np.meshgrid(T, T))
    before, after = (
        np.abs(ball(face_points(np.array(one.controls), u, v).reshape(-1, 3))[0]).max()
        for one in (tree, halved)
    )
    assert after < before / 16.0
