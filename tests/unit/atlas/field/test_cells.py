"""Cells: samples say which of the parts between the extended faces lie inside of the body."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import (
    HALF,
    NOISE,
    box_distance,
    known_body,
    step_distance,
)
from touchatlas.atlas.field.cells import Cells
from touchatlas.atlas.field.face_trees import FaceTrees

# No sample is near: the surface may be anywhere.
FAR = np.inf
# Distance from samples up to which a rounding is believed: these bodies have none.
REACH = 10.0


@lru_cache
def body(name: str, scale: float = 1.0):
    return known_body(name, 40, scale)


def settled(faces, points, chosen_face: int):
    """Distances of points after the values of one face were chosen for all, and doubted points."""
    trees = FaceTrees(faces)
    decides = np.full(len(points), chosen_face)
    chosen = trees.values(chosen_face, points)
    distances = trees.all_distances(points)
    doubted, _ = Cells(trees, REACH).settle(points, distances, FAR, decides.copy(), decides, chosen)
    return chosen[:, 0], decides, doubted


def decided(faces, points):
    """What votes alone decide."""
    trees = FaceTrees(faces)
    return Cells(trees, REACH).decide(points, trees.all_distances(points))


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


def test_beyond_an_edge_is_air_whichever_face_was_chosen():
    """The nearest sample may be one of the far side of a thin wall, whose plane says inside: by the
    edge the cell opposite of the body is air, though no sample votes for it."""
    faces = body("box").faces
    points = HALF * [1.2, 1.2, 0.0] + np.random.default_rng(0).uniform(-1, 1, (500, 3))
    left = [face.id for face in faces.faces if face.pieces[0].axes[2] @ [-1, 0, 0] > 0.99]
    assert (FaceTrees(faces).distances(left[0], points) < 0.0).all()
    distance, _, _ = settled(faces, points, left[0])
    assert (distance > 0.0).all()
    assert np.abs(distance - (points[:, :2] - HALF[:2]).max(axis=1)).max() < 5.0 * NOISE


def test_votes_confirm_most_points_on_edges():
    """On an edge rounding tells which of both faces is nearer, and the other one was chosen for
    some points."""
    faces = body("box").faces
    trees = FaceTrees(faces)
    top, front = (
        next(face for face in faces.faces if face.pieces[0].axes[2] @ axis > 0.99)
        for axis in np.eye(3)[[2, 0]]
    )
    points = np.column_stack(
        [np.full(200, HALF[0]), np.linspace(-9, 9, 200), np.full(200, HALF[2])]
    )
    for _ in range(8):
        points = front.pieces[0].feet(top.pieces[0].feet(points))
    decides, chosen = np.full(200, top.id), trees.values(top.id, points)
    distances = trees.all_distances(points)
    _, confirmed = Cells(trees, REACH).settle(
        points, distances, FAR, decides.copy(), decides, chosen
    )
    assert confirmed.mean() > 0.7


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


def test_a_face_without_votes_beyond_it_keeps_points_on_it():
    """The first face is split in two, and all samples of its middle are taken away, so that nothing
    is known beyond it there. Points on it are within the noise of both parts, on either side."""
    faces = body("box").faces
    top = faces.faces[0]
    normal = top.pieces[0].axes[2]
    half = faces.points[top.samples] @ np.roll(normal, 1) > 0.0
    tilted = replace(top.pieces[0], origin=top.pieces[0].origin - 1e-3 * normal)
    parts = [replace(top, samples=top.samples[half])]
    parts.append(replace(top, samples=top.samples[~half], id=len(faces), pieces=(tilted,)))
    of = faces.of.copy()
    of[parts[1].samples] = len(faces)
    split = replace(faces, faces=(parts[0], *faces.faces[1:], parts[1]), of=of)
    trees = FaceTrees(split)
    points = tilted.feet(np.random.default_rng(0).uniform(-0.9, 0.9, (500, 3)) * HALF)
    points = points + 5e-4 * normal
    decides, chosen = np.full(len(points), len(faces)), trees.values(len(faces), points)
    cells = Cells(trees, REACH)
    outer = cells._key(trees.all_distances(points + normal) > 0.0)
    cells._labels[np.isin(cells._keys, outer)] = 0.0
    # The nearest samples are of another face.
    owner = np.ones(len(points), int)
    cells.settle(points, trees.all_distances(points), FAR, owner, decides, chosen)
    assert np.abs(chosen[:, 0]).max() < 2e-3


def test_votes_alone_decide_within_a_box_and_not_beyond_its_edges():
    faces = body("box").faces
    inside = np.random.default_rng(0).uniform(-HALF, HALF, (2000, 3))
    decides, chosen = decided(faces, inside)
    assert (decides >= 0).all()
    assert np.abs(chosen[:, 0] - box_distance(inside)).max() < 5.0 * NOISE
    corner = HALF + np.random.default_rng(0).uniform(0.5, 2.0, (500, 3))
    assert (decided(faces, corner)[0] == -1).all()


def test_a_free_form_face_is_left_to_its_samples():
    faces = body("box").faces
    bent = replace(faces.faces[0], law=None, kind="free-form")
    split = replace(faces, faces=(bent, *faces.faces[1:]))
    points = np.random.default_rng(0).uniform(-HALF, HALF, (2000, 3))
    before = decided(faces, points)[0]
    assert (before == 0).any()
    after = decided(split, points)[0]
    assert (after[before == 0] == -1).all()
    assert not (after == 0).any()


@pytest.mark.parametrize(("wrong", "known"), [(1, True), (4, False)])
def test_a_cell_with_more_contrary_votes_than_wrong_labels_is_unknown(wrong, known):
    """Samples of a second face beyond the first: as those of a small rounding are, whose cell holds
    the body on one side of the rim and air on the other."""
    faces = body("box").faces
    first, second = faces.faces[:2]
    normal = first.pieces[0].axes[2]
    points = faces.points.copy()
    moved = points[second.samples[:wrong]]
    points[second.samples[:wrong]] = moved - (moved @ normal)[:, None] * normal
    points[second.samples[:wrong]] += (np.abs(HALF @ normal) + 1.0) * normal
    beyond = points[first.samples] + 0.5 * normal
    decides, _ = decided(replace(faces, points=points), beyond)
    assert (decides == first.id).mean() > 0.9 if known else (decides != first.id).all()


def test_where_no_sample_is_clear_of_other_faces_nothing_is_decided():
    faces = body("box").faces
    vague = replace(faces, faces=tuple(replace(f, deviation=1e3) for f in faces.faces))
    points = np.random.default_rng(0).uniform(-HALF, HALF, (200, 3))
    trees = FaceTrees(vague)
    # All are one surface then; each of them alone is none.
    cells = Cells(trees, REACH)
    assert (cells.decide(points, trees.all_distances(points))[0] == -1).all()
    decides, chosen = np.zeros(len(points), int), trees.values(0, points)
    cells.settle(points, trees.all_distances(points), FAR, decides.copy(), decides, chosen)
    assert (decides == 0).all()


def test_two_faces_that_face_each_other_on_one_plane_decide_on_their_own_sides():
    """The lower block's top and the upper block's bottom, with a neck between: the first faces up,
    the second down."""
    faces = body("two blocks").faces
    rng = np.random.default_rng(0)
    left = rng.uniform([-29, -4, 1], [-7, 4, 29], (1000, 3))
    right = rng.uniform([7, -4, 1], [29, 4, 29], (1000, 3))
    for points, sign in ((left, 1.0), (right, -1.0)):
        decides, chosen = decided(faces, points)
        assert (decides >= 0).mean() > 0.8
        near = decides >= 0
        nearest = np.minimum(np.abs(points[:, 1]), distance_of_sides(points))
        off = np.abs(np.abs(chosen[near, 0]) - nearest[near])
        assert np.quantile(off, 0.99) < 5.0 * NOISE
        along = np.abs(chosen[:, 2]) > 0.9
        mine = near & along & (np.abs(points[:, 1]) < 2.0)
        assert (chosen[mine, 2] * sign > 0.9).all()


def distance_of_sides(points) -> np.ndarray:
    """(n,) the least distance of points between -30 and 30 from the other planes near y = 0."""
    x, _, z = points.T
    walls = np.minimum(np.abs(np.abs(x) - 5.0), 30.0 - np.abs(x))
    return np.minimum(walls, np.minimum(z, 30.0 - z))
