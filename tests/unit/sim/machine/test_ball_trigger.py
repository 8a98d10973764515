"""The simulated trigger probe, and plans of single points."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import UP
from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.planner import ProbePlan, Reason, Tip, TriggerOptions
from touchatlas.planner.plans import concurrent_planes
from touchatlas.planner.tracking.going import arrives
from touchatlas.planner.tracking.touch_points import touch_points
from touchatlas.sim import make_object
from touchatlas.sim.machine.ball_trigger import BallTrigger
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import Switch

FEET, CUBE = Feet(make_object("sphere")), Feet(make_object("cube"))
EXACT = Switch(travel=0.0, lobes=0.0, noise_std=0.0, period=0.0, step=0.0)


def machine(feet=FEET, switch=EXACT, seed=0) -> BallTrigger:
    found = BallTrigger(feet, switch, np.random.default_rng(seed))
    found.place([0.0, 0.0, 100.0])
    return found


def plan_on(point, normal, heading, reach=15.0, **others) -> ProbePlan:
    planes = concurrent_planes(point, normal, heading, 3)
    return ProbePlan(0, point, normal, planes, reach, 2.5, 2.0, Reason.REFINE, **others)


def test_a_ball_stops_where_its_surface_meets_the_body():
    """From (5, 0, 100) down: its centre is on the sphere of radius 33 + 2."""
    trigger = machine()
    assert trigger.move(np.array([[5.0, 0.0, 100.0]]))
    centre = trigger.probe([5.0, 0.0, 0.0])
    assert np.allclose(centre, [5.0, 0.0, np.sqrt(35.0**2 - 25.0)], atol=1e-4)
    assert trigger.move(np.array([[5.0, 0.0, 60.0]]))
    assert trigger.probe([5.0, 50.0, 60.0]) is None


def test_a_way_into_the_body_stops_at_it():
    trigger = machine()
    assert not trigger.move(np.array([[0.0, 0.0, 0.0]])) and trigger.collisions == 1
    assert trigger.position()[2] == pytest.approx(35.0, abs=1e-3)


def test_a_way_that_is_blocked_is_gone_back():
    """Around the ball to its side, then into it: back over the corner, and not straight through."""
    trigger, start = machine(), np.array([0.0, 0.0, 100.0])
    way = np.array([[60.0, 0.0, 60.0], [60.0, 0.0, -20.0], [0.0, 0.0, -10.0]])
    assert not arrives(trigger, start, way)
    assert np.allclose(trigger.position(), start) and trigger.collisions == 1
    assert arrives(trigger, start, way[:2]) and np.allclose(trigger.position(), way[1])


def test_a_switch_opens_late_by_what_its_direction_says():
    """At an angle of 90 degrees about the stylus its three lobes are zero, at 0 degrees whole; a
    position is late by half a period in the mean: 500 numbers, evenly spread over 0.1, have a
    standard error of 0.1 / sqrt(12 * 500) = 1.3e-3."""
    found = []
    for x, y in ((1.0, 0.0), (0.0, 1.0)):
        lobed = Switch(travel=0.01, lobes=0.004, noise_std=0.0, period=0.0, step=0.0)
        trigger = machine(switch=lobed)
        trigger.place([50.0 * x, 50.0 * y, 0.0])
        found.append(35.0 - np.linalg.norm(trigger.probe(np.zeros(3))))
    assert found[0] == pytest.approx(0.006, abs=1e-4)
    assert found[1] == pytest.approx(0.010, abs=1e-4)
    late = Switch(travel=0.0, lobes=0.0, noise_std=0.0, period=0.02, step=0.0, feed=5.0)
    trigger, heights = machine(switch=late), []
    for _ in range(500):
        trigger.place([0.0, 0.0, 36.0])
        heights.append(35.0 - trigger.probe(np.zeros(3))[2])
    assert np.mean(heights) == pytest.approx(0.05, abs=4 * 1.3e-3)
    assert min(heights) >= 0.0 and max(heights) <= 0.1001


def test_single_points_are_centres_on_the_offset_surface():
    rng = np.random.default_rng(1)
    (point,), (normal,) = make_object("sphere").sample(1, rng)
    trigger = machine()
    trigger.place(3.0 * point)
    plan = plan_on(point, normal, rng.normal(size=3))
    touch = touch_points(trigger, plan, Tip(), TriggerOptions(points=3))
    assert touch.status is TouchStatus.TOUCHED and touch.tip_radius == 2.0
    assert [len(contour.points) for contour in touch.contours] == [7, 7, 7]
    for contour, plane in zip(touch.contours, plan.planes, strict=True):
        assert np.allclose(np.linalg.norm(contour.points, axis=1), 35.0, atol=1e-3)
        assert np.abs((contour.points - point) @ plane.normal).max() < 1e-6
    assert trigger.collisions == 0
    # Points 5 apart: on a circle about the ball chords are a little longer, by 1 + (5/35)^2 / 2.
    gaps = np.linalg.norm(np.diff(touch.contours[0].points, axis=0), axis=1)
    assert np.allclose(gaps, 5.0, rtol=0.1)


def test_points_go_around_an_edge():
    trigger = machine(CUBE)
    plan = plan_on(np.array([24.0, 0.0, 30.0]), UP, np.array([1.0, 0.0, 0.0]), 24.0)
    touch = touch_points(trigger, plan, Tip(), TriggerOptions(points=4))
    points = np.concatenate([contour.points for contour in touch.contours])
    inside = np.clip(points, -30.0, 30.0)
    assert np.allclose(np.linalg.norm(points - inside, axis=1), 2.0, atol=1e-3)
    assert (points[:, 2] < 28.0).any() and (points[:, 2] > 31.9).any()
    # A move that meets the body is no crash: a trigger stops.
    assert trigger.collisions <= 2


@pytest.mark.parametrize("x", [17.0, 20.0, 23.0, 26.0, 29.5])
def test_an_edge_is_gone_around_wherever_it_is_within_a_step(x):
    """The circle of radius 10 about a point on the top meets the top, or the side below the edge.
    Chords of pi / 8 are inside of it by 10 (1 - cos(pi / 16)) = 0.19."""
    trigger = machine(CUBE)
    plan = plan_on(np.array([x, 0.0, 30.0]), UP, np.array([1.0, 0.0, 0.0]), 20.0)
    touch = touch_points(trigger, plan, Tip(), TriggerOptions(points=2))
    points = touch.contours[0].points
    assert len(points) == 5
    off = points - np.clip(points, -30.0, 30.0)
    assert np.allclose(np.linalg.norm(off, axis=1), 2.0, atol=1e-3)
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert ((gaps > 9.8) & (gaps < 10.001)).all()


def test_a_circle_has_chords_enough():
    with pytest.raises(ValueError, match="turn is 1.0; it must be a quarter of pi or less"):
        TriggerOptions(turn=1.0)


def test_arms_that_meet_around_a_body_end():
    """The circle of centres is 220 long, and the arms together 300."""
    plan = replace(plan_on(33.0 * UP, UP, np.array([1.0, 0.0, 0.0]), 150.0), max_turn=np.pi)
    plan = replace(plan, planes=plan.planes[:1])
    [contour] = touch_points(machine(), plan, Tip(), TriggerOptions(points=6)).contours
    apart = np.linalg.norm(contour.points[:, None] - contour.points, axis=2)
    assert apart[~np.eye(len(apart), dtype=bool)].min() > 12.5 and 6 < len(apart) < 11


def test_a_few_points_all_around_a_body_are_kept_in_an_order():
    plan = replace(plan_on(33.0 * UP, UP, np.array([1.0, 0.0, 0.0]), 120.0), max_turn=np.pi)
    touch = touch_points(machine(), plan, Tip(), TriggerOptions(points=2))
    assert touch.status is TouchStatus.TOUCHED and len(touch.contours) == 3


def test_where_nothing_is_met_a_trigger_says_so():
    trigger = machine()
    beside = np.array([50.0, 0.0, 0.0])
    touch = touch_points(trigger, plan_on(beside, UP, np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.NO_CONTACT
    assert np.allclose(touch.way[:, :2], [50.0, 0.0])
    touch = touch_points(machine(), plan_on(np.zeros(3), UP, np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.UNREACHABLE


def test_known_surface_ends_an_arm_of_points_when_one_contour_is_long_enough():
    """That is one of five points, which show on which side of them the body is."""
    plan = plan_on(33.0 * UP, UP, np.array([1.0, 0.0, 0.0]), 30.0, until=lambda p: p[:, 0] > 0.1)
    touch = touch_points(machine(), plan, Tip(), TriggerOptions(points=6))
    counts = [(c.points[:, 0] > 0.1).sum() for c in touch.contours]
    assert counts == [2, 1, 1]
    assert all((c.points[:, 0] < -0.1).sum() == 6 for c in touch.contours)


def test_a_touch_of_points_amid_known_surface_is_a_touch():
    atlas, plan = Atlas(0.1), plan_on(33.0 * UP, UP, np.array([1.0, 0.0, 0.0]), 30.0)
    assert not atlas.add(touch_points(machine(), plan, Tip(), TriggerOptions(points=6))).refused
    known = replace(plan, number=1, until=lambda p: p[:, 2] > 0.0)
    touch = touch_points(machine(), known, Tip(), TriggerOptions())
    assert [len(contour.points) for contour in touch.contours] == [5, 3, 3]
    assert not atlas.add(touch).refused


class Noted:
    """A trigger that notes where measurements begin and end, (k, 2, 3), and the ways (n, 3) that it
    goes; straight lines longer than ``most`` are blocked at their beginning."""

    def __init__(self, trigger: BallTrigger, most: float = np.inf) -> None:
        self._trigger, self._most = trigger, most
        self.measured, self.ways = [], []

    def position(self) -> np.ndarray:
        return self._trigger.position()

    def move(self, way) -> bool:
        way = np.reshape(way, (-1, 3))
        self.ways.append(way)
        lengths = np.linalg.norm(np.diff(np.vstack([self.position(), way]), axis=0), axis=1)
        return bool((lengths <= self._most).all()) and self._trigger.move(way)

    def probe(self, target) -> np.ndarray | None:
        begin, found = self.position().copy(), self._trigger.probe(target)
        if found is not None:
            self.measured.append((begin, found))
        return found


def test_points_that_lie_where_an_arc_goes_on_are_measured_from_the_retract_height():
    """On a face the third to fifth points of each arm are where the first two say. A circle of
    radius s is left at s sin(h / s), less than h, above them; rounding and the end of a way, 1e-5
    of the radius of 2, are 2e-5."""
    trigger = Noted(machine(CUBE))
    plan = plan_on(np.array([0.0, 0.0, 30.0]), UP, np.array([1.0, 0.0, 0.0]), 25.0)
    touch_points(trigger, plan, Tip(), TriggerOptions(points=5, retract=1.0))
    begins, found = np.array(trigger.measured)[1:].reshape(6, 5, 2, 3).transpose(2, 0, 1, 3)
    heights = begins[..., 2] - found[..., 2]
    assert (heights[:, 2:] <= 1.0 + 2e-5).all() and (heights[:, 0] > 1.5).all()


def test_a_way_back_over_a_face_does_not_visit_the_points_again():
    """Each of six arms has a line up, two to and from each of five points, and two or fewer back,
    because the tip left the first of them a little lower; a touch has one line to its beginning,
    and one from its end."""
    trigger = Noted(machine(CUBE))
    plan = plan_on(np.array([0.0, 0.0, 30.0]), UP, np.array([1.0, 0.0, 0.0]), 25.0)
    touch_points(trigger, plan, Tip(), TriggerOptions(points=5))
    assert sum(len(way) for way in trigger.ways) <= 6 * (1 + 2 * 5 + 2) + 2


def test_a_way_back_that_is_blocked_goes_where_the_tip_came():
    """Lines of more than two steps of 5 are blocked, as by a wall: the straight way back of 25 is,
    and no other. Points are the same as without the wall."""
    plan = plan_on(np.array([0.0, 0.0, 30.0]), UP, np.array([1.0, 0.0, 0.0]), 25.0, approach=9.0)
    found, ends = [], []
    for most in (np.inf, 10.0):
        trigger = Noted(machine(CUBE), most)
        trigger._trigger.place([0.0, 0.0, 39.0])
        found.append(touch_points(trigger, plan, Tip(), TriggerOptions(points=5)))
        ends.append(trigger.position())
    assert np.allclose(ends[0], ends[1]) and max(len(way) for way in trigger.ways) > 5
    for one, other in zip(*(touch.contours for touch in found), strict=True):
        assert np.allclose(one.points, other.points)


@pytest.mark.parametrize(
    ("name", "spoiled", "said"),
    [
        ("move", lambda arrived: None, "move returned None; it must return True where it arrived"),
        ("probe", lambda place: place * np.nan, "place that probe returned holds NaN"),
        ("probe", lambda place: place[:2], "place that probe returned"),
        ("position", lambda place: place * np.nan, "position of the trigger holds NaN"),
    ],
)
def test_a_machine_that_answers_otherwise_than_a_trigger_does_is_told(name, spoiled, said):
    """A move that says nothing would make all places unreachable, without a word."""
    trigger = machine()
    sound = getattr(trigger, name)
    setattr(trigger, name, lambda *given: spoiled(sound(*given)))
    with pytest.raises(ValueError, match=said):
        touch_points(trigger, plan_on(33.0 * UP, UP, [1.0, 0.0, 0.0]), Tip(radius=2.0))
