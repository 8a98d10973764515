"""Smooth rims between lawful faces: what they say of points inside of a body."""

import igl
import numpy as np
import pytest

from tests.lawful import NOISE, body_of, samples_of_touches, touched, touched_mesh
from tests.lawful_meshes import lawful_object
from touchatlas.sim.study.bodies import slab


def test_the_far_side_of_a_rounded_rim_is_no_surface_inside_of_a_plate():
    """The rims of a plate of 70 x 50 x 10 are half cylinders of radius 4.9, whose far sides pass
    its middle. Points there were outside of them, and the surface had pieces inside of the body,
    50 tolerances from the true one."""
    columns = touched(slab(10.0), 32, NOISE, 3, 16.0, 16)
    body = body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE))
    assert [face.kind for face in body.faces.faces].count("cylinder") >= 2
    points = np.random.default_rng(0).uniform([-30, -20, -1], [30, 20, 1], (5000, 3))
    found, _ = body.at(points)
    assert (found.distance < -3.5).all()


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_wall_of_a_cup_ends_at_its_round_lip(seed):
    """Wall and air above the lip are on the same sides of all faces. Inside and outside of the wall
    go over into the bottom by radii of 8 and 4, so that a ball decides on both sides of it. Of
    40,000 points farther than five deviations from the surface all are on the right side."""
    columns = touched_mesh("cup", 60, NOISE, seed)
    body = body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE))
    blunt = [edge for edge in body.faces.edges if edge.radius > 0.0]
    for edge, radius in zip(sorted(blunt, key=lambda edge: edge.radius), (4.0, 8.0), strict=True):
        assert abs(edge.radius - radius) < 4.0 * edge.radius_std < 3.0 * NOISE
    cup = lawful_object("cup")
    points = np.random.default_rng(0).uniform([-22, -22, -2], [22, 22, 44], (40_000, 3))
    tree = igl.AABB()
    tree.init(cup.vertices, cup.faces)
    away = np.sqrt(tree.squared_distance(cup.vertices, cup.faces, points)[0])
    inside = igl.fast_winding_number(cup.vertices, cup.faces, points) > 0.5
    wrong = (body.at(points)[0].distance < 0.0) != inside
    assert not wrong[away > 5.0 * NOISE].any()
