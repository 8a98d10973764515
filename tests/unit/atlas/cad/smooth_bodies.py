"""Smooth surfaces of known distance, and meshes as surfaces, for tests without a CAD kernel."""

import numpy as np
import trimesh

from touchatlas.atlas.records.surface import Surface

RADIUS = 10.0


def ball(points):
    """Distance (n,) and normal (n, 3) of a ball of ``RADIUS`` about the origin."""
    away = np.linalg.norm(points, axis=1)
    return away - RADIUS, points / away[:, None]


def ball_of(radius: float):
    """The same of another radius."""
    scale = radius / RADIUS

    def at(points):
        distance, normal = ball(points / scale)
        return scale * distance, normal

    return at


def cube_quads(radius: float = RADIUS):
    """The corners (8, 3) of a cube in a ball, and its sides (6, 4), counter-clockwise as seen from
    outside."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return radius / np.sqrt(3.0) * corners, np.array(quads)


def torus_mesh() -> trimesh.Trimesh:
    return trimesh.creation.torus(30.0, 10.0, major_sections=96, minor_sections=48)


def surface_of(mesh: trimesh.Trimesh) -> Surface:
    """A mesh as a surface without error."""
    count = len(mesh.vertices)
    return Surface(
        np.array(mesh.vertices),
        np.array(mesh.faces),
        np.array(mesh.vertex_normals),
        np.zeros(count),
        np.zeros(count, int),
        np.zeros(count),
    )
