"""A surface is a manifold, whatever triangles it is made of."""

from collections import Counter

import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.atlas.records.surface import manifold
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe
from touchatlas.sim.world.mesh_object import MeshObject

CORNER = st.integers(0, 7)
SOUPS = st.lists(st.tuples(CORNER, CORNER, CORNER), min_size=1, max_size=16).map(np.array)


def assert_manifold(faces) -> None:
    """By counting: no vertex twice in a triangle; each directed side once, so that an edge has two
    triangles at most, of one orientation; and at each vertex the triangles hang together over the
    sides that they share."""
    sides = [(int(f[i - 1]), int(f[i])) for f in faces for i in range(3)]
    assert all(len(set(f.tolist())) == 3 for f in faces)
    assert max(Counter(sides).values(), default=1) == 1
    for vertex in np.unique(faces).tolist():
        about = {n for n, f in enumerate(faces) if vertex in f}
        fan, more = set(), {min(about)}
        while more:
            fan |= more
            at = {int(k) for n in more for k in faces[n]} - {vertex}
            more = {n for n in about - fan if at & set(faces[n].tolist())}
        assert fan == about


@given(SOUPS)
def test_any_triangles_become_a_manifold(faces):
    """Of each three vertices no more triangles are left than there were, and none is new."""
    found, index = manifold(faces)
    assert_manifold(found)
    assert (np.unique(found) == np.arange(len(index))).all()
    assert (np.diff(index) >= 0).all()
    old, new = (Counter(tuple(sorted(f)) for f in x.tolist()) for x in (faces, index[found]))
    assert max(new.values(), default=1) == 1 and set(new) <= set(old)


@given(SOUPS)
def test_a_manifold_stays_as_it_is(faces):
    once, _ = manifold(faces)
    again, index = manifold(once)
    assert (again == once).all() and (index == np.arange(len(index))).all()


def test_two_boxes_with_a_common_edge_are_two_closed_bodies():
    """The eight vertices of each and the two of the edge twice: no rim is left."""
    box = trimesh.creation.box()
    both = np.concatenate([box.vertices, box.vertices + [1.0, 1.0, 0.0]])
    mesh = trimesh.Trimesh(both, np.concatenate([box.faces, box.faces + 8]))
    assert len(mesh.vertices) == 14 and not mesh.is_watertight
    faces, index = manifold(mesh.faces)
    assert len(index) == 16 and not len(igl.boundary_facets(faces)[0])


def test_triangles_that_lie_on_each_other_enclose_nothing():
    """A tetrahedron with a fin of two opposed triangles, and a third one on its side."""
    tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    faces, index = manifold([*tetrahedron, [0, 1, 4], [1, 0, 4], [1, 3, 0]])
    assert faces.tolist() == tetrahedron and index.tolist() == [0, 1, 2, 3]


def soup() -> MeshObject:
    """Large triangles anywhere in a box."""
    rng = np.random.default_rng(0)
    middles = rng.uniform(-0.3, 0.3, (60, 1, 3))
    points = (middles + rng.normal(scale=0.15, size=(60, 3, 3))).reshape(-1, 3)
    return MeshObject("soup", points, np.arange(180).reshape(-1, 3))


def holed_ball() -> MeshObject:
    """A ball of which a sixth of the triangles is missing, here and there."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=50.0)
    kept = np.random.default_rng(1).random(len(ball.faces)) > 1.0 / 6.0
    ball.update_faces(kept)
    ball.remove_unreferenced_vertices()
    return MeshObject("holed ball", np.array(ball.vertices), np.array(ball.faces))


@pytest.mark.slow
def test_a_body_that_is_open_everywhere_has_a_manifold_surface():
    for obj in (soup(), holed_ball()):
        atlas = Atlas(2e-2 * obj.diagonal)
        probe = Probe(obj, 2e-4 * obj.diagonal, np.random.default_rng(0))
        for _ in explore(atlas, Planner(*obj.start()), probe, 16):
            pass
        surface = extract_surface(atlas)
        assert len(surface.faces)
        assert_manifold(surface.faces)
