"""The surface: marching cubes, curved triangles, the frontier, thin slabs."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.extract import extract_surface, mean_height
from touchatlas.atlas.mesh.marching_cubes import CORNERS, ends_of, key, triangles, unkey
from touchatlas.atlas.mesh.pn_triangles import Subdivision
from touchatlas.atlas.mesh.resolution import cube_edge, gaps_of, patch_resolution, resolution
from touchatlas.atlas.mesh.trim import rim as bare
from touchatlas.atlas.mesh.trim import supported
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.planner.planes import concurrent_planes
from touchatlas.sim.study.surface_peers import distances
from touchatlas.sim.world.objects import make_object


def boundary_edges(faces) -> np.ndarray:
    """(e, 2) edges of one triangle alone; no edge may be of three."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    once, counts = np.unique(edges, axis=0, return_counts=True)
    assert counts.max() <= 2
    return once[counts == 1]


@pytest.mark.parametrize("seed", range(3))
def test_marching_cubes_close_any_signs(seed):
    """Even random sides of the corners are parted by a closed surface that faces out."""
    count = 12
    values = np.random.default_rng(seed).normal(size=(count,) * 3)
    for axis in range(3):
        values[(slice(None),) * axis + ([0, -1],)] = 1.0
    cubes = np.indices((count - 1,) * 3).reshape(3, -1).T
    inside = values[tuple(np.moveaxis(cubes[:, None] + CORNERS, -1, 0))] < 0.0
    edges, faces = np.unique(triangles(key(cubes - 5), inside), return_inverse=True)
    low, high = ends_of(edges)
    mesh = trimesh.Trimesh(0.5 * (unkey(low) + unkey(high)), faces.reshape(-1, 3), process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    # Halfway between the sides: about as much volume as corners inside.
    assert mesh.volume == pytest.approx((values < 0.0).sum(), rel=0.3)


def test_cubes_too_far_to_be_numbered_are_refused():
    with pytest.raises(ValueError, match="longer edge"):
        key(np.array([[1 << 20, 0, 0]]))


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_curved_triangles_fit_their_neighbours(count):
    coarse = trimesh.creation.icosphere(subdivisions=1)
    vertices, faces = np.array(coarse.vertices), np.array(coarse.faces)
    cut = Subdivision(len(vertices), faces, count)
    points = cut.points(vertices, vertices)
    fine = trimesh.Trimesh(points, cut.faces(), process=False)
    assert fine.is_watertight and fine.is_winding_consistent and fine.euler_number == 2
    assert len(fine.faces) == count**2 * len(faces) and len(points) == len(cut.linear(vertices))
    new = np.arange(len(vertices), len(points))
    distance = np.linalg.norm(points[new, None] - vertices[cut.parents(new)], axis=2)
    assert (
        distance.max(initial=0.0) <= np.linalg.norm(np.diff(coarse.triangles, axis=1), axis=2).max()
    )


def test_labels_are_shared_where_all_old_vertices_have_them():
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    cut = Subdivision(4, faces, 4)
    labels = np.array([5, 5, 5, 7])
    new = np.arange(4, len(cut.linear(labels)))
    around = labels[cut.parents(new)]
    expected = np.where((around == around[:, :1]).all(axis=1), around[:, 0], -1)
    assert cut.shared(labels)[:4].tolist() == labels.tolist()
    assert (cut.shared(labels)[4:] == expected).all() and set(expected.tolist()) == {5, -1}


def test_curved_triangles_are_of_fourth_order():
    """Half the edges leave a sixteenth of the error, on an ellipsoid of three axes."""
    axes, errors = np.array([1.0, 0.7, 0.5]), []
    for level in (2, 3, 4):
        coarse = trimesh.creation.icosphere(subdivisions=level)
        vertices = np.array(coarse.vertices) * axes
        normals = vertices / axes**2
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        cut = Subdivision(len(vertices), np.array(coarse.faces), 4)
        points = cut.points(vertices, normals)
        level_set = ((points / axes) ** 2).sum(axis=1) - 1.0
        errors.append(np.abs(level_set / np.linalg.norm(2.0 * points / axes**2, axis=1)).mean())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.7).all()


