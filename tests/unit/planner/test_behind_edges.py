"""Behind edges and bends: what lies behind the ends of contours is found from outside."""

import numpy as np
import pytest

from tests.explored import explore_body
from tests.sharp import sharp_object
from tests.truths import UP
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import PlannerOptions, ProbePlan, Reason, StopReason
from touchatlas.planner import behind_edges as module
from touchatlas.planner.attempts import Attempts, Target
from touchatlas.planner.behind_edges import (
    EdgeEnds,
    behind_edge,
    bend_near,
    sharp_bends,
    unknown_ends,
)
from touchatlas.planner.places import places_of
from touchatlas.planner.view import View

STEP, REACH = 1.0 / 7.0, 3.0
ANGLES = np.pi / 4.0 * np.array([-1.0, 0.0, 1.0])
AHEAD = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(3)])


def at_edge() -> Atlas:
    """The plane z = 0 with three contours from x = -1 on, at 0 and +-45 degrees from the x axis,
    each of which stops at an edge ahead."""
    ends, contours = (ContourEnd.LENGTH_REACHED, ContourEnd.EDGE), []
    for along in AHEAD:
        points = STEP * np.arange(-7, 8)[:, None] * along
        plane = SamplingPlane(np.zeros(3), np.cross(along, UP))
        contours.append(Contour(points, plane, 1e-6, ends))
    atlas = Atlas(0.05)
    atlas.add(Touch(0, np.zeros(3), UP, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0))
    return atlas


def one_end() -> EdgeEnds:
    """The end of a contour along x at (1, 0, 0), on a face that faces up."""
    return EdgeEnds(np.eye(3)[:1], np.eye(3)[:1], UP[None], np.array([STEP]))


def test_an_end_is_the_last_sample_its_direction_and_its_step():
    """To the noise of a millionth, over three steps."""
    ends = unknown_ends(at_edge())
    assert ends.points == pytest.approx(AHEAD, abs=1e-5)
    assert ends.tangents == pytest.approx(AHEAD, abs=1e-4)
    assert ends.normals == pytest.approx(np.tile(UP, (3, 1)), abs=1e-4)
    assert ends.steps == pytest.approx(np.full(3, STEP), abs=1e-5)


def test_an_atlas_without_a_touch_has_no_ends():
    assert not len(unknown_ends(Atlas(0.1)).points)


def guesses(monkeypatch, ends: EdgeEnds, position, count: int):
    """So many guesses in turn behind ends, from a probe at a position, and the end of each."""
    atlas = at_edge()
    atlas.touches = 0
    attempts, found = Attempts(np.zeros(3), UP, touched=[position]), []
    monkeypatch.setattr(module, "unknown_ends", lambda atlas: ends)
    options = PlannerOptions(reach=REACH / atlas.pool.extent)
    for _ in range(count):
        found.append(behind_edge(View(atlas, options, attempts), places_of(Atlas(0.1))))
        attempts.ends += [] if found[-1] is None else [found[-1].end]
    return found


def test_guesses_are_below_a_convex_edge_then_above_a_concave_one_far_and_near(monkeypatch):
    """By 0.3 and 0.08 reaches from the edge, which is half a step ahead of the end; behind a convex
    edge the place is as far beyond it again."""
    found = guesses(monkeypatch, one_end(), np.zeros(3), 5)
    assert found[4] is None
    edge = 1.0 + 0.5 * STEP
    expected = [
        ([edge + 0.5 * STEP, 0.0, -0.3 * REACH], 1.0),
        ([edge, 0.0, 0.3 * REACH], -1.0),
        ([edge + 0.5 * STEP, 0.0, -0.08 * REACH], 1.0),
        ([edge, 0.0, 0.08 * REACH], -1.0),
    ]
    for target, (point, side) in zip(found, expected, strict=False):
        assert target.point == pytest.approx(np.array(point), abs=1e-12)
        assert target.normal == pytest.approx(side * np.eye(3)[0])
        assert target.reason is Reason.EXPAND


def test_ends_with_fewest_guesses_and_nearest_to_the_probe_come_first(monkeypatch):
    points = np.array([[1.0, 0, 0], [5.0, 0, 0], [9.0, 0, 0]])
    ends = EdgeEnds(points, np.tile(np.eye(3)[0], (3, 1)), np.tile(UP, (3, 1)), np.full(3, STEP))
    found = guesses(monkeypatch, ends, np.array([9.0, 1, 0]), 4)
    assert [target.end.tolist() for target in found] == points[[2, 1, 0, 2]].tolist()


