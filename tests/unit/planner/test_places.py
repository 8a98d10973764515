"""Places of lawful faces: where the surface ends is touched first, then where it is unsure."""

from dataclasses import replace

import numpy as np
import pytest

from tests.lawful import HALF, body_of, samples_of_touches, touched_mesh
from touchatlas.atlas import Atlas
from touchatlas.planner import Reason
from touchatlas.planner.place.choose import View
from touchatlas.planner.place.deviation_ratio import DeviationRatio
from touchatlas.planner.place.lawful_places import lawful_places, lawful_target
from touchatlas.planner.place.places import Places

NOISE, TOLERANCE = 0.02, 0.1
# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE
NOWHERE = np.zeros((0, 3))
# Area of the box, and of its part below x = 5 without the cut.
AREA = 8.0 * (HALF[0] * HALF[1] + HALF[1] * HALF[2] + HALF[2] * HALF[0])
CUT = 5.0
PART = 4.0 * HALF[1] * HALF[2] + 4.0 * (CUT + HALF[0]) * (HALF[1] + HALF[2])


def box(keep=None):
    columns = touched_mesh("box", 60, NOISE, 4)
    return body_of(samples_of_touches(columns, STD, None if keep is None else keep(columns[0])))


@pytest.fixture(scope="module")
def whole():
    return lawful_places(box())


@pytest.fixture(scope="module")
def half_body():
    return box(lambda points: points[:, 0] < CUT)


@pytest.fixture(scope="module")
def half(half_body):
    return lawful_places(half_body)


def view_of(touched, tolerance: float = TOLERANCE) -> View:
    touched = np.reshape(touched, (-1, 3))
    extent = 2.0 * float(np.linalg.norm(HALF))
    return View(Atlas(tolerance), Places(), touched, touched, NOWHERE, NOWHERE, extent)


def test_the_areas_of_a_closed_body_are_that_of_the_body(whole):
    """Planes are exact but for three deviations, and triangles cut no edge: 1e-3 of the area."""
    assert len(whole.rim) == 0
    inside, total, unscaled = whole.areas(TOLERANCE, DeviationRatio(), np.zeros(0, bool))
    assert total == pytest.approx(AREA, rel=1e-3)
    # The tolerance is more than twenty deviations.
    assert inside == pytest.approx(total, rel=1e-9) and unscaled == pytest.approx(total, rel=1e-9)
    assert not len(whole.left(TOLERANCE))
    assert np.linalg.norm(whole.normals, axis=1) == pytest.approx(1.0, abs=1e-12)


def test_what_is_open_counts_as_a_strip_beside_the_rim(half, half_body):
    """The rim is a rectangle about the body, 140 long, and its strip half a reach wide; zigzag of
    the cubes makes it longer, by less than the square root of two. The part that is known is as
    large as that below x = 5, to a step and a half and a cube beyond, or a cube before."""
    some = np.ones(len(half.rim), bool)
    ratio = DeviationRatio()
    inside, total, _ = half.areas(TOLERANCE, ratio, some)
    around, edge = 4.0 * (HALF[1] + HALF[2]), half_body.extent / 32
    assert PART - 2.0 * edge * around < inside < PART + (1.5 + edge) * around
    strip = 0.5 * half_body.reach * around
    assert 0.99 * strip < total - inside < np.sqrt(2.0) * strip
    # Rims that were tried do not count.
    _, known, _ = half.areas(TOLERANCE, ratio, ~some)
    assert known == pytest.approx(inside, rel=1e-9)
    assert known == pytest.approx(half.area.sum(), rel=1e-12)


def test_areas_follow_the_predicted_deviation(whole):
    """One deviation is 68.27 % of a normal error."""
    unsure = replace(whole, deviation=np.full(len(whole.area), TOLERANCE))
    _, total, unscaled = unsure.areas(TOLERANCE, DeviationRatio(), np.zeros(0, bool))
    assert unscaled / total == pytest.approx(0.6827, abs=1e-4)
    assert len(unsure.left(TOLERANCE)) == len(whole.points)


def test_the_open_rim_of_a_half_touched_box_is_the_target(half, half_body):
    """Far from the touch, outward, and at the end of the samples."""
    touched = [-HALF[0], 0.0, 0.0]
    target = lawful_target(view_of(touched), half)
    assert target.reason is Reason.EXPAND
    edge = half_body.extent / 32
    assert CUT - 2.0 * edge < target.point[0] < CUT + 1.5 + edge
    axis = (np.abs(target.point) - HALF).argmax()
    assert axis > 0
    assert np.sign(target.point[axis]) * target.normal[axis] > 0.7
    # Touched there, the next one is elsewhere.
    again = lawful_target(view_of([touched, target.point]), half)
    assert np.linalg.norm(again.point - target.point) > 0.5 * HALF[2]


def test_there_is_no_target_where_all_rims_are_near_touches(half):
    """All places are known to the tolerance, too."""
    assert lawful_target(view_of(half.rim), half) is None


def test_a_closed_body_that_is_sure_has_no_target(whole):
    assert lawful_target(view_of([HALF[0], 0.0, 0.0]), whole) is None


def test_the_least_sure_place_is_the_target_where_nothing_is_open(whole):
    """Above a half of the tolerance, 1.96 deviations are more than it; below, they are not."""
    deviation = np.full(len(whole.points), 0.4 * TOLERANCE)
    worst = int(whole.points[:, 0].argmax())
    view = view_of([-HALF[0], 0.0, 0.0])
    for factor, wanted in ((0.5, False), (0.52, True)):
        deviation[worst] = factor * TOLERANCE
        target = lawful_target(view, replace(whole, deviation=deviation.copy()))
        assert (target is not None) is wanted
    assert target.reason is Reason.REFINE
    assert np.array_equal(target.point, whole.points[worst])
    assert np.array_equal(target.normal, whole.normals[worst])
    # Near a touch it is none.
    near = view_of([whole.points[worst]])
    assert lawful_target(near, replace(whole, deviation=deviation)) is None
