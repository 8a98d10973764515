"""The simulated scanning probe, tracked in planes of any orientation."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.atlas import TouchStatus
from touchatlas.atlas.check.faults import faults
from touchatlas.patch import ContourEnd
from touchatlas.planner import ProbePlan, Reading, Reason, Tip, TrackingOptions, explore
from touchatlas.planner.plans import concurrent_planes
from touchatlas.planner.tracking.track_plan import track_plan
from touchatlas.sim import RunOptions, make_object
from touchatlas.sim.machine.beam_scanner import Beam, BeamScanner
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import ProbeOptions
from touchatlas.sim.machine.probes import machine_probe
from touchatlas.sim.machine.simulated_probe import probe_of
from touchatlas.sim.run.work import begin, random_streams

BALL = make_object("sphere")
FEET = Feet(BALL)


def machine(seed, feet=FEET, tips=6, place=(0.0, 0.0, 100.0)) -> BeamScanner:
    found = BeamScanner(feet, Beam(), np.random.default_rng(seed), tips)
    found.place(place)
    return found


def plan_on(point, normal, heading, reach=10.0, **others) -> ProbePlan:
    planes = concurrent_planes(point, normal, heading, 3)
    return ProbePlan(0, point, normal, planes, reach, 2.5, 2.0, Reason.REFINE, **others)


class OneTip:
    """A machine as a robot is one: arrays (3,)."""

    def __init__(self, scanner: BeamScanner) -> None:
        self._scanner = scanner
        self.ways: list[np.ndarray] = []

    def move(self, way):
        self.ways.append(np.array(way))
        return self._scanner.move(way)

    def read(self):
        reading = self._scanner.read()
        return Reading(reading.time, reading.position[0], reading.force[0])

    def command(self, velocity):
        assert velocity.shape == (3,)
        self._scanner.command(velocity[None])


@pytest.mark.parametrize("feed", [10.0, 20.0])
def test_a_ball_is_tracked_in_planes_of_any_orientation(feed):
    """The stated deviation of a sample is 4.8 um; 100 of them are within four and a half of it.
    Forces are those of the paper, 20 to 70 g."""
    rng, arms = np.random.default_rng(1), []
    (point,), (normal,) = BALL.sample(1, rng)
    scanner = machine(1, place=3.0 * point)
    plan = plan_on(point, normal, rng.normal(size=3))
    touch = track_plan(scanner, plan, Tip(), TrackingOptions(feed=feed), arms)
    points = np.concatenate([contour.points for contour in touch.contours])
    normals = np.concatenate([contour.normals for contour in touch.contours])
    noise = touch.contours[0].noise_std
    assert np.abs(np.linalg.norm(points, axis=1) - 33.0).max() < 4.5 * noise
    assert ((points / 33.0 * normals).sum(axis=1) > np.cos(np.radians(3.0))).all()
    assert sum(arm.losses for arm in arms) == 0
    force = np.concatenate([np.linalg.norm(arm.series.forces, axis=1) for arm in arms])
    assert np.mean((force > 0.196) & (force < 0.687)) > 0.99
    assert {arm.end for arm in arms} == {ContourEnd.LENGTH_REACHED}


def test_one_tip_does_arm_after_arm_what_six_do_side_by_side():
    one = OneTip(machine(2, tips=1))
    top = np.array([0.0, 0.0, 33.0])
    touch = track_plan(one, plan_on(top, top / 33.0, np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.TOUCHED and len(touch.contours) == 3
    for contour in touch.contours:
        away = np.linalg.norm(contour.points, axis=1) - 33.0
        assert np.abs(away).max() < 5.0 * contour.noise_std and len(contour.points) == 9
    # On its ways back the tip keeps off the surface.
    assert all(np.linalg.norm(way, axis=1).min() > 35.0 + 1.0 for way in one.ways)


def test_arms_that_were_tracked_are_kept_where_the_next_cannot_be_reached():
    class Blocked(OneTip):
        def read(self):
            # After some seconds the surface is gone.
            reading = super().read()
            late = reading.time > 3.5
            return Reading(reading.time, reading.position, reading.force * (0.0 if late else 1.0))

    top, arms = np.array([0.0, 0.0, 33.0]), []
    plan = plan_on(top, top / 33.0, np.array([1.0, 0.0, 0.0]), 4.0, approach=3.0)
    touch = track_plan(Blocked(machine(2, tips=1)), replace(plan, step=1.0), arms=arms)
    assert touch.status is TouchStatus.TOUCHED and len(touch.contours) == 3 and len(arms) == 6
    assert arms[-1].end is ContourEnd.UNREACHABLE
    counts = [len(contour.points) for contour in touch.contours]
    assert counts[0] > 4 and counts[-1] == 1


class Pressed(OneTip):
    """Ten times the force is read from ``x`` on, as where the tip is jammed, until the tip is off;
    ``pressing`` has the commands that push on."""

    def __init__(self, scanner: BeamScanner, x: float) -> None:
        super().__init__(scanner)
        self.x, self.force, self.pressing = x, np.zeros(3), 0

    def read(self):
        reading = super().read()
        jammed = reading.position[0] > self.x and np.linalg.norm(reading.force) > 0.1
        self.force = reading.force * (10.0 if jammed else 1.0)
        return replace(reading, force=self.force)

    def command(self, velocity):
        self.pressing += np.linalg.norm(self.force) > 1.5 and velocity @ self.force <= 0.0
        super().command(velocity)


def test_an_arm_ends_where_the_force_is_too_large():
    """The tip leaves the surface at once, the arm keeps its samples before, the others are
    whole."""
    top, arms = np.array([0.0, 0.0, 33.0]), []
    plan = plan_on(top, top / 33.0, np.array([1.0, 0.0, 0.0]))
    scanner = Pressed(machine(2, tips=1), 6.0)
    touch = track_plan(scanner, plan, arms=arms)
    ends = [arm.end for arm in arms]
    assert ends.count(ContourEnd.OVERLOAD) == 1 and scanner.pressing == 0
    short = arms[ends.index(ContourEnd.OVERLOAD)].samples.contacts(2.0)
    assert len(short) >= 2 and short[:, 0].max() < 6.0
    assert touch.status is TouchStatus.TOUCHED and len(touch.contours) == 3
    assert ends.count(ContourEnd.LENGTH_REACHED) == 5


def test_a_place_whose_approach_meets_too_large_a_force_is_unreachable():
    top = np.array([0.0, 0.0, 33.0])
    scanner = Pressed(machine(2, tips=1), -50.0)
    plan = plan_on(top, top / 33.0, np.array([1.0, 0.0, 0.0]))
    touch = track_plan(scanner, plan)
    assert touch.status is TouchStatus.UNREACHABLE and scanner.pressing == 0
    assert np.linalg.norm(scanner.force) < TrackingOptions().least


def test_where_the_way_back_is_blocked_the_arms_before_are_kept():
    class Roofed(OneTip):
        def move(self, way):
            # Something is above the end of the first arm, beyond x = 5.
            return super().move(way) if np.asarray(way)[-1][0] < 5.0 else False

    top, arms = np.array([0.0, 0.0, 33.0]), []
    plan = plan_on(top, top / 33.0, np.array([1.0, 0.0, 0.0]))
    one = Roofed(machine(2, tips=1))
    touch = track_plan(one, plan, arms=arms)
    assert touch.status is TouchStatus.TOUCHED and len(arms) == 6
    tracked = [len(arm.samples.centres) > 1 for arm in arms]
    assert tracked.index(False) >= 1 and not any(tracked[tracked.index(False) :])


def test_a_tip_rolls_over_a_sharp_edge():
    """The plane y = 0 of the cube of side 60: from the top, around an edge, down a side."""
    cube = make_object("cube")
    scanner = machine(3, Feet(cube))
    top = np.array([22.0, 0.0, 30.0])
    plan = plan_on(top, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), 20.0)
    touch = track_plan(scanner, plan, options=TrackingOptions(feed=20.0))
    points = np.concatenate([contour.points for contour in touch.contours])
    assert np.abs(np.abs(points).max(axis=1) - 30.0).max() < 0.05
    assert (points[:, 2] < 25.0).any() and (points[:, 2] > 29.9).any()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_tip_that_waits_for_another_goes_back_as_it_came(side):
    """One of two arms ends early, and its noise while it waits is no way: points of a way back are
    about a retract apart."""

    class Recorded(BeamScanner):
        way_points = 0

        def move(self, way):
            self.way_points += len(way)
            return super().move(way)

    top = np.array([0.0, 0.0, 33.0])
    plan = plan_on(top, top / 33.0, np.eye(3)[0], 30.0, until=lambda p: side * p[:, 0] > 2.0)
    scanner, arms = Recorded(FEET, Beam(), np.random.default_rng(7), 2), []
    scanner.place([0.0, 0.0, 100.0])
    track_plan(scanner, plan, options=TrackingOptions(feed=20.0), arms=arms)
    assert all(len(arm.samples.centres) > 1 for arm in arms)
    # Each of three planes is gone 30 along at most; a few more points lead to and from it.
    assert scanner.way_points < 3.0 * (30.0 / TrackingOptions().retract + 5.0)


def test_a_place_without_surface_has_no_contact_and_a_way():
    scanner = machine(4)
    beside, up = np.array([50.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    touch = track_plan(scanner, plan_on(beside, up, np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.NO_CONTACT and not touch.contours
    # The approach looks 5 below the place for contact, which is 2 below the centre.
    assert np.allclose(touch.way[:, :2], [50.0, 0.0]) and touch.way[1, 2] == -5.0


def test_an_approach_cannot_begin_inside():
    scanner = machine(5)
    touch = track_plan(scanner, plan_on(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(3)[0]))
    assert touch.status is TouchStatus.UNREACHABLE


def test_known_surface_ends_an_arm():
    scanner = machine(6)
    top = np.array([0.0, 0.0, 33.0])
    plan = plan_on(top, top / 33.0, np.eye(3)[0], 30.0, until=lambda p: p[:, 0] > 2.0)
    touch = track_plan(scanner, plan, options=TrackingOptions(feed=20.0))
    x = np.concatenate([contour.points[:, 0] for contour in touch.contours])
    # It is known from the first step on; four steps count for nothing, and then five are enough.
    assert x.min() < -23.0 < 15.0 < x.max() < 22.0


def test_a_small_ball_goes_on_around_sharp_edges():
    """The feed leads a ball of 0.1 mm past the edge of a cube before the force says so; it finds
    the other face, by turning about the edge. Contacts are on the cube but for noise, and the
    filter rounds the edge off by less than the radius."""
    cube, arms = make_object("cube"), []
    near = np.array([24.0, 3.0, 30.0])
    scanner = BeamScanner(Feet(cube), Beam(radius=0.1), np.random.default_rng(3))
    scanner.place(near + np.array([0.0, 0.0, 20.0]))
    plan = plan_on(near, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), reach=15.0)
    touch = track_plan(scanner, plan, Tip(radius=0.1), arms=arms)
    assert {arm.end for arm in arms} == {ContourEnd.LENGTH_REACHED}
    points = np.concatenate([contour.points for contour in touch.contours])
    off = np.abs(points).max(axis=1) - 30.0
    assert off.max() < 0.1 and np.quantile(np.abs(off), 0.9) < 0.03
    assert (points[:, 2] < 28.0).sum() > 3


def test_a_probe_without_normals_gives_centres_in_the_planes_in_which_they_lay():
    """Centres are on a ball of 35 mm, as those of contacts with normals are, for a plan for the
    centre."""
    probe = machine_probe(
        BALL, ProbeOptions("scanning", normals=False), 0.02, 1.0, np.random.default_rng(4)
    )
    top, up = BALL.start()
    touch = probe(plan_on(top + 2.0 * up, up, np.array([1.0, 0.0, 0.0])))
    assert touch.tip_radius == 2.0
    for contour in touch.contours:
        away = np.linalg.norm(contour.points, axis=1) - 35.0
        assert contour.normals is None and np.abs(away).max() < 0.05
        assert np.allclose((contour.points - touch.contact) @ contour.plane.normal, 0.0, atol=1e-9)
    assert touch.way[1] == pytest.approx(touch.contact, abs=0.5)


@pytest.mark.parametrize("radius", [12.0, 40.0])
def test_a_ball_larger_than_a_surface_is_curved_rests_on_it(radius):
    """A ball of 40 mm on the top of a bottle, whose rim has a radius of some millimetres: contacts
    lie on the bottle, whatever the ball."""
    bottle = make_object("bottle")
    probe = machine_probe(
        bottle, ProbeOptions("scanning", radius=radius), 0.02, 1.0, np.random.default_rng(5)
    )
    touch = probe(plan_on(*bottle.start(), np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.TOUCHED
    points = np.concatenate([contour.points for contour in touch.contours])
    value, gradient = bottle.field.first_order(points)
    assert np.abs(value / np.linalg.norm(gradient, axis=1)).max() < 0.15


@pytest.mark.parametrize("normals", [True, False])
def test_a_way_without_contact_passes_the_planned_place(normals):
    """The lowest point of the ball, or its centre, where the touch is of centres."""
    probe = machine_probe(
        BALL,
        ProbeOptions("scanning", radius=9.0, normals=normals),
        0.02,
        1.0,
        np.random.default_rng(6),
    )
    beside = np.array([80.0, 0.0, 33.0])
    touch = probe(plan_on(beside, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])))
    assert touch.status is TouchStatus.NO_CONTACT
    assert touch.way[0][2] > 33.0 > touch.way[1][2]
    assert touch.tip_radius == (0.0 if normals else 9.0)


def test_a_sound_probe_without_normals_has_no_fault():
    """Its centres lie beside the planned planes by what the control leaves."""
    options = RunOptions(0.02, 0.1, probe=ProbeOptions("scanning", normals=False))
    streams = random_streams(0)
    atlas, planner = begin(options, BALL, streams[3])
    probe = probe_of(options, BALL, streams[0])
    for step in explore(atlas, planner, probe, 2):
        assert step.touch.status is TouchStatus.TOUCHED
        # The first plan is for the centre, too.
        assert np.linalg.norm(step.plan.reference_point) == pytest.approx(35.0, abs=0.3)
    assert not faults(atlas)
