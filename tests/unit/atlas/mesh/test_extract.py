"""The surface of an open atlas and of thin slabs: where it ends, and that sheets stay apart."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from tests.flat import slab
from touchatlas.atlas import extract_surface
from touchatlas.atlas.mesh.extract import _faces_outward, open_surface
from touchatlas.atlas.mesh.resolution import cube_edge, gaps_of, patch_resolution, resolution
from touchatlas.atlas.mesh.trim import rim, supported
from touchatlas.sim import make_object
from touchatlas.sim.study.surface_peers import distances


def boundary_edges(faces) -> np.ndarray:
    """(e, 2) edges of one triangle alone; no edge may be of three."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    once, counts = np.unique(edges, axis=0, return_counts=True)
    assert counts.max() <= 2
    return once[counts == 1]


def sheet_gaps(atlas) -> np.ndarray:
    """(m,) distances between sheets that face away from each other."""
    return gaps_of(atlas.field, atlas.surface_graph.outlines, atlas.table.rows)


@pytest.fixture(scope="module")
def half():
    return explored("torus", max_touches=60).atlas


def test_surface_is_open_at_the_frontier_and_nowhere_else(half):
    atlas = half
    surface, edge = open_surface(atlas), resolution(atlas, sheet_gaps(atlas))
    border = boundary_edges(surface.faces)
    seen = atlas.blend(surface.vertices)
    # A vertex that its patch clearly covers is not asked again: at the end of a cell it may be out.
    assert len(border) and seen.known.mean() > 0.999
    surface = surface.only(seen.known)
    seen = atlas.blend(surface.vertices)
    # Vertices are moved out by the mean height of the surface over their edges, 0.16 tolerances at
    # most. At the rim vertices are extrapolated as far as the atlas trusts: to a
    # deviation of one tolerance, which one in a thousand may exceed, and none threefold.
    off = np.abs(seen.distance) / atlas.tolerance
    assert np.quantile(off, 0.9) < 0.15 and np.quantile(off, 0.999) < 1.0 and off.max() < 3.0
    # Away from the rim the deviation may be three times as large as at it.
    at_rim = np.isin(surface.patch, rim(atlas))
    assert surface.deviation[at_rim].max() <= atlas.tolerance
    assert surface.deviation.max() <= 3.0 * atlas.tolerance
    # And all that is known of the torus is there, up to the edge of a triangle at the rim.
    points, _ = make_object("torus").sample(5000, np.random.default_rng(0))
    on = atlas.blend(points)
    feet = (points - on.distance[:, None] * on.normal)[on.known]
    there = atlas.blend(feet)
    feet, patch, deviation = (x[there.known] for x in (feet, there.patch, there.deviation))
    feet = feet[supported(atlas, patch, feet, deviation)]
    missed = distances(surface.vertices, surface.faces, feet)
    assert missed.max() < 2.0 * edge and np.quantile(missed, 0.98) < 0.5 * edge


def test_surface_is_drawn_as_far_as_it_is_trusted(half):
    """More trust, more surface, and the same one; without end, all that patches reach. Triangles
    add the height by which their vertices are moved, 0.16 tolerances at most, to the deviation."""
    atlas, areas = explored("torus", max_touches=60).atlas, []
    for trust in (0.1, 0.3, np.inf):
        atlas.options = replace(atlas.options, trust=trust)
        surface = open_surface(atlas)
        at_rim = np.isin(surface.patch, rim(atlas))
        trusted, facets = trust * atlas.tolerance, 0.2 * atlas.tolerance
        assert surface.deviation[at_rim].max() <= np.hypot(trusted, facets)
        assert surface.deviation.max() <= np.hypot(3.0 * trusted, facets)
        areas.append(trimesh.Trimesh(surface.vertices, surface.faces, process=False).area)
    assert areas[0] < areas[1] < areas[2]


@pytest.mark.parametrize("thickness", [0.1, 0.2, 0.4])
def test_two_sides_of_a_thin_slab_stay_two_sheets(thickness):
    atlas = slab(thickness, np.random.default_rng(0))
    edge = 0.5 * thickness
    # The noise of a flat patch, a few at most.
    gaps = sheet_gaps(atlas)
    assert len(gaps) and gaps == pytest.approx(thickness, abs=5e-3)
    assert edge <= cube_edge(atlas.field, edge, gaps) <= gaps.min()
    surface = extract_surface(atlas, edge)
    up = surface.vertices[:, 2] > 0.0
    assert np.abs(surface.vertices[:, 2]) == pytest.approx(0.5 * thickness, abs=5e-3)
    assert (surface.normals[up, 2] > 0.9).all() and (surface.normals[~up, 2] < -0.9).all()
    assert up[surface.faces].all(axis=1).sum() == pytest.approx(
        (~up)[surface.faces].all(axis=1).sum(), rel=0.1
    )
    assert not (up[surface.faces].any(axis=1) & ~up[surface.faces].all(axis=1)).any()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("thickness", [0.05, 0.15, 0.3, 0.6])
def test_thin_slabs_have_two_whole_sides(thickness, turned):
    """However thin it is against the edge of flat patches, 0.37, each side is one disc:
    V - E + F = 1, as large as that of a slab twice as thick as the edge."""
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] if turned else np.eye(3)
    surface = extract_surface(slab(thickness, rng, turn))
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    sides = mesh.split(only_watertight=False)
    assert [side.euler_number for side in sides] == [1, 1]
    whole = extract_surface(slab(0.8, rng, turn), 0.2)
    area = trimesh.Trimesh(whole.vertices, whole.faces, process=False).area
    # A rim of less than one edge is left out, 0.2 of 2 x 14 along both rims at most.
    assert mesh.area == pytest.approx(area, abs=5.6)


def test_resolution_is_that_of_the_patches_where_no_sheets_are_near(half):
    gaps = sheet_gaps(half)
    assert resolution(half, gaps) == patch_resolution(half)


def test_a_triangle_faces_as_one_of_the_patches_at_its_corners():
    """A right angle from the x axis, tilted toward it by 25 and by 15 degrees, and turned over."""
    lean = np.deg2rad([25.0, 15.0])
    points = np.array([[0, 0, 0], [1, 0, 0], [0, np.sin(lean[0]), np.cos(lean[0])]])
    steeper = np.array([[0, 0, 0], [1, 0, 0], [0, np.sin(lean[1]), np.cos(lean[1])]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    for corners, expected in ((points, True), (steeper, False)):
        # The normal of (0, 1, 2) is (0, -cos, sin) of the lean.
        assert _faces_outward(np.array([[0, 1, 2]]), corners, up).tolist() == [expected]
        assert _faces_outward(np.array([[0, 2, 1]]), corners, up).tolist() == [False]
    one = np.array([[0.0, 0, 1], [0, 0, 1], [0, -1, 0]])
    assert _faces_outward(np.array([[0, 1, 2]]), steeper, one).all()
