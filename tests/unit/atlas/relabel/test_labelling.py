"""Samples are labelled by the laws that they obey, whatever the unit and the frame."""

from functools import lru_cache

import numpy as np
import pytest

from tests.sharp import sharp_object
from tests.touched import BORNE, touched, touched_samples
from tests.truths import random_rotation
from touchatlas.atlas.faces.join_faces import join_faces
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.labelling import label_samples, relabel

# Touches at which every plane of a body has samples of several contours.
TOUCHES = {"block": 40, "step": 40, "roof": 40, "wall": 50}


@lru_cache
def labelled(name: str, count: int):
    return label_samples(touched_samples(name, count))


def rows_of_planes(name: str, count: int) -> np.ndarray:
    """(n,) number of the true plane of each sample."""
    obj = sharp_object(name)
    points = obj.project(touched(name, count)[0])
    normals = obj.normal(points)
    keys = np.column_stack([normals, (points * normals).sum(axis=1)]).round(2)
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


@pytest.mark.parametrize(("name", "planes"), [("block", 6), ("step", 8), ("roof", 7), ("wall", 6)])
def test_every_plane_of_a_polyhedron_is_one_piece(name, planes):
    """At an edge a sample is within its noise of both planes: some per mille are on the other."""
    count = TOUCHES[name]
    labels, truth = labelled(name, count), rows_of_planes(name, count)
    assert [piece.kind for piece in labels.pieces] == planes * [Kind.PLANE]
    right = sum(np.bincount(truth[labels.of == k]).max() for k in range(planes))
    assert right > 0.99 * len(truth)


def test_a_ball_is_one_sphere():
    labels = labelled("sphere", 30)
    assert [piece.kind for piece in labels.pieces] == [Kind.SPHERE]
    assert (labels.of == 0).mean() > 0.999


def relabelled(name: str, bounds):
    """Labels of a body after samples up to each of some touches, each from those before."""
    points, outward, planes, noise = touched(name, TOUCHES[name])
    touches = touched_samples(name, TOUCHES[name]).touches
    labels = None
    for bound in bounds:
        keep = touches < bound
        samples = contour_samples(points[keep], outward[keep], planes[keep], BORNE * noise)
        if labels is None:
            labels = label_samples(samples)
        else:
            labels = relabel(samples, join_faces(labels, []))
    return labels


@pytest.mark.parametrize("name", ["block", "step", "wall"])
def test_labels_touch_by_touch_are_as_short_a_description_as_those_from_scratch(name):
    """Both are local minima. A sample that changes over between two planes costs some nats."""
    count = TOUCHES[name]
    found = relabelled(name, range(10, count + 1, 5))
    assert len(found.pieces) == len(labelled(name, count).pieces)
    assert found.total() < 1.02 * labelled(name, count).total()


def test_touches_elsewhere_leave_labels_and_pieces_as_they_are():
    """Two balls far from each other: what is learned of one changes nothing of the other."""
    points, outward, planes, noise = touched("sphere", 30)
    far = np.array([400.0, 0.0, 0.0])
    first = contour_samples(points, outward, planes, BORNE * noise)
    before = label_samples(first)
    both = contour_samples(
        np.concatenate([points, points + far]),
        *(np.tile(c, (2, 1)) for c in (outward, planes)),
        BORNE * noise,
    )
    after = relabel(both, join_faces(before, []))
    assert after.pieces[0] is before.pieces[0]
    assert (after.of[: len(points)] == before.of).all()
    assert [piece.kind for piece in after.pieces] == [Kind.SPHERE, Kind.SPHERE]
    assert (after.of[len(points) :] == 1).mean() > 0.999


def test_labels_move_with_the_body():
    """Samples that are within their noise of two planes may change over."""
    rng = np.random.default_rng(0)
    turn, shift = random_rotation(rng), 100.0 * rng.normal(size=3)
    points, outward, planes, noise = touched("step", 40)
    samples = contour_samples(
        points @ turn.T + shift, outward @ turn.T, planes @ turn.T, BORNE * noise
    )
    moved, still = label_samples(samples), labelled("step", 40)
    assert len(moved.pieces) == len(still.pieces)
    table = np.zeros((8, 8))
    both = (moved.of != NONE) & (still.of != NONE)
    np.add.at(table, (moved.of[both], still.of[both]), 1)
    assert table.max(axis=1).sum() > 0.998 * len(points)


def test_samples_that_nothing_explains_keep_no_label():
    """Three contours of noise beside a ball: no law holds them, and none is dropped."""
    points, outward, planes, noise = touched("sphere", 30)
    rng = np.random.default_rng(0)
    astray = np.array([80.0, 0.0, 0.0]) + 5.0 * rng.normal(size=(45, 3))
    points = np.concatenate([points, astray])
    outward = np.concatenate([outward, np.tile([1.0, 0.0, 0.0], (45, 1))])
    planes = np.concatenate([planes, np.repeat(np.eye(3), 15, axis=0)])
    labels = label_samples(contour_samples(points, outward, planes, BORNE * noise))
    assert (labels.of[-45:] == NONE).all()
    assert (labels.of[:-45] == 0).mean() > 0.999


def test_options_refuse_what_is_no_price():
    with pytest.raises(ValueError, match="unexplained is -1"):
        FaceOptions(unexplained=-1)
    with pytest.raises(ValueError, match="rounds is 0"):
        FaceOptions(rounds=0)
