"""Edges that no contour crossed: samples of two faces on one side of each other imply one."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import NOISE, PLATE, box_distance, known_body
from touchatlas.atlas.field.face_trees import FaceTrees
from touchatlas.atlas.field.implied_edges import implied_edges

body = lru_cache(known_body)


def implied(name: str, count: int) -> dict[tuple[int, int], float]:
    """What is implied where no edge is known."""
    faces = body(name, count).faces
    pairs = implied_edges(FaceTrees(replace(faces, edges=())), body(name, count).reach)
    return {(first, second): sign for first, second, sign in pairs}


@pytest.mark.parametrize("name", ["box", "step", "stairs"])
def test_what_is_implied_has_the_sign_of_the_edge_that_contours_show(name):
    """A face with a concave outline lies on both sides of another that it meets, and implies
    nothing there."""
    found = implied(name, 40)
    sharp = {(e.first, e.second): e.kind.sign for e in body(name, 40).faces.edges if e.kind.sharp}
    both = found.keys() & sharp.keys()
    assert len(both) >= 12
    assert all(found[pair] == sharp[pair] for pair in both)


def test_faces_that_a_third_keeps_apart_imply_none():
    """The upper and lower floor of a step: one lies within the other, which lies outside of it."""
    faces = body("step", 40).faces.faces
    up = [face.id for face in faces if face.pieces[0].axes[2] @ [0, 1, 0] > 0.99]
    assert len(up) == 2
    assert tuple(sorted(up)) not in implied("step", 40)


def test_known_edges_are_not_implied():
    found = body("box", 40)
    pairs = implied_edges(FaceTrees(found.faces), found.reach)
    assert not {pair[:2] for pair in pairs} & {(e.first, e.second) for e in found.faces.edges}


def test_sides_of_a_slot_lie_outside_of_each_other_and_those_of_a_plate_inside():
    trees = FaceTrees(body("plate", 50).faces)
    normals = [face.pieces[0].axes[2] for face in trees.faces.faces]
    found = {pair[:2]: pair[2] for pair in implied_edges(trees, body("plate", 50).reach)}
    opposite = [k for k, normal in enumerate(normals) if abs(normal[2]) > 0.99]
    assert found[tuple(opposite)] == 1.0
    normals = [face.pieces[0].axes[2] for face in body("T-slot", 40).faces.faces]
    middles = [face.middle for face in body("T-slot", 40).faces.faces]
    found = implied("T-slot", 40)
    # The sides of its neck, 12 apart, where the extent is 96.
    neck = [
        k
        for k, (normal, middle) in enumerate(zip(normals, middles, strict=True))
        if abs(normal[0]) > 0.99 and middle[1] > 22.0 and abs(middle[0]) < 8.0
    ]
    assert found[tuple(neck)] == -1.0


def points_about_the_plate(beyond: float) -> np.ndarray:
    """(n, 3) points within the rims of the plate, up to a distance from it, and inside."""
    rng = np.random.default_rng(0)
    inner = 0.9 * PLATE[:2] * rng.uniform(-1.0, 1.0, size=(4000, 2))
    height = (PLATE[2] + beyond) * rng.uniform(-1.0, 1.0, size=4000)
    return np.column_stack([inner, height])


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_the_distance_from_a_thin_plate_is_that_of_its_nearer_side(scale):
    """Of its planes, whose errors are a few thousandths; ten noises are none of them. A plate 4
    thick, whose contours are some 6 apart: the nearest sample often lies on the far side."""
    points = points_about_the_plate(1.5)
    found = body("plate", 50, scale).field.at(scale * points)
    off = np.abs(found.distance / scale - box_distance(points, PLATE))
    assert off.max() < 10.0 * NOISE


def test_what_is_between_two_sides_is_not_doubted():
    """Half of the difference of both sides would be 2."""
    found = body("plate", 50).field.at(points_about_the_plate(0.0))
    assert np.quantile(found.deviation, 0.99) < 5.0 * NOISE


def test_two_parts_of_one_plane_imply_no_edge():
    """The samples of either lie on the other, and on no side of it."""
    faces = body("box", 40).faces
    top = faces.faces[0]
    half = np.arange(len(top.samples)) % 2 == 0
    parts = [replace(top, samples=top.samples[half])]
    parts.append(replace(top, samples=top.samples[~half], id=len(faces)))
    split = replace(faces, faces=(parts[0], *faces.faces[1:], parts[1]), edges=())
    pairs = {edge[:2] for edge in implied_edges(FaceTrees(split), body("box", 40).reach)}
    assert (0, len(faces)) not in pairs and len(pairs) > 12