@pytest.mark.parametrize("count", [1, 3])
def test_triangles_moved_out_by_their_mean_height_lie_about_the_surface(count):
    """About an ellipsoid, whose inscribed triangles all lie inside: the mean is left with the
    fourth order of their size, of which the heights themselves are the second."""
    axes = np.array([1.0, 0.7, 0.5])
    coarse = trimesh.creation.icosphere(subdivisions=4)
    vertices = np.array(coarse.vertices) * axes
    normals = vertices / axes**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    cut = Subdivision(len(vertices), np.array(coarse.faces), count)
    heights = mean_height(cut.edges, vertices, normals, count)
    directions = cut.linear(normals)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points, volume = cut.points(vertices, normals), np.pi * 4.0 / 3.0 * axes.prod()
    flat, moved = (
        trimesh.Trimesh(p, cut.faces(), process=False).volume / volume - 1.0
        for p in (points, points + cut.linear(heights)[:, None] * directions)
    )
    assert flat < 0.0 and abs(moved) < 0.02 * abs(flat)


def sheet_gaps(atlas) -> np.ndarray:
    """(m,) distances between sheets that turn their backs to each other."""
    return gaps_of(atlas.field, atlas.surface_graph.outlines, atlas.table.rows)


@pytest.fixture(scope="module")
def half():
    return explored("torus", max_touches=60)


def test_surface_is_open_at_the_frontier_and_nowhere_else(half):
    atlas = half.atlas
    surface, edge = extract_surface(atlas), resolution(atlas, sheet_gaps(atlas))
    rim = boundary_edges(surface.faces)
    seen = atlas.blend(surface.vertices)
    assert len(rim) and seen.known.all()
    # The vertices are on the zero set, up to what the curved triangles err: less than the
    # sagitta. At the rim they hang on to corners that a single patch holds, beyond its core.
    off = np.abs(seen.distance) / atlas.tolerance
    assert np.quantile(off, 0.95) < 0.02 and np.quantile(off, 0.999) < 1.0 and off.max() < 3.0
    # Amid others, patches may be three times as unsure as at the rim.
    at_rim = np.isin(surface.patch, bare(atlas))
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
    """More trust, more surface, and the same one; without end, all that patches reach."""
    atlas, areas = deepcopy(half.atlas), []
    for trust in (0.1, 0.3, np.inf):
        atlas.options = replace(atlas.options, trust=trust)
        surface = extract_surface(atlas)
        at_rim = np.isin(surface.patch, bare(atlas))
        assert surface.deviation[at_rim].max() <= trust * atlas.tolerance
        assert surface.deviation.max() <= 3.0 * trust * atlas.tolerance
        areas.append(trimesh.Trimesh(surface.vertices, surface.faces, process=False).area)
    assert areas[0] < areas[1] < areas[2]


def slab(thickness: float, rng, turn=None) -> Atlas:
    """Both sides of a flat slab, touched on a square, without its rim; turned by a matrix."""
    atlas = Atlas(0.05)
    for touch in slab_touches(thickness, rng, np.eye(3) if turn is None else turn):
        atlas.add(touch)
    return atlas


def slab_touches(thickness: float, rng, turn):
    """Touches in turn on the one side of a slab and on the other."""
    along = np.linspace(-1.0, 1.0, 15)
    for x, y in np.stack(np.meshgrid([-0.9, 0.0, 0.9], [-0.9, 0.0, 0.9]), -1).reshape(-1, 2):
        for side in (1.0, -1.0):
            contact = turn @ np.array([x, y, 0.5 * side * thickness])
            normal, contours = turn @ np.array([0.0, 0.0, side]), []
            for plane in concurrent_planes(contact, normal, turn[:, 0], 3):
                points = contact + along[:, None] * np.cross(plane.normal, normal)
                points += 1e-3 * rng.normal(size=points.shape)
                ends = (ContourEnd.LENGTH_REACHED,) * 2
                contours.append(Contour(points, plane, 1e-3, ends))
            touched = (TouchStatus.TOUCHED, 6.0, 0.0)
            yield Touch(0, contact, normal, tuple(contours), *touched)


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
    """However thin it is against the edge that its flat patches bear, 0.37, each side is one disc:
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
    gaps = sheet_gaps(half.atlas)
    assert resolution(half.atlas, gaps) == patch_resolution(half.atlas)
