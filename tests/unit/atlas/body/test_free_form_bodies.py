"""Bodies of free-form faces between sharp edges: a box with waves on its top."""

import igl
import numpy as np
import pytest

from tests.lawful import touched_mesh
from tests.lawful_meshes import HALF, lawful_object
from touchatlas.atlas.body.choose import KnownBody, body_of_one, description_length, look_for_body
from touchatlas.atlas.samples.sample_pool import SamplePool

NOISE = 0.02
STD = np.sqrt(2.0) * NOISE


@pytest.fixture(scope="module")
def known() -> KnownBody:
    pool = SamplePool()
    pool.add(*touched_mesh("wavy", 22, NOISE), False, NOISE)
    return look_for_body(pool, STD)


def test_a_box_with_a_free_form_top_is_a_body(known):
    assert not known.is_one_face
    kinds = [face.kind for face in known.body.faces.faces]
    assert "free-form" in kinds
    assert kinds.count("plane") >= 5
    assert description_length(known.body) < description_length(body_of_one(known.body.samples))


def test_its_surface_is_within_the_tolerance_where_it_is_known(known):
    """The tolerance is five times the noise: few samples make the top less sure than they are."""
    points, normals = lawful_object("wavy").sample(5000, np.random.default_rng(0))
    found, there = known.body.at(points)
    assert there.mean() > 0.9
    off = np.abs(found.distance[there])
    assert (off < 5.0 * NOISE).mean() > 0.99
    assert np.median((found.normal * normals).sum(axis=1)[there]) > np.cos(np.deg2rad(2.0))


def test_what_is_inside_of_it_is_inside(known):
    mesh = lawful_object("wavy")
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (5000, 3)) * HALF
    tree = igl.AABB()
    tree.init(mesh.vertices, mesh.faces)
    away = np.sqrt(tree.squared_distance(mesh.vertices, mesh.faces, points)[0])
    inside = igl.fast_winding_number(mesh.vertices, mesh.faces, points) > 0.5
    wrong = (known.body.at(points)[0].distance < 0.0) != inside
    assert wrong[away > 0.5].mean() < 5e-3
