"""Plans: the planes and arms of touches, and explorations that begin or go on at edges."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from tests.flat import plane
from tests.truths import UP
from touchatlas.atlas import Atlas, AtlasChange, Touch, TouchStatus
from touchatlas.patch.geometry.curvature import curvatures_from_sections
from touchatlas.planner import Planner, PlannerOptions, ProbePlan, Reason, explore
from touchatlas.planner.attempts import Attempts, Target
from touchatlas.planner.places import places_of
from touchatlas.planner.plans import concurrent_planes, plan_at
from touchatlas.planner.sources import from_known
from touchatlas.planner.view import View
from touchatlas.sim import Probe
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

Y = np.eye(3)[1]
OPTIONS = PlannerOptions()


def test_planes_contain_the_normal_and_are_sixty_degrees_apart():
    rng = np.random.default_rng(0)
    point, normal = rng.normal(size=3), rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    planes = concurrent_planes(point, normal, rng.normal(size=3), 3)
    for i, one in enumerate(planes):
        assert abs(one.normal @ normal) < 1e-12
        assert abs(one.normal @ planes[i - 1].normal) == pytest.approx(0.5, abs=1e-12)
    angles = np.pi / 3 * np.arange(3)
    assert curvatures_from_sections(np.zeros(3), angles, np.ones(3))[-1] == pytest.approx(2**0.5)


def test_a_closer_plan_has_shorter_arms_and_finer_steps():
    """By the level of the options, each time."""
    atlas, top = explored("sphere").atlas, np.array([0.0, 0.0, 33.0])
    plans = [plan_at(atlas, Target(top, UP, Reason.EXPAND, closer=k), OPTIONS) for k in range(3)]
    for plan, next_ in zip(plans, plans[1:], strict=False):
        assert next_.reach == pytest.approx(OPTIONS.levels.closer * plan.reach, rel=1e-12)
        assert next_.step == pytest.approx(OPTIONS.levels.closer * plan.step, rel=1e-12)
    assert plans[0].reach == pytest.approx(OPTIONS.reach * atlas.pool.extent, rel=1e-12)


def test_arms_of_a_first_touch_may_turn_farther_the_second_time_closer():
    """The contact may be on a sharp edge."""
    target = [Target(np.zeros(3), UP, Reason.START, closer=k) for k in range(3)]
    turns = [plan_at(Atlas(0.1), one, OPTIONS).max_turn for one in target]
    assert turns == [np.pi / 4.0, np.pi / 4.0, OPTIONS.max_turn]


def test_arms_that_verify_run_on_over_what_is_known():
    """A contour must cross the rim of a hole to show it."""
    atlas, top = explored("sphere").atlas, np.array([0.0, 0.0, 33.0])
    ends = {r: plan_at(atlas, Target(top, UP, r), OPTIONS).until is not None for r in Reason}
    assert [reason for reason in Reason if ends[reason]] == [Reason.EXPAND, Reason.REFINE]


def sought(atlas: Atlas, missed: Target) -> Target | None:
    """The target at what is known, after an approach to another one met nothing."""
    attempts = Attempts(np.zeros(3), UP)
    attempts.ask(missed, plan_at(atlas, missed, OPTIONS), 1.0)
    point, normal = missed.point, missed.normal
    touch = Touch(0, point, normal, (), TouchStatus.NO_CONTACT, 0.0, 1.0)
    attempts.answer(touch, AtlasChange(refused="the probe reported: no contact", touch=0))
    # A touch that verifies does not count where touches are asked whether they add something.
    assert attempts.learned == (missed.reason is not Reason.VERIFY)
    return from_known(View(atlas, OPTIONS, attempts), places_of(Atlas(0.1)))


@pytest.mark.parametrize("reason", [Reason.EXPAND, Reason.VERIFY])
def test_a_place_that_was_missed_is_sought_from_the_nearest_sample(reason):
    """Its first plane holds the sample and the place, so that a contour runs from one to the
    other: over the rim of a hole, if the probe fell into one. It is sought once."""
    atlas = plane([(0, 0), (1, 0)])
    missed = Target(np.array([4.0, 0.3, 0.1]), UP, reason)
    target = sought(atlas, missed)
    away = np.linalg.norm(atlas.pool.points - missed.point, axis=1)
    assert np.linalg.norm(target.point - missed.point) == pytest.approx(away.min(), rel=1e-12)
    plan = plan_at(atlas, target, OPTIONS)
    assert abs(plan.planes[0].normal @ (missed.point - target.point)) < 1e-9 * away.min()
    # The contact is known, so that the probe comes from near.
    assert 0.0 < plan.approach < 5.0 * plan.step
    assert target.reason is reason and target.place.tolist() == missed.point.tolist()
    assert not target.may_miss


def test_a_place_that_faces_as_no_sample_does_is_given_up():
    missed = Target(np.array([0.0, 0.0, -3.0]), -UP, Reason.EXPAND)
    assert sought(plane([(0, 0)]), missed) is None


def test_an_exploration_begins_where_the_first_contact_is_at_the_edge_of_a_hole():
    """The top of a tube is a ring 6 wide; the probe comes down on its inner edge."""
    tube = trimesh.creation.annulus(9.0, 15.0, 20.0, sections=256)
    obj = MeshObject("tube", tube.vertices, tube.faces)
    noise = 2e-4 * obj.diagonal
    atlas = Atlas(5.0 * noise, scale=5.0 * noise)
    start = np.array([9.0 + noise, 0.0, 10.0])
    planner = Planner(start, UP)
    probe = Probe(obj, noise, np.random.default_rng(0))
    steps = list(explore(atlas, planner, probe, 2))
    assert len(steps) == 2 and len(atlas) > 0


def test_a_probe_that_comes_from_near_meets_a_wall_that_it_would_have_passed():
    """Between two slabs 4 apart an approach from farther than 4 begins inside the other one."""
    low = trimesh.creation.box((40.0, 40.0, 10.0))
    high = low.copy()
    high.apply_translation([0.0, 0.0, 14.0])
    both = trimesh.util.concatenate([low, high])
    obj = MeshObject("slabs", both.vertices, both.faces)
    point = np.array([0.0, 0.0, 5.0])
    planes = concurrent_planes(point, UP, Y, 3)
    plan = ProbePlan(0, point, UP, planes, 10.0, 0.5, 2.0, Reason.EXPAND)
    for approach, status in ((8.0, TouchStatus.UNREACHABLE), (2.0, TouchStatus.TOUCHED)):
        touch = Probe(obj, 0.0, np.random.default_rng(0))(replace(plan, approach=approach))
        assert touch.status is status


def test_a_wedge_is_explored_from_above_its_edge():
    """The first contact is on an edge of 20 degrees, whose sides fall by 80."""
    profile = 60.0 * np.array([[0.0, 0.0], [1.0, -0.176], [1.0, 0.176]])
    mesh = trimesh.creation.extrude_triangulation(profile, [[0, 1, 2]], height=40.0)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2.0, Y))
    wedge = MeshObject("wedge", mesh.vertices, mesh.faces)
    atlas, planner = Atlas(wedge.tolerance), Planner(*wedge.start())
    probe = Probe(wedge, wedge.noise_std, np.random.default_rng(0))
    for _ in explore(atlas, planner, probe, 8):
        pass
    assert atlas.touches >= 4


@pytest.mark.slow
def test_the_far_side_of_a_thin_disc_is_touched():
    """Its rim has a radius of 0.27 where steps are 1.7 long; arms that begin on one side end before
    it. Touched from there alone, the far side is not met in 60 touches."""
    axes = (60.0, 50.0, 4.0)
    disc = ImplicitObject("disc", "", quadric_with_bumps(axes), axes, 0.02, 3.0)
    atlas, planner = Atlas(3.0, scale=0.1), Planner(*disc.start())
    for _ in explore(atlas, planner, Probe(disc, 0.02, np.random.default_rng(0)), 30):
        pass
    heights = atlas.pool.points[:, 2]
    assert heights.max() > 3.0 and heights.min() < -3.0
