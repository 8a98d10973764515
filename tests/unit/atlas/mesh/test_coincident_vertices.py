"""Sheets that meet in an edge stay apart when equal vertices are merged."""

import numpy as np
import trimesh

from touchatlas.atlas.mesh.coincident_vertices import without_coincident_vertices
from touchatlas.atlas.mesh.surface import Surface


def boxes_that_share_an_edge() -> Surface:
    one, other = trimesh.creation.box((1.0, 1.0, 1.0)), trimesh.creation.box((1.0, 1.0, 1.0))
    other.apply_translation((1.0, 1.0, 0.0))
    vertices = np.concatenate([one.vertices, other.vertices])
    faces = np.concatenate([one.faces, other.faces + 8])
    normals = np.concatenate([one.vertex_normals, other.vertex_normals])
    return Surface(vertices, faces, normals, np.full(16, 0.1), np.zeros(16, int), np.zeros(16))


def test_a_surface_is_a_manifold_after_its_equal_vertices_are_merged():
    """The two ends of the common edge are four vertices, which move by less than a thousandth."""
    surface = boxes_that_share_an_edge()
    assert not trimesh.Trimesh(surface.vertices, surface.faces).is_watertight
    apart = without_coincident_vertices(surface)
    mesh = trimesh.Trimesh(apart.vertices, apart.faces)
    assert mesh.is_watertight and mesh.euler_number == 4
    moved = np.linalg.norm(apart.vertices - surface.vertices, axis=1)
    assert np.count_nonzero(moved) == 4 and moved.max() < 1e-3


def test_a_surface_without_coincident_vertices_stays_as_it_is():
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    columns = np.full(8, 0.1), np.zeros(8, int), np.zeros(8)
    surface = Surface(np.array(box.vertices), np.array(box.faces), box.vertex_normals, *columns)
    assert without_coincident_vertices(surface) is surface
