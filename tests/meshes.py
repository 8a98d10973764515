"""Meshes as surfaces, as an atlas draws them."""

import numpy as np
import trimesh

from touchatlas.atlas import Surface


def surface_of(mesh: trimesh.Trimesh, deviation: float = 0.0, curvature: float = 0.0) -> Surface:
    """A mesh as a surface of one face."""
    count = len(mesh.vertices)
    return Surface(
        *(np.array(mesh.vertices), np.array(mesh.faces), np.array(mesh.vertex_normals)),
        *(np.full(count, deviation), np.zeros(count, int), np.full(count, curvature)),
    )


def euler_number(surface: Surface) -> int:
    return int(surface.to_trimesh().euler_number)
