"""Ways between touches keep clear of what is known; costs of touches are seconds of a machine."""

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas import Atlas
from touchatlas.planner import CostModel, PlannerOptions
from touchatlas.planner.safe_ways import safe_way

TIP, ROOM = 2.0, 3.0


@pytest.fixture(scope="module")
def torus():
    return explored("torus").atlas


def distance(points) -> np.ndarray:
    """(n,) from a torus of radii 40 and 15."""
    ring = np.hypot(points[:, 0], points[:, 1]) - 40.0
    return np.hypot(ring, points[:, 2]) - 15.0


def along(start, way) -> np.ndarray:
    """Points of a way, 500 on each line."""
    at = np.linspace(0.0, 1.0, 500)[:, None]
    corners = np.vstack([start, way])
    return np.vstack([a + at * (b - a) for a, b in zip(corners[:-1], corners[1:], strict=True)])


def test_ways_keep_clear_of_what_is_known(torus):
    """From outside through nothing into the hole, to the other side, and from hole to hole: ends
    are 6 off the surface, so all of a way is as far as the tip and its room, less what the surface
    may bend between samples."""
    out, up = np.eye(3)[0], np.eye(3)[2]
    places = [61.0 * out, 19.0 * out, -61.0 * out, 40.0 * out + 21.0 * up, -19.0 * out]
    places += [-40.0 * out - 21.0 * up]
    for start in places:
        for goal in places:
            way = safe_way(torus, start, goal, TIP, ROOM)
            assert (way[-1] == goal).all()
            assert distance(along(start, way)).min() > TIP + 0.5 * ROOM


def test_a_free_way_is_straight(torus):
    start, goal = np.array([61.0, 0.0, 0.0]), np.array([61.0, 20.0, 0.0])
    assert safe_way(torus, start, goal, TIP, ROOM).tolist() == [goal.tolist()]
    assert safe_way(Atlas(0.1), start, -goal, TIP, ROOM).tolist() == [(-goal).tolist()]


def test_a_way_begins_in_contact(torus):
    """Nothing is nearer to the way than to its ends."""
    start = np.array([57.0, 0.0, 0.0])
    way = safe_way(torus, start, np.array([-57.0, 0.0, 0.0]), TIP, ROOM)
    assert distance(along(start, way)).min() > 0.9 * TIP


def test_a_tip_at_rest_on_samples_leaves_along_their_normal(torus):
    """A ball whose centre is learned rests on the samples, which are dense along contours: a way
    that leans a little comes nearer to the next one."""
    goal = np.array([0.0, 0.0, 90.0])
    for start in torus.pool.points[::40]:
        assert safe_way(torus, start, goal, 0.0, ROOM) is not None


def test_a_place_without_a_clear_way_out_has_no_way(torus):
    """Amid the tube all that is known is nearer than there is room; a plan has none either, and a
    machine that is to go there stays."""
    inside, outside = np.array([40.0, 0.0, 0.0]), np.array([90.0, 0.0, 0.0])
    assert safe_way(torus, outside, inside, TIP, ROOM) is None


def test_a_tip_that_is_inside_of_what_is_known_leaves_straight_outward(torus):
    """Where a tip is, nothing is: the known surface is wrong there. The distance rises along the
    way out until there is room."""
    start, goal = np.array([40.0, 0.0, 0.0]), np.array([90.0, 0.0, 0.0])
    way = safe_way(torus, start, goal, TIP, ROOM)
    off = distance(along(start, way))
    free = int(np.flatnonzero(off > TIP + ROOM)[0])
    assert (np.diff(off[: free + 1]) > 0.0).all()
    assert off[free:].min() > TIP + 0.5 * ROOM
    assert (way[-1] == goal).all()


def test_seconds_are_those_of_approach_arms_points_and_ways():
    """By hand: 20 / 5 of approach, 6 arms of 5 points, 2 s each, (100 + 20) / 40 in air."""
    model = CostModel(rapid=40.0, approach=5.0, point=2.0, points=5)
    assert model.seconds(np.array([100.0]), 20.0, 50.0, 3) == pytest.approx(4.0 + 60.0 + 3.0)
    with pytest.raises(ValueError, match="rapid is -1"):
        CostModel(rapid=-1.0)
    with pytest.raises(ValueError, match="it must be a CostModel"):
        PlannerOptions(cost=3.0)
