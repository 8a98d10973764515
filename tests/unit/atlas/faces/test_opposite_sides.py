"""Opposite sides: points of a thin wall belong to the nearer side, not to that of the nearest
sample."""

from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import PLATE, body_of, box_distance, samples_of_touches, touched_mesh
from touchatlas.atlas.faces.face_trees import FaceTrees
from touchatlas.atlas.faces.opposite_sides import OppositeSides

NOISE = 0.02


@lru_cache
def plate(scale: float = 1.0):
    """A plate 4 thick, whose contours are some 6 apart."""
    columns = touched_mesh("plate", 60, NOISE)
    return body_of(samples_of_touches(columns, 1.5 * NOISE, scale=scale))


def points_about_the_plate(beyond: float) -> np.ndarray:
    """(n, 3) points within the rims of the plate, up to a distance from it, and inside."""
    rng = np.random.default_rng(0)
    inner = 0.9 * PLATE[:2] * rng.uniform(-1.0, 1.0, size=(4000, 2))
    height = (PLATE[2] + beyond) * rng.uniform(-1.0, 1.0, size=4000)
    return np.column_stack([inner, height])


@pytest.mark.parametrize("scale", [1.0, 1e-3])
def test_the_distance_from_a_thin_plate_is_that_of_its_nearer_side(scale):
    """Of its planes, whose errors are a few thousandths; ten noises are none of them."""
    points = points_about_the_plate(1.5)
    found = plate(scale).field.at(scale * points)
    off = np.abs(found.distance / scale - box_distance(points, PLATE))
    assert off.max() < 10.0 * NOISE


def test_what_is_between_two_sides_is_not_doubted():
    """Half of the difference of both sides would be 2."""
    found = plate().field.at(points_about_the_plate(0.0))
    assert np.quantile(found.deviation, 0.99) < 5.0 * NOISE


def test_the_nearest_sample_alone_would_err():
    """Otherwise these tests show nothing: many points have their nearest sample on the far side."""
    body, points = plate(), points_about_the_plate(0.5)
    nearest = body.field.trees.faces.of[body.field._tree.query(points)[1]]
    off = np.empty(len(points))
    for face in range(len(body.faces)):
        mine = nearest == face
        off[mine] = np.abs(body.field.trees.distances(face, points[mine]))
    wrong = np.abs(off - np.abs(box_distance(points, PLATE))) > 1.0
    assert wrong.mean() > 0.02


def test_sides_that_meet_at_right_angles_are_no_opposite_ones():
    trees = FaceTrees(plate().faces)
    pairs = OppositeSides(trees, plate().reach).pairs
    normals = [face.pieces[0].axes[2] for face in plate().faces.faces]
    assert pairs and all(normals[a] @ normals[b] < -0.99 for a, b in pairs)
    assert {(b, a) for a, b in pairs} == set(pairs)


def test_a_side_beyond_the_reach_is_none():
    trees = FaceTrees(plate().faces)
    assert OppositeSides(trees, PLATE[2]).pairs == []
