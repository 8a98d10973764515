"""A closed atlas against theorems and invariances, on a ball and a torus touched all over."""

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner import Planner, StopReason, explore
from touchatlas.sim import Probe, make_object


@pytest.fixture(scope="module")
def ball():
    return explored("sphere")


@pytest.fixture(scope="module")
def surface(ball):
    return extract_surface(ball.atlas)


def test_patch_graph_of_a_ball_has_euler_characteristic_two(ball):
    atlas = ball.atlas
    assert atlas.euler_characteristic() == 2
    # Every boundary of a closed surface ends in two corners, every corner joins three.
    assert 2 * atlas.graph.number_of_edges() == 3 * len(atlas.corners)
    assert not atlas.gaps and len(atlas.frontier) == 0


def test_patch_graph_of_a_torus_has_euler_characteristic_zero():
    assert explored("torus").atlas.euler_characteristic() == 0


def test_a_refitted_torus_is_closed():
    """Where three radical planes meet along a line that runs beside the surface is no gap."""
    atlas = explored("torus").atlas
    atlas.refit_all()
    assert not atlas.gaps and atlas.closed and atlas.euler_characteristic() == 0


def test_exact_contacts_close_an_atlas_too():
    """Without noise the lack of fit that is accepted is the only small length there is. The surface
    is asked for at the tolerance, so 99 in 100 vertices are within it."""
    obj = make_object("ellipsoid")
    atlas, planner = Atlas(obj.tolerance), Planner(*obj.start())
    for _ in explore(atlas, planner, Probe(obj, 0.0, np.random.default_rng(0)), 400):
        pass
    atlas.finish()
    assert planner.stop.reason is StopReason.KNOWN
    surface = extract_surface(atlas)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight and mesh.euler_number == 2
    off = np.linalg.norm(obj.project(surface.vertices) - surface.vertices, axis=1)
    assert np.quantile(off, 0.99) < obj.tolerance


def test_closed_atlas_of_a_ball_has_total_curvature_four_pi(surface):
    assert surface.total_curvature() == pytest.approx(4 * np.pi, rel=0.02)


def test_surface_of_a_closed_atlas_is_watertight_and_near_the_truth(surface):
    edges = np.sort(surface.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    radii = np.linalg.norm(surface.vertices, axis=1)
    # Vertices are moved off the surface by 0.16 tolerances at most.
    assert np.abs(radii - 33.0).mean() < 0.015
    held = np.mean(np.abs(radii - 33.0) <= 1.96 * surface.deviation)
    assert 0.85 < held <= 1.0
    outward = (surface.normals * surface.vertices).sum(axis=1) / radii
    assert outward.min() > 0.99


@pytest.mark.parametrize("seed", range(2))
def test_touches_in_any_order_give_the_same_surface(ball, seed):
    """Patches depend on the order of the touches, the surface only within its deviations: two
    atlases of the same samples differ by less than 1.96 deviations of one, at 95 %."""
    atlas = Atlas(ball.atlas.tolerance)
    for i in np.random.default_rng(seed).permutation(len(ball.touches)):
        atlas.add(ball.touches[i])
    atlas.validate()
    points, _ = make_object("sphere").sample(2000, np.random.default_rng(seed))
    first, second = ball.atlas.blend(points), atlas.blend(points)
    assert first.known.all() and second.known.mean() > 0.99
    apart = np.abs(first.distance - second.distance)[second.known]
    assert np.quantile(apart / first.deviation[second.known], 0.95) < 1.96


def test_far_points_are_unknown(ball):
    seen = ball.atlas.blend(np.array([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0]]))
    assert not seen.known.any()
    assert np.isnan(seen.distance).all() and (seen.patch == -1).all()


def test_scaling_all_input_scales_the_atlas(ball):
    twice = explored("sphere", scale=2.0)
    assert len(twice.atlas) == len(ball.atlas)
    for i in ball.atlas.graph:
        small, large = ball.atlas.patch(i), twice.atlas.patch(i)
        assert large.frame.origin == pytest.approx(2.0 * small.frame.origin, abs=1e-7)
        assert large.radius == pytest.approx(2.0 * small.radius, rel=1e-9)
