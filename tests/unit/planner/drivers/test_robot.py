"""A whole exploration by a grbl on a socket: planner, points, ways, atlas."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.planner.drivers.fake_grbl import FakeGrbl
from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.patch import SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason
from touchatlas.planner.drivers.grbl import Grbl
from touchatlas.planner.drivers.guarded import GuardedTrigger, GuardOptions
from touchatlas.planner.drivers.replay import touches_of
from touchatlas.planner.drivers.robot import robot_of
from touchatlas.planner.tracking.options import Tip, TriggerOptions

# A ball of 20 mm about 0 in work coordinates, which are 60 mm below the middle of the machine.
BALL, TIP, OFFSET = 20.0, Tip(radius=1.0, noise_std=1e-3, force_std=0.0), (-150.0, -150.0, -90.0)


@pytest.fixture
def machine():
    def gap(place):
        return float(np.linalg.norm(place - OFFSET)) - BALL - TIP.radius

    firmware = FakeGrbl(gap, start=(-150.0, -150.0, -20.0), offset=OFFSET)
    grbl = Grbl.connect(f"tcp://127.0.0.1:{firmware.port}", patience=1.0)
    yield firmware, GuardedTrigger(grbl, GuardOptions(feed=5.0))
    grbl.close()


def test_a_ball_is_explored_by_a_machine_that_triggers(machine):
    """Centres are on the ball of 21 mm within the rounding of reports, 0.5 um a coordinate; nothing
    is driven into, and nothing but probing moves is sent."""
    firmware, trigger = machine
    robot = robot_of(trigger, TIP, TriggerOptions(points=3))
    atlas = Atlas(tolerance=0.1, scale=0.1)
    planner = Planner(start=[0.0, 0.0, BALL], outward=[0.0, 0.0, 1.0])
    for _ in range(3):
        plan = planner.ask(atlas)
        touch = robot(plan)
        assert touch.status is TouchStatus.TOUCHED
        for contour in touch.contours:
            off = np.linalg.norm(contour.points, axis=1) - BALL - TIP.radius
            assert np.abs(off).max() < 2e-3
        planner.tell(touch, atlas.add(touch))
    assert firmware.crashes == 0
    moves = [line for line in firmware.lines if "G38" in line]
    assert len(moves) > 50 and all(line.startswith("G21G90G94G38.") for line in moves)


def test_a_place_beyond_the_limits_is_unreachable_and_nothing_moves(machine):
    """The table is 110 mm below the work's zero."""
    firmware, trigger = machine
    low = np.array([60.0, 0.0, -111.0])
    plane = SamplingPlane(low, np.array([1.0, 0.0, 0.0]))
    plan = ProbePlan(0, low, np.array([0, 0, 1.0]), (plane,), 8.0, 1.0, np.pi, Reason.START)
    touch = robot_of(trigger, TIP)(plan)
    assert touch.status is TouchStatus.UNREACHABLE and touch.way is None
    assert not any("G38" in line for line in firmware.lines)


def test_an_approach_that_met_nothing_before_the_limits_is_unreachable(machine):
    """2 mm above the table, and looking for the surface up to 4 mm below: it may be there."""
    low = np.array([60.0, 0.0, -108.0])
    plane = SamplingPlane(low, np.array([1.0, 0.0, 0.0]))
    plan = ProbePlan(0, low, np.array([0, 0, 1.0]), (plane,), 8.0, 1.0, np.pi, Reason.START)
    firmware, trigger = machine
    touch = robot_of(trigger, TIP)(plan)
    assert touch.status is TouchStatus.UNREACHABLE and touch.way is None
    higher = replace(plan, reference_point=low + [0, 0, 10.0])
    touch = robot_of(trigger, TIP)(higher)
    assert touch.status is TouchStatus.NO_CONTACT and touch.way is not None


def test_an_approach_begins_no_higher_than_the_limits(machine):
    """100 mm above the ball are 10 mm more than the machine has."""
    top = np.array([0.0, 0.0, BALL + TIP.radius])
    plane = SamplingPlane(top, np.array([0.0, 1.0, 0.0]))
    plan = ProbePlan(0, top, np.array([0, 0, 1.0]), (plane,), 4.0, 1.0, np.pi, Reason.START)
    touch = robot_of(machine[1], TIP)(replace(plan, approach=100.0))
    assert touch.status is TouchStatus.TOUCHED
    assert touch.way[0, 2] == pytest.approx(90.0, abs=2e-3)


def test_an_arm_ends_at_the_limits(machine):
    """The limit in x is 20 mm beside the ball's middle: arms of 30 mm along x end there."""
    firmware, _ = machine
    grbl = machine[1]._controller
    narrow = GuardedTrigger(grbl, GuardOptions(feed=5.0), [[-20, -90, -60], [10, 90, 89]])
    top = np.array([0.0, 0.0, BALL])
    plane = SamplingPlane(top, np.array([0.0, 1.0, 0.0]))
    plan = ProbePlan(0, top, np.array([0, 0, 1.0]), (plane,), 18.0, 1.0, np.pi, Reason.START)
    touch = robot_of(narrow, TIP, TriggerOptions(points=4))(plan)
    assert touch.status is TouchStatus.TOUCHED
    x = touch.contours[0].points[:, 0]
    assert x.max() < 10.0 and x.min() < -10.0
    assert firmware.crashes == 0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: GuardedTrigger(None), "controller is NoneType; give a Controller"),
        (lambda: robot_of(None), "trigger is of type NoneType; give a GuardedTrigger"),
        (lambda: touches_of("bag", TIP), "recording is of type str; give a Recording"),
    ],
)
def test_what_is_no_machine_and_no_recording_is_named(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_a_tip_that_is_none_is_named(machine):
    with pytest.raises(ValueError, match="tip is of type float; give a Tip"):
        robot_of(machine[1], 1.0)
