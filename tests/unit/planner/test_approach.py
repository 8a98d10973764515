"""Approaches: a probe comes from between two walls, beside an edge, or to what is known."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.flat import UP, flat_touch, plane
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason, explore
from touchatlas.planner.approach import approach_within
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.plans import beside_plan, known_plan
from touchatlas.sim import Probe
from touchatlas.sim.world.mesh_object import MeshObject

ACROSS = np.array([1.0, 0.0, 0.0])


def walls(gap: float) -> SamplePool:
    """A floor at z = 0 that faces up, and a ceiling over it that faces down."""
    pool = SamplePool()
    grid = np.stack(np.meshgrid(np.linspace(-5, 5, 11), np.linspace(-5, 5, 11)), -1).reshape(-1, 2)
    for height, side in ((0.0, 1.0), (gap, -1.0)):
        points = np.column_stack([grid, np.full(len(grid), height)])
        normals = np.broadcast_to(side * UP, points.shape)
        pool.add(points, normals, np.zeros(points.shape), False, 0.0)
    return pool


def plan_at(point, normal=UP) -> ProbePlan:
    planes = concurrent_planes(point, normal, np.array([0.0, 1.0, 0.0]), 3)
    return ProbePlan(0, point, normal, planes, 10.0, 0.5, 2.0, Reason.EXPAND)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e3])
def test_an_approach_between_walls_begins_half_way(unit):
    pool = walls(4.0)
    pool.points[:] *= unit
    at = np.array([0.3, -0.2, 0.0]) * unit
    assert approach_within(pool, at, UP, 10.0 * unit) == pytest.approx(2.0 * unit, rel=1e-12)


def test_walls_far_apart_leave_the_approach_to_the_probe():
    """An approach from 1.9 begins on this side of the middle of 4."""
    assert approach_within(walls(4.0), np.zeros(3), UP, 1.9) == 0.0


def test_the_back_of_a_thin_wall_is_not_in_the_way():
    """Seen from above, the ceiling faces away from a probe that comes from above it."""
    assert approach_within(walls(4.0), np.array([0.0, 0.0, 4.0]), -UP, 10.0) == pytest.approx(2.0)
    thin = walls(-0.5)
    assert approach_within(thin, np.zeros(3), UP, 10.0) == 0.0


def arms(contact, first: float, last: float) -> Touch:
    """A touch of a plane whose contours run from ``first`` to ``last`` along x, and beside it."""
    contours, s = [], np.linspace(first, last, 25)[:, None]
    for angle in (-0.5, 0.0, 0.5):
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        sampling = SamplingPlane(contact, np.cross(along, UP))
        ends = (ContourEnd.LENGTH_REACHED, ContourEnd.TURNED_AWAY)
        contours.append(Contour(contact + s * along, sampling, 0.001, ends))
    return Touch(0, contact, UP, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0)


def test_a_touch_at_an_edge_is_made_again_in_the_middle_of_its_arc():
    touch = arms(np.zeros(3), 0.0, 6.0)
    plan = beside_plan(plan_at(np.zeros(3)), touch, 3)
    assert plan is not None
    # Twenty-five samples over 6: the middle one is at 3, along one of the arms.
    assert np.linalg.norm(plan.reference_point) == pytest.approx(3.0, abs=1e-9)
    assert plan.reference_point[0] > 2.5 and plan.normal == pytest.approx(UP)
    assert all(p.point == pytest.approx(plan.reference_point) for p in plan.planes)


def test_a_touch_in_the_middle_of_its_arcs_is_not_moved():
    assert beside_plan(plan_at(np.zeros(3)), arms(np.zeros(3), -3.0, 3.0), 3) is None


def test_arcs_along_the_approach_are_another_side():
    """What the probe reached down a wall says nothing of the side that it came from."""
    touch = arms(np.zeros(3), 0.0, 6.0)
    assert beside_plan(plan_at(np.zeros(3), ACROSS), touch, 3) is None


def test_a_place_that_was_missed_is_sought_from_the_nearest_sample():
    """Its first plane holds the sample and the place, so that a contour runs from one to the
    other."""
    atlas = plane([(0, 0), (1, 0)])
    missed = np.array([4.0, 0.3, 0.1])
    plan = known_plan(plan_at(missed), atlas)
    assert plan is not None
    away = np.linalg.norm(atlas.pool.points - missed, axis=1)
    assert np.linalg.norm(plan.reference_point - missed) == pytest.approx(away.min(), rel=1e-12)
    first = plan.planes[0].normal
    assert abs(first @ (missed - plan.reference_point)) < 1e-9 * away.min()
    # The contact is known, so that the probe comes from near.
    assert 0.0 < plan.approach < 5.0 * plan.step


def test_a_place_that_faces_as_no_sample_does_is_given_up():
    assert known_plan(plan_at(np.array([0.0, 0.0, -3.0]), -UP), plane([(0, 0)])) is None


def test_an_exploration_begins_where_the_first_contact_is_at_the_edge_of_a_hole():
    """The top of a tube is a ring 6 wide; the probe comes down on its inner edge."""
    tube = trimesh.creation.annulus(9.0, 15.0, 20.0, sections=256)
    obj = MeshObject("tube", tube.vertices, tube.faces)
    noise = 2e-4 * obj.diagonal
    atlas = Atlas(5.0 * noise, scale=5.0 * noise)
    start = np.array([9.0 + noise, 0.0, 10.0])
    planner = Planner(start, UP)
    probe = Probe(obj, noise, np.random.default_rng(0))
    steps = list(explore(atlas, planner, probe, 4))
    assert steps[0].change.refused and len(steps) == 4
    assert len(atlas) > 0


def test_a_probe_that_comes_from_near_meets_a_wall_that_it_would_have_passed():
    """Between two slabs 4 apart an approach from farther than 4 begins inside the other one."""
    low = trimesh.creation.box((40.0, 40.0, 10.0))
    high = low.copy()
    high.apply_translation([0.0, 0.0, 14.0])
    both = trimesh.util.concatenate([low, high])
    obj = MeshObject("slabs", both.vertices, both.faces)
    plan = plan_at(np.array([0.0, 0.0, 5.0]))
    for approach, status in ((8.0, TouchStatus.UNREACHABLE), (2.0, TouchStatus.TOUCHED)):
        touch = Probe(obj, 0.0, np.random.default_rng(0))(replace(plan, approach=approach))
        assert touch.status is status


def test_flat_touches_need_no_move():
    touch = flat_touch(np.zeros(3), UP, ACROSS, 1e-3, np.random.default_rng(0))
    assert beside_plan(plan_at(np.zeros(3)), touch, 3) is None
