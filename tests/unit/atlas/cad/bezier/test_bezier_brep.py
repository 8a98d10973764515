"""Bezier faces as a Brep, and the angles between neighbours."""

import numpy as np
import pytest

from tests.unit.atlas.cad.smooth_bodies import ball, cube_quads
from touchatlas.atlas.cad.bezier.bezier_brep import bezier_brep, largest_turn
from touchatlas.atlas.cad.bezier.bezier_tree import first_tree
from touchatlas.atlas.cad.bezier.halve_faces import with_halved


def plane(points):
    return points[:, 2], np.tile([0.0, 0.0, 1.0], (len(points), 1))


def two_squares():
    """Two squares that share an edge on the y-axis."""
    low = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    points = np.concatenate([low, low + [0.0, 1.0, 0.0]])
    return first_tree(points, np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), plane, 3)


def test_a_closed_body_has_each_edge_twice_in_opposite_directions():
    tree, _ = with_halved(first_tree(*cube_quads(), ball, 3), [0, 3], ball)
    brep = bezier_brep(tree)
    uses = [(u.edge, u.forward) for face in brep.faces for u in face.uses]
    wanted = {(edge, way) for edge in range(len(brep.edges)) for way in (False, True)}
    assert len(uses) == len(wanted) and set(uses) == wanted
    assert brep.parts == (tuple(range(len(brep.faces))),)
    assert len(brep.vertices) - len(brep.edges) + len(brep.faces) == 2


def test_wires_run_from_vertex_to_vertex():
    tree, _ = with_halved(first_tree(*cube_quads(), ball, 3), [0], ball)
    brep = bezier_brep(tree)
    for face in brep.faces:
        ends = [
            (brep.edges[u.edge].start, brep.edges[u.edge].end)[:: 1 if u.forward else -1]
            for u in face.uses
        ]
        assert [b for _, b in ends] == [a for a, _ in ends[1:] + ends[:1]]


def test_two_bodies_are_two_parts():
    points, quads = cube_quads()
    both = first_tree(np.concatenate([points, points]), np.concatenate([quads, quads + 8]), ball, 3)
    assert bezier_brep(both).parts == (tuple(range(6)), tuple(range(6, 12)))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.01, 0.5])
def test_the_largest_turn_is_the_angle_between_two_planes(angle):
    tree, (sine, cosine) = two_squares(), (np.sin(angle), np.cos(angle))
    about_y = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    tree.controls[1] = tree.controls[1] @ about_y
    assert largest_turn(tree) == pytest.approx(angle, rel=1e-6, abs=1e-12)
