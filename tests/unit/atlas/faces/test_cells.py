"""Cells: samples say which of the parts between the extended faces lie inside of the body."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import (
    HALF,
    body_of,
    box_distance,
    samples_of_touches,
    step_distance,
    touched_mesh,
)
from touchatlas.atlas.faces.cells import Cells
from touchatlas.atlas.faces.face_trees import FaceTrees

NOISE = 0.02


@lru_cache
def body(name: str, scale: float = 1.0):
    return body_of(samples_of_touches(touched_mesh(name, 40, NOISE), NOISE, scale=scale))


def settled(faces, points, chosen_face: int):
    """Distances of points after the values of one face were chosen for all, and doubted points."""
    trees = FaceTrees(faces)
    decides = np.full(len(points), chosen_face)
    chosen = trees.values(chosen_face, points)
    distances = trees.all_distances(points)
    doubted = Cells(trees).settle(points, distances, decides.copy(), decides, chosen)
    return chosen[:, 0], decides, doubted


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@pytest.mark.parametrize("chosen", [0, 3, 5])
def test_within_a_box_votes_correct_any_choice(chosen, scale):
    """The nearest of six planes decides, whichever was chosen before: all cells about it have
    votes. Planes err by thousandths; five noises are none of them."""
    points = np.random.default_rng(0).uniform(-HALF, HALF, (5000, 3))
    distance, _, doubted = settled(body("box", scale).faces, scale * points, chosen)
    assert np.abs(distance / scale - box_distance(points)).max() < 5.0 * NOISE
    assert len(doubted) == 0


def test_votes_correct_a_cut_by_the_extension_of_another_face():
    """Below the lower floor of a step, beside its riser: the riser ends at that floor, and the
    extended riser would cut the body in two."""
    faces = body("step").faces
    riser = [
        face.id
        for face in faces.faces
        if face.pieces[0].axes[2] @ [-1, 0, 0] > 0.99 and face.middle[0] > 20.0
    ]
    points = np.random.default_rng(0).uniform([22, 5, 5], [29, 15, 25], (2000, 3))
    assert (FaceTrees(faces).distances(riser[0], points) > 0.0).all()
    distance, decides, _ = settled(faces, points, riser[0])
    assert np.abs(distance - step_distance(points)).max() < 5.0 * NOISE
    assert not (decides == riser[0]).any()


def test_a_cell_without_votes_changes_nothing():
    """Beyond an edge of a box, outside of both planes: no sample lies beside that part of space."""
    faces = body("box").faces
    points = HALF * [1.2, 1.2, 0.0] + np.random.default_rng(0).uniform(-1, 1, (500, 3))
    right = [face.id for face in faces.faces if face.pieces[0].axes[2] @ [1, 0, 0] > 0.99]
    distance, decides, _ = settled(faces, points, right[0])
    assert (decides == right[0]).all()
    assert (distance == FaceTrees(faces).distances(right[0], points)).all()


def test_two_parts_of_one_plane_are_one_face():
    """One face is split in two: each lies within the noise of the other, and neither hides the
    votes of the other's samples."""
    faces = body("box").faces
    top = faces.faces[0]
    half = faces.points[top.samples] @ [1, 1, 0] > 0.0
    parts = [replace(top, samples=top.samples[half])]
    parts.append(replace(top, samples=top.samples[~half], id=len(faces)))
    of = faces.of.copy()
    of[parts[1].samples] = len(faces)
    split = replace(faces, faces=(parts[0], *faces.faces[1:], parts[1]), of=of)
    points = np.random.default_rng(0).uniform(-HALF, HALF, (2000, 3))
    distance, _, doubted = settled(split, points, 2)
    assert np.abs(distance - box_distance(points)).max() < 5.0 * NOISE
    assert len(doubted) == 0
