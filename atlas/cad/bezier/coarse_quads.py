"""Coarse quads: few quadrilaterals of about equal sides all over a surface, as a first guess of its
Bezier faces."""

import igl
import numpy as np

from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.mesh.split_triangles import edges_of
from touchatlas.atlas.records.surface import Surface

# Number of triangles that is tried first, and its growth from one trial to the next, no unit.
# The first doubled, simple bodies have more faces than they need; the growth doubled, others do.
_FIRST, _GROWTH = 32, 1.4
# Most triangles that are tried, over those of the surface, no unit. Doubled, torn surfaces are
# found to be so after twice the time.
_MOST = 0.1
# Least cosine between the normal of a coarse triangle and those of the surface near it, no unit: 78
# degrees. Doubled, bodies with narrow necks have twice as many faces.
_ALIKE = 0.2


def coarse_triangles(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) on a surface and triangles (f, 3) of about equal sides between them, as few
    as face everywhere about as the surface does.

    The shortest edges are collapsed first, which keeps the topology.

    Raises
    ------
    NotWritten
        A tenth of the triangles of the surface would not do.
    """
    count = _FIRST
    while count <= max(_FIRST, _MOST * len(surface.faces)):
        vertices, faces, _, _ = igl.decimate(surface.vertices, surface.faces, count)
        if 0 < len(faces) <= count + 1:
            _, _, on = igl.point_mesh_squared_distance(vertices, surface.vertices, surface.faces)
            if _face_alike(surface, on, faces):
                return on, faces
        count = int(_GROWTH * count)
    raise NotWritten("the surface is torn: few triangles do not face as it does")


def _face_alike(surface: Surface, vertices, faces) -> bool:
    """Whether triangles face as the vertices of the surface do to which they are nearest."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    if lengths.min() <= 0.0:
        return False
    _, nearest, _ = igl.point_mesh_squared_distance(surface.vertices, vertices, faces)
    cosines = (normals[nearest] * surface.normals).sum(axis=1) / lengths[nearest]
    return bool(cosines.min() >= _ALIKE)


def three_quads(vertices, faces) -> tuple[np.ndarray, np.ndarray]:
    """Three quadrilaterals in the place of each triangle, between its corners, the middles of its
    edges and its own middle.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int

    Returns
    -------
    vertices : (v + e + f, 3) float, length
        The same, then the middles of edges and those of triangles.
    quads : (3 f, 4) int
        Turning as the triangles do.

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]])
    >>> points, quads = three_quads(corners, np.array([[0, 1, 2]]))
    >>> quads.tolist()
    [[0, 3, 6, 4], [1, 5, 6, 3], [2, 4, 6, 5]]
    >>> points[6].tolist()
    [2.0, 2.0, 0.0]
    """
    ends, sides = edges_of(faces)
    middles = len(vertices) + sides
    inner = len(vertices) + len(ends) + np.arange(len(faces))
    quads = [
        np.stack([faces[:, k], middles[:, k], inner, middles[:, k - 1]], axis=1) for k in range(3)
    ]
    points = [vertices, vertices[ends].mean(axis=1), vertices[faces].mean(axis=1)]
    return np.concatenate(points), np.stack(quads, axis=1).reshape(-1, 4)
