"""Refining: triangles stay a closed surface, come within the bound, and lie about the surface."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from touchatlas.atlas import extract_surface
from touchatlas.atlas.mesh.coarse_mesh import Vertices
from touchatlas.atlas.mesh.refine import edges_of, split, vertex_heights

AXES = np.array([1.0, 0.7, 0.5])


def with_middles(points, faces, chosen):
    """A mesh, some edges of which are cut in their middles."""
    ends, sides = edges_of(faces)
    middle = np.where(chosen, len(points) + np.cumsum(chosen) - 1, -1)
    every = np.concatenate([points, points[ends[chosen]].mean(axis=1)])
    return trimesh.Trimesh(every, split(faces, middle[sides], every), process=False)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
def test_any_edges_may_be_halved(share):
    """The same body: closed, of one side, with the volume and the area that it had."""
    before = trimesh.creation.icosphere(subdivisions=2)
    points, faces = np.array(before.vertices), np.array(before.faces)
    chosen = np.random.default_rng(0).random(len(edges_of(faces)[0])) < share
    after = with_middles(points, faces, chosen)
    assert after.is_watertight and after.is_winding_consistent and after.euler_number == 2
    # Each cut edge adds a triangle on both sides.
    assert len(after.faces) == len(faces) + 2 * chosen.sum()
    assert after.volume == pytest.approx(before.volume, rel=1e-12)
    assert after.area == pytest.approx(before.area, rel=1e-12)


def test_triangles_moved_out_by_their_mean_height_lie_about_the_surface():
    """About an ellipsoid, whose inscribed triangles all lie inside: the mean is left with the
    fourth order of their size, of which the heights themselves are the second."""
    coarse = trimesh.creation.icosphere(subdivisions=4)
    points, faces = np.array(coarse.vertices) * AXES, np.array(coarse.faces)
    normals = points / AXES**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    zero, whole = np.zeros(len(points)), np.ones(len(points), bool)
    vertices = Vertices(points, normals, zero, zero, zero.astype(int), whole)
    heights = vertex_heights(vertices, edges_of(faces)[0], np.inf)
    volume = np.pi * 4.0 / 3.0 * AXES.prod()
    flat, moved = (
        trimesh.Trimesh(p, faces, process=False).volume / volume - 1.0
        for p in (points, points + heights[:, None] * normals)
    )
    assert flat < 0.0 and abs(moved) < 0.02 * abs(flat)


def off_the_blend(atlas, surface):
    """Distances of vertices, middles of sides, centres and 3,000 random points of triangles from
    the patches' surface, in tolerances."""
    a, b, c = (surface.vertices[corner] for corner in surface.faces.T)
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 3000)
    some = np.arange(3000) * len(a) // 3000
    points = [surface.vertices, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3]
    points.append(np.einsum("nk,knd->nd", weights, np.stack([a[some], b[some], c[some]])))
    return np.abs(atlas.blend(np.concatenate(points)).distance) / atlas.tolerance


@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_triangles_are_as_near_to_the_patches_as_the_option_says(name):
    """And a quarter of the distance takes three to six times the triangles: their number goes with
    one over the distance, and edges are halved, so that it goes in steps."""
    atlas, counts = explored(name).atlas, []
    for facets in (0.2, 0.05):
        atlas.options = replace(atlas.options, facets=facets)
        surface = extract_surface(atlas)
        off = off_the_blend(atlas, surface)
        # Where patches disagree between the places that are asked, one in a thousand is farther.
        assert np.quantile(off, 0.999) < facets and off.max() < 1.5 * facets
        mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
        assert mesh.is_watertight and mesh.euler_number == (2 if name == "sphere" else 0)
        counts.append(len(surface.faces))
    assert 3.0 < counts[1] / counts[0] < 6.0


def test_the_surface_is_of_the_size_of_the_object():
    """The same ball in another unit has the same triangles, scaled."""
    one, other = explored("sphere").atlas, explored("sphere", 1000.0).atlas
    first, second = extract_surface(one), extract_surface(other)
    assert len(first.faces) == pytest.approx(len(second.faces), rel=0.02)
    areas = [trimesh.Trimesh(s.vertices, s.faces, process=False).area for s in (first, second)]
    assert areas[1] == pytest.approx(1e6 * areas[0], rel=1e-4)


def test_the_same_atlas_gives_the_same_triangles():
    surfaces = [extract_surface(explored("sphere").atlas) for _ in range(2)]
    for name in ("vertices", "faces", "normals", "deviation", "patch"):
        assert getattr(surfaces[0], name).tobytes() == getattr(surfaces[1], name).tobytes()


def test_vertices_hold_the_field_of_their_place():
    """Normals within half a degree and deviations within a tenth of what the field says there; the
    deviation also counts how far the vertex was moved."""
    atlas = explored("sphere").atlas
    surface = extract_surface(atlas)
    seen = atlas.blend(surface.vertices)
    turn = np.einsum("ij,ij->i", surface.normals, seen.normal)
    assert np.quantile(turn, 0.01) > np.cos(np.deg2rad(0.5))
    moved = np.sqrt(np.maximum(surface.deviation**2 - seen.deviation**2, 0.0))
    assert np.quantile(moved, 0.99) < 0.25 * atlas.tolerance
    assert (surface.patch == seen.patch).mean() > 0.95
