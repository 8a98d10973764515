"""Edges and corners that a ball tip touched: sharp where they are sharp, closed where it did not
enter."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipped import TipProbe, explored
from tests.truths import UP
from touchatlas.atlas import Atlas, doubts, extract_surface
from touchatlas.atlas.check.tip_doubts import closed_corners
from touchatlas.atlas.edges.blunt_edges import BluntEdge
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import CurvePoints
from touchatlas.atlas.faces.join_faces import face_edge
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes

TIP = 2.0
SIDE = np.array([1.0, 0.0, 0.0])
# Contacts on the slab beside the block, on its wall, and their normals.
PLACES = ((30, 0, 10), UP), ((28, 14, 10), UP), ((20, -10, 18), SIDE)


@pytest.fixture(scope="module")
def step():
    """An atlas of centres about the concave corner of a step, at x = 20 and z = 10."""
    probe, atlas = TipProbe("step", TIP), Atlas(1.0)
    for number, (place, normal) in enumerate(PLACES):
        point = np.array(place) + TIP * normal
        planes = concurrent_planes(point, normal, SIDE + UP - normal, 3)
        own = number, point, normal, planes, 25.0, 1.5, np.pi, Reason.REFINE
        atlas.add(probe(ProbePlan(*own, step_turn=0.26)))
    return atlas


def test_a_corner_that_the_ball_did_not_enter_is_said_with_its_place(step):
    """A right angle is r (sqrt 2 - 1) deeper than the ball in it, which touches both faces at r
    from the corner: half-way between is (r/2, r/2)."""
    places, depths = closed_corners(step)
    assert len(places) >= 3
    assert np.allclose(places[:, [0, 2]], (20.0 + TIP / 2, 10.0 + TIP / 2), atol=0.2)
    assert np.allclose(depths, TIP * (np.sqrt(2.0) - 1.0), atol=0.02)
    alike = Atlas(1.0)
    alike.pool = step.without_tip.pool
    assert np.allclose(closed_corners(alike)[1], depths, atol=0.1)
    [doubt] = [one for one in doubts(step) if one.name == "closed corners"]
    assert "deeper than the ball" in doubt.words and len(doubt.places)


def test_a_corner_that_the_ball_did_not_enter_is_closed_by_it(step):
    """Any fillet from 0 to r is as likely: its surface is off that of the ball by up to the depth,
    by the depth over sqrt 3 in the root mean square."""
    depth = TIP * (np.sqrt(2.0) - 1.0)
    found = step.blend([[20.0, 0.0, 10.0], [24.0, 0.0, 10.0]])
    assert found.distance == pytest.approx([-depth, 0.0], abs=0.02)
    assert depth / np.sqrt(3.0) < 1.2 * found.deviation[0] < 2.0 * depth
    assert found.deviation[1] < 0.02


@pytest.mark.parametrize(
    ("kind", "radius"), [(EdgeKind.SHARP_CONVEX, TIP), (EdgeKind.SHARP_CONCAVE, 0.0)]
)
def test_no_convex_edge_of_centres_is_sharper_than_the_tip(kind, radius):
    """Even where no contour shows its rounding; a crease of the centres is sharp."""
    line = CurvePoints(np.linspace(0.0, 10.0, 11)[:, None] * UP, np.full(11, 0.01))
    boundary = Boundary(0, 1, kind, line, np.pi / 2, 0.0)
    edge = face_edge(0, 1, [boundary], 1.0, TIP)
    assert (edge.radius, edge.radius_std) == (radius, 0.0)
    assert face_edge(0, 1, [boundary], 1.0).radius == 0.0


@pytest.mark.parametrize(
    ("measured", "radius"), [(TIP + 0.03, TIP), (TIP - 0.03, TIP), (3.0, 3.0), (1.9, 1.9)]
)
def test_a_rounding_that_may_be_that_of_the_tip_is(measured, radius):
    """Within four deviations of 0.01; else the edge itself is rounded, or the radius is wrong."""
    line = CurvePoints(np.linspace(0.0, 10.0, 11)[:, None] * UP, np.full(11, 0.01))
    none = np.zeros(0, int)
    blunt = BluntEdge(0, 1, 1.0, measured, 0.01, none, np.zeros((0, 3)))
    boundary = Boundary(0, 1, EdgeKind.SHARP_CONVEX, line, np.pi / 2, 0.0, blunt)
    assert face_edge(0, 1, [boundary], 1.0, TIP).radius == pytest.approx(radius)


@pytest.mark.slow
def test_a_radius_that_is_too_large_for_the_edges_is_named():
    """No ball of 1.2 makes edges of 1.04."""
    atlas, _ = explored(TipProbe("cube", 1.04, stated=1.2), 1.04)
    [doubt] = [one for one in doubts(atlas, extract_surface(atlas)) if one.name == "tip radius"]
    assert "measure the tip" in doubt.words and len(doubt.places)


@pytest.mark.slow
def test_a_cube_touched_by_a_ball_is_met_with_sharp_edges():
    atlas, planner = explored(TipProbe("cube", 1.04), 1.04)
    assert planner.stop.reason.value == "known to the tolerance"
    faces = atlas.faces()
    sharp = [edge for edge in faces.edges if edge.kind.sharp]
    assert len(faces) == 6 and len(sharp) == 12 and not any(edge.radius for edge in sharp)
    corners = 30.0 * np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    found = atlas.blend(corners)
    assert np.nanmax(np.abs(found.distance)) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("are_contacts", [False, True])
def test_centres_and_contacts_with_normals_show_one_ring(are_contacts):
    """The torus of 40 and 15 by its law: 95 of 100 errors are within the deviations, but for one
    standard deviation of such a share in ten independent places."""
    probe = TipProbe("ring", 1.5, are_contacts=are_contacts)
    atlas, planner = explored(probe, 1.3)
    assert planner.stop.reason.value == "known to the tolerance"
    surface = extract_surface(atlas)
    points = surface.vertices
    about = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 40.0, points[:, 2]) - 15.0
    assert np.quantile(np.abs(about), 0.95) < 0.5 * 1.3
    off = np.abs(atlas.blend(points).distance - about)
    assert np.nanmean(off < 1.96 * surface.deviation) > 0.88


@pytest.mark.parametrize("sides", [[0, 1, 1, 1], [0, 0, 1, 1], [0, 0, 0, 1]])
def test_centres_about_a_convex_edge_close_no_corner(sides):
    """On the quarter of a circle about an edge they move along the turn of the normals, wherever
    they are taken for those of the other side."""
    angle = np.array([0.1, 0.4, 0.9, 1.4])
    centres = TIP * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    normals = np.where(np.array(sides)[:, None] == 1, SIDE, UP)
    pool, none = SamplePool(), np.zeros(4)
    pool.add(centres - TIP * normals, normals, normals[::-1], none > 0, none + 1e-3, none, True)
    known = {"tip_radius": TIP, "levels": Levels(), "sample_std": 0.01, "systematic_std": 0.0}
    atlas = SimpleNamespace(without_tip=SimpleNamespace(pool=pool), **known)
    assert not len(closed_corners(atlas)[0])
