"""Plans of further attempts: closer, beside an edge, and across a side of it."""

import numpy as np
import pytest
import trimesh

from tests.flat import UP
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import Planner, ProbePlan, Reason, explore
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.plans import across_plan, closer_plan
from touchatlas.sim import Probe
from touchatlas.sim.world.mesh_object import MeshObject

ENDS = (ContourEnd.LENGTH_REACHED,) * 2
X, Y = np.eye(3)[:2]


def from_above() -> ProbePlan:
    """A plan at the origin with short turns."""
    planes = concurrent_planes(np.zeros(3), UP, X, 3)
    return ProbePlan(0, np.zeros(3), UP, planes, 1.0, 0.1, np.pi / 4.0, Reason.START)


def touched(*headings) -> Touch:
    """A touch of straight contours of length 1 that begin at the origin."""
    contours = []
    for heading in headings:
        across = np.cross(heading, Y) if abs(heading @ Y) < 0.9 else X
        points = np.linspace(0.0, 1.0, 11)[:, None] * heading
        contours.append(Contour(points, SamplingPlane(np.zeros(3), across), 1e-4, ENDS))
    return Touch(0, np.zeros(3), UP, tuple(contours), TouchStatus.TOUCHED, 1.0, 0.0)


def test_a_closer_plan_has_finer_steps_and_the_turn_that_it_is_given():
    closer = closer_plan(from_above(), 4, 2.0)
    assert closer.max_turn == 2.0 and len(closer.planes) == 4
    assert closer.reach < 1.0 and closer.step < 0.1


def test_a_side_along_which_the_probe_came_is_approached_across():
    """It falls by 80 degrees. The plan is in its middle, along the normal that looks up."""
    fall = np.deg2rad(80.0)
    heading = np.array([np.cos(fall), 0.0, -np.sin(fall)])
    plan = across_plan(from_above(), touched(Y, heading), 3)
    assert plan.normal == pytest.approx([np.sin(fall), 0.0, np.cos(fall)])
    assert plan.reference_point == pytest.approx(0.5 * heading)
    assert len(plan.planes) == 3
    assert all(abs(plane.normal @ plan.normal) < 1e-12 for plane in plan.planes)


def test_no_side_is_approached_across_where_arcs_face_the_probe_or_run_straight_along():
    """Of an arc right along the approach it is not known which side is outside."""
    assert across_plan(from_above(), touched(X, Y), 3) is None
    assert across_plan(from_above(), touched(-UP), 3) is None


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
