"""Coarse quads against the surfaces that they stand for."""

import igl
import numpy as np
import pytest
import trimesh

from tests.unit.atlas.cad.smooth_bodies import RADIUS, surface_of, torus_mesh
from touchatlas.atlas.cad.bezier.coarse_quads import coarse_triangles, three_quads
from touchatlas.atlas.cad.not_written import NotWritten


@pytest.mark.parametrize(("mesh", "euler"), [(trimesh.creation.icosphere(4), 2), (torus_mesh(), 0)])
def test_coarse_triangles_have_the_topology_of_the_surface_and_lie_on_it(mesh, euler):
    surface = surface_of(mesh)
    vertices, faces = coarse_triangles(surface)
    found = trimesh.Trimesh(vertices, faces, process=False)
    assert found.is_watertight and found.euler_number == euler
    assert len(faces) < 0.1 * len(mesh.faces)
    squares, _, _ = igl.point_mesh_squared_distance(vertices, surface.vertices, surface.faces)
    assert squares.max() < 1e-20 * np.ptp(mesh.vertices) ** 2


def test_every_edge_of_three_quads_is_of_two_and_they_turn_alike():
    mesh = trimesh.creation.icosphere(1, RADIUS)
    _, quads = three_quads(np.array(mesh.vertices), np.array(mesh.faces))
    assert len(quads) == 3 * len(mesh.faces)
    ways = [(quad[k - 1], quad[k]) for quad in quads.tolist() for k in range(4)]
    assert len(set(ways)) == len(ways)
    assert {(b, a) for a, b in ways} == set(ways)


def test_a_surface_whose_normals_point_anywhere_is_torn():
    mesh = trimesh.creation.icosphere(4, RADIUS)
    surface = surface_of(mesh)
    surface.normals[::50] *= -1.0
    with pytest.raises(NotWritten, match="torn"):
        coarse_triangles(surface)
