"""Bodies with edges: one patch a face, their graph, their distance, and their sharp triangles."""

from functools import lru_cache

import numpy as np
import pytest

from tests.sharp import explored_sharp, sharp_object
from touchatlas.atlas import extract_surface

NOISE = 0.02
# Faces, edges and corners of convex bodies, counted by hand.
CONVEX = {"block": (6, 12, 8), "roof": (7, 15, 10), "wall": (6, 12, 8)}


@lru_cache
def simplified(name: str, noise: float = NOISE, seed: int = 0):
    atlas = explored_sharp(name, noise, seed=seed).atlas
    atlas.refit_all()
    atlas.simplify()
    return atlas


@lru_cache
def surface(name: str, noise: float = NOISE):
    return extract_surface(simplified(name, noise))


def edges_of(faces):
    pairs = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    return np.unique(pairs, axis=0, return_counts=True)


@pytest.mark.parametrize("name", CONVEX)
def test_every_face_of_a_convex_body_is_one_patch(name):
    """Its graph is the body's own: faces, edges, corners; V - E + F = 2."""
    atlas = simplified(name)
    faces, edges, corners = CONVEX[name]
    assert (len(atlas), atlas.graph.number_of_edges()) == (faces, edges)
    # Where a core does not reach into the corner of its face, that is a gap.
    assert len(atlas.corners) + len(atlas.gaps) == corners
    assert faces - edges + corners == 2 and atlas.outlines_closed() == 1.0
    atlas.validate()


def test_merged_cube_is_closed_and_of_euler_characteristic_two():
    assert simplified("block").closed and simplified("block").euler_characteristic() == 2


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in (1, 2, 5))])
def test_faces_with_a_notch_are_one_patch_each(seed):
    """In whatever order touches came and merges were refused."""
    atlas = simplified("step", seed=seed)
    assert len(atlas) == 8
    edges = [data["boundary"] for *_, data in atlas.graph.edges(data=True)]
    assert len(edges) == 18 and all(edge.crease for edge in edges)
    # The concave one is the line x = 0, z = 0.
    concave = [e for e in edges if np.abs(e.points[:, [0, 2]]).max(initial=0.0) < 5 * NOISE]
    assert len(concave) == 1


@pytest.mark.parametrize("noise", [0.0, NOISE])
@pytest.mark.parametrize("name", ["block", "wall", "step"])
def test_surface_of_a_body_with_edges_is_closed_and_near_the_truth(name, noise):
    made = surface(name, noise)
    pairs, counts = edges_of(made.faces)
    assert (counts == 2).all()
    assert len(np.unique(made.faces)) - len(pairs) + len(made.faces) == 2
    off = np.abs(sharp_object(name).value(made.vertices))
    # A plane through hundreds of samples errs by less than one of them; at 95 % here.
    assert np.quantile(off, 0.95) <= max(NOISE, 1e-9)


@pytest.mark.parametrize("name", CONVEX)
def test_triangles_do_not_run_across_edges(name):
    """Every triangle faces as one of the patches does: within 2 degrees, slivers apart."""
    made, atlas = surface(name), simplified(name)
    a, b, c = made.vertices[made.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    area = 0.5 * np.linalg.norm(normals, axis=1)
    faces = np.array([atlas.patch(i).frame.normal for i in atlas.graph])
    alike = (normals @ faces.T).max(axis=1) >= np.cos(np.deg2rad(2.0)) * 2.0 * area
    assert area[~alike].sum() <= 1e-4 * area.sum()


def test_boundary_at_an_edge_of_the_cube_is_a_crease_on_both_faces():
    atlas = simplified("block")
    for i, j, data in atlas.graph.edges(data=True):
        boundary = data["boundary"]
        assert boundary.crease and boundary.gap_rms == 0.0
        assert boundary.normal_gap == pytest.approx(np.pi / 2, abs=0.01)
        for k in (i, j):
            off = np.abs(atlas.patch(k).signed_distance(boundary.points))
            # Its ends lie between two points of the crease, on a chord of it.
            assert off[1:-1].max() < 1e-9 and off.max() < 0.01 * atlas.tolerance


@pytest.mark.parametrize("finished", [False, True])
def test_distance_outside_of_an_edge_is_that_of_the_intersection(finished):
    """Points in the wedge beyond two faces: the larger of the two distances (CSG). Before merging
    several patches of a face are blended there: the distance is not that of one of them."""
    rng = np.random.default_rng(0)
    atlas = simplified("block") if finished else explored_sharp("block").atlas
    points = np.column_stack([rng.uniform(-12, 12, 200), 20.0 + rng.uniform(0.5, 3, (200, 2))])
    seen = atlas.blend(points)
    assert seen.known.all()
    expected = (points[:, 1:] - 20.0).max(axis=1)
    # Two fitted planes at their rim, some five deviations of a sample.
    assert np.abs(seen.distance - expected).max() < 5 * NOISE
    alone = [
        atlas.patch(i).signed_distance(point[None])[0]
        for i, point in zip(seen.patch.tolist(), points, strict=True)
    ]
    is_blended = np.abs(seen.distance - alone) > 1e-9
    assert is_blended.mean() == 0.0 if finished else is_blended.mean() > 0.5


@pytest.mark.parametrize("name", ["block", "step", "roof", "wall"])
@pytest.mark.parametrize("finished", [False, True])
def test_distance_about_a_body_with_edges_is_that_of_its_half_spaces(name, finished):
    """Unions and intersections of exact half spaces (CSG), about the whole surface with its
    notches. All but one in a thousand are within five deviations of a sample: the farthest lie at
    edges whose curves are off by as much."""
    atlas = simplified(name) if finished else explored_sharp(name).atlas
    obj, rng = sharp_object(name), np.random.default_rng(0)
    points, _ = obj.sample(10_000, rng)
    points = points + rng.normal(0.0, 0.7, points.shape)
    seen = atlas.blend(points)
    off = np.abs(seen.distance - obj.value(points))
    assert seen.known.all()
    assert np.quantile(off, 0.999) < 5 * NOISE


def test_nothing_is_known_beyond_an_edge():
    """On the plane of a face, but off the body: no flap of the patch remains there."""
    atlas = simplified("block")
    flap = np.array([[35.0, 0.0, 20.0], [0.0, 35.0, 20.0], [35.0, 35.0, 20.0]])
    seen = atlas.blend(flap)
    assert (~seen.known | (seen.distance > 10.0)).all()
