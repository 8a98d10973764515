"""Sharp turns: where contours run over sharp edges, and what both sides say of points beside."""

from dataclasses import replace

import igl
import numpy as np
import pytest

from tests.lawful import NOISE, samples_of_touches, touched_mesh
from tests.lawful_meshes import HALF, STEP, lawful_object
from touchatlas.atlas.body.choose import body_of_one
from touchatlas.atlas.body.one_face import face_of_all
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.surfaces.sharp_turns import MANY, SharpTurns, share_of_contours, sharp_turns

STD = np.sqrt(2.0) * NOISE
NONE = np.zeros((0, 2), int)


def touched_at(name: str, count: int) -> ContourSamples:
    return samples_of_touches(touched_mesh(name, count, NOISE), STD)


def test_each_turn_of_a_box_has_a_sample_on_two_of_its_faces():
    samples = touched_at("box", 20)
    pairs = sharp_turns(samples)
    assert len(pairs) > 20
    face = np.abs(np.abs(samples.points[pairs]) - HALF).argmin(axis=2)
    assert (face[:, 0] != face[:, 1]).all()


def test_a_smooth_body_has_no_turns():
    assert not len(sharp_turns(touched_at("ellipsoid", 30)))


def test_edges_are_convex_or_concave_as_they_are():
    """A step has one concave edge, at the middle of its profile. Samples beside it are nearest to a
    turn over it."""
    samples = touched_at("step", 40)
    body = body_of_one(samples)
    normals = body.field.at(samples.points).normal
    turns = SharpTurns(sharp_turns(samples), samples.points, normals)
    beside = turns.beside(samples.points, normals, 2.0)
    corner = lawful_object("step").vertices.min(axis=0)[:2]
    profile = samples.points[beside.rows][:, :2] - corner
    away = np.linalg.norm(profile - STEP[5], axis=1)
    assert np.mean(beside.sign[away < 1.5] < 0.0) > 0.9
    assert (beside.sign[away > 6.0] > 0.0).all()


@pytest.mark.parametrize(("name", "count", "most"), [("pyramid", 20, 0.5), ("step", 40, 0.7)])
def test_fewer_points_are_on_the_wrong_side_where_both_sides_of_edges_cut_each_other(
    name, count, most
):
    """Those within a few steps of the surface of bodies that are one free-form face; of those
    beside edges alone it would be fewer."""
    mesh, rng = lawful_object(name), np.random.default_rng(0)
    points = mesh.sample(4000, rng)[0] + rng.normal(0.0, 1.0, (4000, 3))
    tree = igl.AABB()
    tree.init(mesh.vertices, mesh.faces)
    off = np.sqrt(tree.squared_distance(mesh.vertices, mesh.faces, points)[0]) > 5.0 * NOISE
    inside = igl.fast_winding_number(mesh.vertices, mesh.faces, points) > 0.5
    samples = touched_at(name, count)
    surface = body_of_one(samples).field.trees.free_form(0)
    wrong = [
        np.mean((replace(surface, pairs=pairs).at(points)[:, 0] < 0.0)[off] != inside[off])
        for pairs in (sharp_turns(samples), NONE)
    ]
    assert wrong[0] < most * wrong[1]
    assert wrong[1] > 0.01


def test_without_turns_nothing_lies_beside_them():
    turns = SharpTurns(NONE, np.zeros((1, 3)), np.ones((1, 3)))
    assert not len(turns.beside(np.zeros((3, 3)), np.ones((3, 3)), 1.0).rows)


def test_a_turn_that_is_neither_convex_nor_concave_is_none():
    """Two normals along the chord between their samples."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    normals = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    turns = SharpTurns(np.array([[0, 1]]), points, normals)
    assert not len(turns.beside(points, normals, 1.0).rows)


def test_folds_of_a_body_with_few_turns_are_no_edges():
    """A ball and an edge that two of its contours run over."""
    samples = touched_at("cut ball", 30)
    faces = face_of_all(samples)
    assert 0 < share_of_contours(samples, faces.turns) < MANY
    assert not faces.is_sharp
    assert not len(body_of_one(samples).field.trees.free_form(0).pairs)


def test_a_box_is_sharp():
    faces = face_of_all(touched_at("box", 20))
    assert faces.is_sharp and len(faces.turns)
