"""Behind edges: what lies behind the ends of contours that stop there is guessed, and found."""

import numpy as np
import pytest

from tests.flat import UP
from tests.sharp import explored_faces
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import PlannerOptions, Reason, StopReason
from touchatlas.planner import behind_edges as module
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.behind_edges import EdgeEnds, behind_edge, unknown_ends
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
    that is known."""
    found = explored_faces("block", 0.8)
    assert found.stop.reason is StopReason.KNOWN
    known = found.atlas.known_body
    assert not known.is_one and [face.kind for face in known.body.faces.faces] == 6 * ["plane"]
    normals = np.array([face.law.numbers["normal"] for face in known.body.faces.faces])
    sides = {(int(np.abs(n).argmax()), bool(n[np.abs(n).argmax()] > 0.0)) for n in normals}
    assert len(sides) == 6
    assert found.atlas.pool.edges.sum() > len(found.touches)
    assert not len(unknown_ends(found.atlas).points)
