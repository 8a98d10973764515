"""Which parts of a body lie inside others."""

import numpy as np
import pytest
import trimesh

from touchatlas.sim.judge.truth import truth_from_mesh
from touchatlas.sim.world.parts import hidden_area, part_of_faces


def box(side, x=0.0, inside_out=False):
    body = trimesh.creation.box((side,) * 3).apply_translation([x, 0.0, 0.0])
    if inside_out:
        body.invert()
    return body


def area_hidden(*bodies):
    both = trimesh.util.concatenate(list(bodies))
    return hidden_area(both.vertices, both.faces)


def test_parts_beside_each_other_are_not_hidden():
    """The area of a cube is six times the square of its side."""
    assert area_hidden(box(1.0)) == 0.0
    assert area_hidden(box(3.0), box(1.0, x=5.0)) == 0.0


def test_walls_that_bodies_have_inside_of_each_other_are_hidden():
    """Half of the small box sticks out: of 60 its half, 3, and a square of the large one, 1."""
    both = trimesh.util.concatenate([box(3.0), box(1.0, x=1.5)])
    truth = truth_from_mesh(both.vertices, both.faces, np.random.default_rng(0))
    # Of 40,000 samples, four standard errors.
    assert truth.hidden_area == pytest.approx(4.0 / 60.0, abs=0.005)
    # One that touches the other from inside: five of its sides.
    assert area_hidden(box(3.0), box(1.0, x=1.0)) == pytest.approx(5.0 / 60.0)
    assert truth.hidden.mean() == pytest.approx(4.0 / 60.0, abs=0.005)


def test_a_part_inside_another_is_hidden_whichever_way_it_is_wound():
    assert area_hidden(box(3.0), box(1.0)) == pytest.approx(0.1)
    assert area_hidden(box(3.0), box(1.0, inside_out=True)) == pytest.approx(0.1)
    # A body in the cavity of a body: both inner surfaces are out of reach.
    nested = area_hidden(box(4.0), box(2.0, inside_out=True), box(1.0))
    assert nested == pytest.approx(5.0 / 21.0)


def test_a_ball_in_an_open_bowl_can_be_touched():
    bowl = trimesh.creation.icosphere(subdivisions=3, radius=10.0)
    bowl.update_faces(bowl.triangles_center[:, 2] < 4.0)
    ball = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
    assert area_hidden(bowl, ball) == 0.0


def test_neither_unit_nor_place_changes_what_is_hidden():
    both = trimesh.util.concatenate([box(3.0), box(1.0)])
    for scale, shift in ((1e-3, 0.0), (1e3, 0.0), (1.0, 1e4)):
        assert hidden_area(scale * both.vertices + shift, both.faces) == pytest.approx(0.1)


def test_vertices_of_no_triangle_are_no_part():
    faces = np.array([[1, 2, 3], [5, 6, 7]])
    assert part_of_faces(faces).tolist() == [0, 1]
