"""Smooth contouring: triangles of the zero set of a signed distance that is smooth everywhere.

It asks for the distance at the corners of cubes and twice at each vertex alone, where dual
contouring also asks at each crossing and in each quadrilateral.
"""

import numpy as np

from touchatlas.atlas.contouring.crossed_cubes import across_of, crossed_cubes, joined
from touchatlas.atlas.contouring.cube_flood import Nodes
from touchatlas.atlas.contouring.cube_lattice import ends_of
from touchatlas.atlas.contouring.quadric_error import projected

# Difference of the heights over two diagonals that is none, in edges. Doubled, more diagonals are
# chosen by shape.
_TIE = 1e-3


def smooth_contour(at, at_corners, seeds, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the zero set of a smooth signed distance: as ``dual_contour``, but edges of the
    surface are rounded.

    Parameters
    ----------
    at, at_corners, seeds, edge
        See ``dual_contour``.

    Returns
    -------
    vertices : (v, 3) float, length
        Each is the mean of the crossings of its sheet, moved onto the surface.
    faces : (f, 3) int
        Counter-clockwise seen from outside; a manifold, with a rim where the surface is unknown.

    References
    ----------
    Nielson, Dual marching cubes, 2004.
    """
    found = crossed_cubes(at, at_corners, seeds, edge)
    if found is None:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    points = _crossings(found.nodes, found.edges)[found.crossing]
    sums = np.stack([np.bincount(found.sheet, column) for column in points.T], axis=1)
    means = sums / np.bincount(found.sheet)[:, None]
    vertices, normals = projected(at, means, edge, 1)
    return joined(vertices, _halved(vertices, normals, found.quads, edge), edge)


def _crossings(nodes: Nodes, edges) -> np.ndarray:
    """(e, 3) points at which the surface crosses lattice edges (e,), by linear interpolation."""
    low, high = ends_of(edges)
    distance = nodes.distance[np.stack([nodes.rows(low), nodes.rows(high)], axis=1)]
    first, second = nodes.points(low), nodes.points(high)
    parameter = distance[:, 0] / (distance[:, 0] - distance[:, 1])
    return first + parameter[:, None] * (second - first)


def _halved(vertices, normals, quads, edge: float) -> np.ndarray:
    """(2 q, 3) triangles of quadrilaterals (q, 4), cut along the diagonal over which the surface
    is less high, by the normals at its ends; where both are alike, so that the smaller triangle is
    as large as can be."""
    ways = np.stack([quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]], axis=1)
    ways = ways.reshape(-1, 2, 2, 3)
    first, second = ways[:, :, 0, 0], ways[:, :, 0, 2]
    rise = (vertices[second] - vertices[first]) * (normals[second] - normals[first])
    cost = np.abs(rise.sum(axis=2)) / (8.0 * edge)
    across, _ = across_of(vertices[ways])
    tie = np.abs(cost[:, 0] - cost[:, 1]) < _TIE
    cost[tie] = -np.linalg.norm(across[tie], axis=-1).min(axis=-1)
    return ways[np.arange(len(quads)), cost.argmin(axis=1)].reshape(-1, 3)
