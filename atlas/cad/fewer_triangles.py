"""Fewer triangles of a surface, within a bound of those that it has."""

from dataclasses import replace

import igl
import numpy as np

from touchatlas.atlas.records.surface import Surface

# Part of the triangles that is kept from one trial to the next, no unit. With the square of it, up
# to twice as many triangles are left as the bound allows.
_KEPT = 0.7
# Least number of triangles that is tried: a tetrahedron has four. Doubled, nothing changes.
_LEAST = 8


def fewer_triangles(surface: Surface, bound: float) -> Surface:
    """The surface with as few triangles as taking three tenths of them away again and again gives.

    Edges are collapsed in the order of quadric errors (Garland and Heckbert, Surface
    Simplification Using Quadric Error Metrics, 1997). Each result is compared with the surface.

    Parameters
    ----------
    surface : Surface
    bound : float, length
        Largest distance of the vertices of either from the triangles of the other.
    """
    best, count = surface, int(_KEPT * len(surface.faces))
    while count >= _LEAST:
        fewer = _collapsed(surface, count)
        if fewer is None or max(_farthest(surface, fewer), _farthest(fewer, surface)) > bound:
            break
        best, count = fewer, int(_KEPT * len(fewer.faces))
    return best


def _collapsed(surface: Surface, count: int) -> Surface | None:
    """The surface with about ``count`` triangles; None where there are more, or some turn over."""
    vertices, faces, triangle, vertex = igl.qslim(surface.vertices, surface.faces, count, True)
    if not 0 < len(faces) <= count + 1:
        return None
    old = igl.per_face_normals(surface.vertices, surface.faces[triangle], np.zeros(3))
    new = igl.per_face_normals(vertices, faces, np.zeros(3))
    if (np.einsum("ij,ij->i", old, new) <= 0.0).any():
        return None
    return replace(surface.taken(vertex, faces), vertices=vertices)


def _farthest(one: Surface, other: Surface) -> float:
    """Largest distance of the vertices and middles of triangles of one surface from another."""
    points = np.concatenate([one.vertices, one.vertices[one.faces].mean(axis=1)])
    squares = igl.point_mesh_squared_distance(points, other.vertices, other.faces)[0]
    return float(np.sqrt(squares.max()))
