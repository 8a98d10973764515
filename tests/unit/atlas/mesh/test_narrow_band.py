"""The cubes of a closed atlas leave no hole."""

import numpy as np
import trimesh

from tests.explored import explored
from touchatlas.atlas.mesh.coarse_mesh import coarse_mesh


def test_coarse_meshes_of_a_closed_atlas_are_closed_on_every_lattice():
    """Where a patch owns few corners of a cube, its signs are known last; its neighbours, too, must
    be there."""
    field = explored("torus").atlas.field
    for edge in np.linspace(2.0, 6.0, 30):
        mesh = coarse_mesh(field, float(edge))
        found = trimesh.Trimesh(mesh.vertices.points, mesh.faces, process=False)
        assert found.is_watertight and found.euler_number == 0, edge
