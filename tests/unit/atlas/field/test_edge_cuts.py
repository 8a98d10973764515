"""Faces that bound each other at edges: a point is inside where the body has it inside."""

import igl
import numpy as np
import pytest

from tests.lawful import NOISE, known_body
from tests.lawful_meshes import lawful_object

NAMES = ["box", "step", "stairs", "T-slot", pytest.param("two blocks", marks=pytest.mark.slow)]


@pytest.mark.parametrize("name", NAMES)
def test_what_is_inside_by_the_faces_is_inside(name):
    """Points all over the bounding box, those within five deviations of the surface left out. On
    stairs a face is ended by one that others end in turn; on two blocks two faces face each other
    on one plane."""
    body, mesh = known_body(name, 40), lawful_object(name)
    low, high = mesh.vertices.min(axis=0) - 2.0, mesh.vertices.max(axis=0) + 2.0
    points = np.random.default_rng(0).uniform(low, high, (20_000, 3))
    tree = igl.AABB()
    tree.init(mesh.vertices, mesh.faces)
    away = np.sqrt(tree.squared_distance(mesh.vertices, mesh.faces, points)[0])
    inside = igl.fast_winding_number(mesh.vertices, mesh.faces, points) > 0.5
    found, _ = body.at(points)
    wrong = (found.distance < 0.0) != inside
    # Beside edges that no contour came near: two in a thousand on a T-slot.
    assert wrong[away > 5.0 * NOISE].mean() < 3e-3


def test_a_face_goes_on_where_its_samples_lie_beyond_another():
    """The front and back of a block with a T-slot, below the floor of the slot: they end at the
    sides of its neck, far above, and have samples beyond the planes of these here. Points up to 2
    within the body, of which 1 in 100 was outside while three samples alone were asked."""
    body = known_body("T-slot", 40)
    points = np.random.default_rng(0).uniform([-16, 6, 0.1], [16, 11.9, 2], (10_000, 3))
    back = points * [1, 1, -1] + [0, 0, 40]
    found, _ = body.at(np.concatenate([points, back]))
    assert (found.distance > 0.0).mean() < 2e-3
