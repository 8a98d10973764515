"""Clearance: a pin reaches what its straight way leads to; an approach begins between walls."""

import numpy as np
import pytest

from tests.explored import explored
from tests.truths import UP
from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, PlannerOptions, StopReason
from touchatlas.planner.clearance import clear_height
from touchatlas.planner.clearance import pin_is_clear as is_clear
from touchatlas.sim import Probe, make_object

# The torus has a tube of radius 15 about a circle of radius 40: its hole is 50 wide.
HOLE = 50.0


def pin_is_clear(atlas, point, normal, radius: float, length: float) -> bool:
    return is_clear(atlas, point, normal, PlannerOptions(pin_radius=radius, pin_length=length))


@pytest.fixture(scope="module")
def torus():
    return explored("torus").atlas


@pytest.mark.parametrize("angle", [0.0, 1.0, 4.0])
def test_a_pin_longer_than_the_hole_does_not_reach_its_wall(torus, angle):
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    inner, outer = 25.0 * outward, 55.0 * outward
    assert pin_is_clear(torus, inner, -outward, 1.0, HOLE - 5.0)
    assert not pin_is_clear(torus, inner, -outward, 1.0, HOLE + 5.0)
    assert pin_is_clear(torus, outer, outward, 1.0, 10.0 * HOLE)


def test_a_thick_pin_does_not_enter_the_hole(torus):
    """The centre of a tip of radius 20 is 30 from the opposite wall, that of one of 30 is 20."""
    inner, normal = np.array([25.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    assert pin_is_clear(torus, inner, normal, 20.0, 21.0)
    assert not pin_is_clear(torus, inner, normal, 30.0, 31.0)


@pytest.mark.parametrize("length", [1e6, 1e17, 1e300, 1.7e308])
@pytest.mark.parametrize("radius", [1e-300, 1.0])
def test_a_pin_of_any_length_does_not_reach_the_wall_of_the_hole(torus, radius, length):
    """What is beyond all that is known stops nothing; the wall opposite does, however far the pin
    goes on behind it."""
    inner, outer = np.array([25.0, 0.0, 0.0]), np.array([55.0, 0.0, 0.0])
    outward = np.array([1.0, 0.0, 0.0])
    assert pin_is_clear(torus, outer, outward, radius, length)
    assert not pin_is_clear(torus, inner, -outward, radius, length)


@pytest.mark.parametrize("radius", [1e3, 1e9, 1e300, 8e307])
def test_a_pin_far_thicker_than_the_body_has_a_flat_end(torus, radius):
    """It rests on the outside and on the top of a torus, whose tangent planes meet nothing else,
    and does not enter the hole."""
    out, up = np.eye(3)[0], np.eye(3)[2]
    assert pin_is_clear(torus, 55.0 * out, out, radius, 2.0 * radius)
    assert pin_is_clear(torus, 40.0 * out + 15.0 * up, up, radius, 2.0 * radius)
    assert not pin_is_clear(torus, 25.0 * out, -out, radius, 2.0 * radius)


def test_a_pin_that_cannot_turn_reaches_what_it_looks_at(torus):
    """From above: the top and the outside, the wall of the hole, and nothing from below."""
    out, up = np.eye(3)[0], np.eye(3)[2]
    for styli, point, normal, clear in (
        ("0,0,1", 40.0 * out + 15.0 * up, up, True),
        ("0,0,1", 55.0 * out, out, True),
        ("0,0,1", 25.0 * out, -out, True),
        ("0,0,1", 40.0 * out - 15.0 * up, -up, False),
        ("0,0,1;0,0,-1", 40.0 * out - 15.0 * up, -up, True),
        ("1,0,0", 25.0 * out, -out, False),
    ):
        options = PlannerOptions(pin_radius=1.0, pin_length=2 * HOLE, styli=styli)
        assert is_clear(torus, point, normal, options) is clear


def test_styli_that_are_no_directions_are_refused():
    with pytest.raises(ValueError, match="styli is '0,0'; it must be directions"):
        PlannerOptions(pin_radius=1.0, pin_length=20.0, styli="0,0")
    with pytest.raises(ValueError, match="it needs pin_radius and pin_length"):
        PlannerOptions(styli="0,0,1")


def test_a_pin_of_no_length_reaches_everything(torus):
    assert pin_is_clear(torus, [25.0, 0.0, 0.0], np.array([-1.0, 0.0, 0.0]), 0.0, 0.0)


def places_without_reach(seed: int, length: float) -> np.ndarray:
    """(k, 3) places that an exploration of the torus by a pin of a length could not reach; each of
    its plans is clear."""
    obj = make_object("torus")
    options = PlannerOptions(pin_radius=1.0, pin_length=length)
    atlas, planner = Atlas(obj.tolerance), Planner(*obj.start(), options)
    probe = Probe(obj, obj.noise_std, np.random.default_rng(seed))
    closer = False
    while (plan := planner.ask(atlas)) is not None:
        if len(atlas) and not closer:
            assert pin_is_clear(atlas, plan.reference_point, plan.normal, 1.0, length)
        touch = probe(plan)
        change = atlas.add(touch)
        planner.tell(touch, change)
        # The next plan may be at the same place, with shorter arms.
        closer = bool(change.refused)
    assert planner.stop is not None and planner.stop.reason is StopReason.KNOWN
    return planner.stop.unreachable


@pytest.mark.slow
def test_an_exploration_works_around_what_its_pin_cannot_reach():
    """A pin of 60 mm reaches no wall of the hole where the opposite one is known. Contours from
    other places cross these walls, in most explorations before a touch there is wanted."""
    places = np.concatenate([places_without_reach(seed, HOLE + 10.0) for seed in range(6)])
    assert len(places) and np.hypot(places[:, 0], places[:, 1]).max() < 40.0


def walls(gap: float) -> Atlas:
    """A floor at z = 0 that faces up, and a ceiling over it that faces down."""
    atlas = Atlas(0.1)
    pool = atlas.pool
    grid = np.stack(np.meshgrid(np.linspace(-5, 5, 11), np.linspace(-5, 5, 11)), -1).reshape(-1, 2)
    for height, side in ((0.0, 1.0), (gap, -1.0)):
        points = np.column_stack([grid, np.full(len(grid), height)])
        normals = np.broadcast_to(side * UP, points.shape)
        pool.add(points, normals, np.zeros(points.shape), False, 0.0)
    return atlas


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e3])
def test_an_approach_between_walls_begins_half_way(unit):
    atlas = walls(4.0)
    atlas.pool.points[:] *= unit
    at = np.array([0.3, -0.2, 0.0]) * unit
    assert clear_height(atlas, at, UP, 10.0 * unit) == pytest.approx(2.0 * unit, rel=1e-12)


def test_walls_far_apart_leave_the_approach_to_the_probe():
    """An approach from 1.9 begins on this side of the middle of 4."""
    assert clear_height(walls(4.0), np.zeros(3), UP, 1.9) == 0.0


def test_the_back_of_a_thin_wall_is_not_in_the_way():
    """Seen from above, the ceiling faces away from a probe that comes from above it."""
    assert clear_height(walls(4.0), np.array([0.0, 0.0, 4.0]), -UP, 10.0) == pytest.approx(2.0)
    thin = walls(-0.5)
    assert clear_height(thin, np.zeros(3), UP, 10.0) == 0.0
