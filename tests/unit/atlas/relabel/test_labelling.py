"""Samples are labelled by the laws that they obey, whatever the unit and the frame."""

from collections import Counter
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import known_body
from tests.lawful_meshes import BEND, ROD
from tests.touched import BORNE, touched, touched_samples
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.join_faces import join_faces
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.labelling import label_samples, relabel

# Touches at which every plane of a body has samples of several contours.
TOUCHES = {"block": 40, "step": 40, "roof": 40, "wall": 50}


@lru_cache
def labelled(name: str, count: int):
    return label_samples(touched_samples(name, count))


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


@pytest.mark.parametrize("name", ["block", "step", pytest.param("wall", marks=pytest.mark.slow)])
def test_labels_touch_by_touch_are_as_short_a_description_as_those_from_scratch(name):
    """Both are local minima. A sample that changes over between two planes costs some nats."""
    count = TOUCHES[name]
    found = relabelled(name, range(10, count + 1, 5))
    assert len(found.pieces) == len(labelled(name, count).pieces)
    assert found.total() < 1.02 * labelled(name, count).total()


def test_touches_elsewhere_leave_labels_and_pieces_as_they_are():
    """Two balls far from each other: what is learned of one changes nothing of the other."""
    points, outward, planes, noise = touched("sphere", 12)
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


def test_a_bent_rod_is_two_planes_two_cylinders_and_a_torus():
    """With its radii; rims are smooth where the bend begins, and the ends are edges."""
    body = known_body("bend", 24)
    laws = [face.law for face in body.faces.faces]
    assert sorted(law.kind for law in laws) == ["cylinder", "cylinder", "plane", "plane", "torus"]
    [bend] = [law.numbers for law in laws if law.kind == "torus"]
    for name, true in (("radius", BEND), ("tube_radius", ROD)):
        assert abs(bend[name] - true) < 5.0 * bend[f"{name}_std"] < 0.2
    kinds = [edge.kind for edge in body.faces.edges]
    assert Counter(kinds) == {EdgeKind.SMOOTH_RIM: 2, EdgeKind.SHARP_CONVEX: 2}


@pytest.mark.parametrize(
    ("name", "narrows"), [pytest.param("frustum", 10.0, marks=pytest.mark.slow), ("draft", 2.0)]
)
def test_a_frustum_is_two_planes_and_a_cone(name, narrows):
    """With its angle, that of a draft of casting as well; its ends are edges."""
    body = known_body(name, 15)
    laws = [face.law for face in body.faces.faces]
    assert sorted(law.kind for law in laws) == ["cone", "plane", "plane"]
    [cone] = [law.numbers for law in laws if law.kind == "cone"]
    off = abs(cone["half_angle"] - np.arctan(narrows / 40.0))
    assert off < 5.0 * cone["half_angle_std"] < 2e-3
    kinds = [edge.kind for edge in body.faces.edges]
    assert kinds == [EdgeKind.SHARP_CONVEX, EdgeKind.SHARP_CONVEX]


def test_samples_that_nothing_explains_keep_no_label():
    """Three contours of noise beside a ball: no law holds them, and none is dropped."""
    points, outward, planes, noise = touched("sphere", 12)
    rng = np.random.default_rng(0)
    away = np.array([80.0, 0.0, 0.0]) + 5.0 * rng.normal(size=(45, 3))
    points = np.concatenate([points, away])
    outward = np.concatenate([outward, np.tile([1.0, 0.0, 0.0], (45, 1))])
    planes = np.concatenate([planes, np.repeat(np.eye(3), 15, axis=0)])
    labels = label_samples(contour_samples(points, outward, planes, BORNE * noise))
    assert (labels.of[-45:] == NONE).all()
    assert (labels.of[:-45] == 0).mean() > 0.999