def test_a_probe_that_stops_at_edges_finds_all_faces_of_a_cube():
    """Contours turn by 46 degrees at most, less than a right angle. Behind all their ends is a face
    that is known. Of 17 samples on each arm instead of 43 the same follows in a third of the
    time."""
    options = PlannerOptions(max_turn=0.8, step=0.035)
    found = explore_body(sharp_object("block"), 100, options=options)
    assert found.stop.reason is StopReason.KNOWN
    known = found.atlas.known_body
    assert not known.is_one_face and [face.kind for face in known.body.faces.faces] == 6 * ["plane"]
    normals = np.array([face.law.numbers["normal"] for face in known.body.faces.faces])
    sides = {(int(np.abs(n).argmax()), bool(n[np.abs(n).argmax()] > 0.0)) for n in normals}
    assert len(sides) == 6
    assert found.atlas.pool.edges.sum() > len(found.touches)
    assert not len(unknown_ends(found.atlas).points)


FORWARD, SIDE, STEP_LENGTH = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 0.1
FLAT = STEP_LENGTH * np.arange(-8, 9)[:, None] * FORWARD


def bends(points, end=ContourEnd.TURNED_AWAY, approach=UP) -> list[np.ndarray]:
    """The bends at the end of a contour through the origin, in the plane y = 0."""
    plane = SamplingPlane(np.zeros(3), SIDE)
    contour = Contour(points, plane, 1e-3, (ContourEnd.LENGTH_REACHED, end))
    touch = Touch(0, np.zeros(3), approach, (contour,), TouchStatus.TOUCHED, 1.0, 0.0)
    turn = 2.0 * np.pi / 3.0
    plan = ProbePlan(0, np.zeros(3), UP, (plane,), 1.0, STEP_LENGTH, turn, Reason.EXPAND)
    return sharp_bends(touch, plan)


@pytest.mark.parametrize("outward", [UP, -UP])
def test_a_flat_arm_that_turned_away_ends_before_a_bend(outward):
    """An eighth of a step inside the last sample, on either side of a plate."""
    ((point, ahead),) = bends(FLAT, approach=outward)
    assert ahead == pytest.approx(FORWARD)
    assert point == pytest.approx(FLAT[-1] - STEP_LENGTH / 8.0 * outward)


@pytest.mark.parametrize("steps", [1.5, 2.0, 3.0, 4.0, 6.0])
def test_an_arm_that_turned_gradually_ends_before_no_bend(steps):
    """On a circle of some steps an arm turns by 110 degrees, with a sample each 15 or less."""
    angles = np.linspace(-0.5, np.deg2rad(110.0), int(2.5 * max(steps, 4.0)))
    angles -= angles[np.abs(angles).argmin()]
    circle = np.column_stack([np.sin(angles), 0.0 * angles, np.cos(angles) - 1.0])
    assert not bends(steps * STEP_LENGTH * circle)


def test_an_arm_that_ended_for_another_reason_shows_no_bend():
    for end in ContourEnd:
        assert len(bends(FLAT, end)) == (end is ContourEnd.TURNED_AWAY)


def near_bends(count: int, wall=None, tried=()) -> Target:
    """The target for a rim at (1, 0, 0) next to so many bends ahead of it along x; a ``wall`` of
    samples at x = 1.1 has that normal."""
    atlas = at_edge()
    if wall is not None:
        atlas.pool.add(np.array([[1.1, 0, 0]]), wall[None], SIDE[None], False, 1e-3)
    attempts = Attempts(np.zeros(3), UP, tried=list(tried))
    attempts.bends = [np.array([[1.0 + 0.02 * k, 0, 0], FORWARD]) for k in range(count)]
    target = Target(np.array([1.0, 0.0, 0.0]), UP, Reason.EXPAND)
    return bend_near(target, View(atlas, PlannerOptions(), attempts))


def test_a_rim_at_three_sharp_bends_is_touched_from_outside():
    """At the nearest of them, against the way of its arm; at two it is touched from above."""
    assert near_bends(3).normal == pytest.approx(FORWARD)
    assert near_bends(3).point == pytest.approx(FORWARD)
    assert near_bends(2).normal == pytest.approx(UP)


def test_a_rim_is_touched_from_above_where_all_bends_were_tried_or_a_wall_stands_ahead():
    """As at the bottom of a groove. The far side of a rim faces away from the arm."""
    assert near_bends(3, tried=[FORWARD]).normal == pytest.approx(UP)
    assert near_bends(3, wall=-FORWARD).normal == pytest.approx(UP)
    assert near_bends(3, wall=FORWARD).normal == pytest.approx(FORWARD)
