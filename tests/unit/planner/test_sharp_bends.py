"""Sharp bends: arms that end before them tell where the surface is touched from outside."""

import numpy as np
import pytest

from tests.flat import UP
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason, explore
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.sharp_bends import sharp_bends, side_target
from touchatlas.sim import Probe
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject

STEP, FORWARD, SIDE = 0.1, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
FLAT = STEP * np.arange(-8, 9)[:, None] * FORWARD
EXTENT = 10.0
BEND = np.array([[1.0, 2.0, 3.0], FORWARD])
FARTHER = np.array([[0.2, 0.0, 0.0], [0.0, 0.0, 0.0]])


def bends(points, end=ContourEnd.TURNED_AWAY, approach=UP) -> list[np.ndarray]:
    """The bends at the end of a contour through the origin, in the plane y = 0."""
    plane = SamplingPlane(np.zeros(3), SIDE)
    contour = Contour(points, plane, 1e-3, (ContourEnd.LENGTH_REACHED, end))
    touch = Touch(0, np.zeros(3), approach, (contour,), TouchStatus.TOUCHED, 1.0, 0.0)
    turn = 2.0 * np.pi / 3.0
    plan = ProbePlan(0, np.zeros(3), UP, (plane,), 1.0, STEP, turn, Reason.EXPAND)
    return sharp_bends(touch, plan)


def side(bend_points, reason=Reason.EXPAND, done=None, wall=None) -> Target | None:
    """The target beside a place at (1, 2, 2.5), with samples of a wall on x = 1.3 that face
    along ``wall``."""
    none = np.zeros((0, 3))
    done = none if done is None else done
    atlas = Atlas(0.1)
    if wall is not None:
        point = BEND[:1] + [[0.3, 0.0, 0.0]]
        atlas.pool.add(point, wall[None], SIDE[None], np.zeros(1, bool), np.full(1, 1e-3))
    view = View(atlas, 1.0, np.zeros((1, 3)), done, none, none, EXTENT)
    return side_target(Target(np.array([1.0, 2.0, 2.5]), UP, reason), bend_points, view)


@pytest.mark.parametrize("outward", [UP, -UP])
def test_a_flat_arm_that_turned_away_ends_before_a_bend(outward):
    """An eighth of a step inside the last sample, on either side of a plate."""
    ((point, ahead),) = bends(FLAT, approach=outward)
    assert ahead == pytest.approx(FORWARD)
    assert point == pytest.approx(FLAT[-1] - STEP / 8.0 * outward)


def test_an_arm_that_came_back_to_its_last_sample_tells_of_no_bend():
    """Its end has no direction."""
    assert not bends(np.vstack([FLAT, FLAT[-2:-4:-1], FLAT[-1:]]))


@pytest.mark.parametrize("steps", [1.5, 2.0, 3.0, 4.0, 6.0])
def test_an_arm_that_turned_gradually_ends_before_no_bend(steps):
    """On a circle of some steps an arm turns by 105 to 120 degrees, with a sample each 15."""
    angles = np.linspace(-0.5, np.deg2rad(110.0), int(2.5 * max(steps, 4.0)))
    angles -= angles[np.abs(angles).argmin()]
    circle = steps * STEP * np.column_stack([np.sin(angles), 0.0 * angles, np.cos(angles) - 1.0])
    assert not bends(circle)


def test_an_arm_that_ended_for_another_reason_tells_of_no_bend():
    for end in ContourEnd:
        assert len(bends(FLAT, end)) == (end is ContourEnd.TURNED_AWAY)


def test_an_arm_of_few_samples_tells_of_no_bend():
    """Its two directions are those of four samples each."""
    assert not bends(FLAT[:14]) and bends(FLAT[:15])


def test_a_place_beside_bends_is_touched_at_the_nearest_from_outside():
    found = side([BEND + FARTHER, BEND, BEND + FARTHER])
    assert found is not None and found.reason is Reason.EXPAND
    assert found.point == pytest.approx(BEND[0])
    assert found.normal == pytest.approx(BEND[1])


def test_a_place_is_touched_as_planned_without_three_bends_near():
    """A tenth of the extent is near."""
    away = [[0.0, 0.0, 0.51], [0.0, 0.0, 0.0]]
    assert side([]) is None and side([BEND, BEND]) is None
    assert side([BEND, BEND, BEND + away]) is None


def test_a_place_is_touched_as_planned_where_it_is_known_or_the_bends_were_tried():
    three = [BEND] * 3
    assert side(three) is not None and side(three, Reason.REFINE) is None
    assert side(three, done=BEND[:1]) is None


def test_a_place_is_touched_as_planned_where_a_wall_stands_ahead_of_the_bend():
    """As at the bottom of a groove. The far side of a rim faces away from the arm."""
    three = [BEND] * 3
    assert side(three, wall=-FORWARD) is None
    assert side(three, wall=FORWARD) is not None and side(three, wall=UP) is not None


def test_the_far_side_of_a_thin_disc_is_touched():
    """Its rim has a radius of 0.27 where steps are 1.7 long; arms that begin on one side end before
    it. Touched from there alone, the far side is not met in 60 touches."""
    axes = (60.0, 50.0, 4.0)
    disc = ImplicitObject("disc", "", quadric_with_bumps(axes), axes, 0.02, 3.0)
    atlas, planner = Atlas(3.0, scale=0.1), Planner(*disc.start())
    for _ in explore(atlas, planner, Probe(disc, 0.02, np.random.default_rng(0)), 18):
        pass
    heights = atlas.pool.points[:, 2]
    assert heights.max() > 3.0 and heights.min() < -3.0
