"""Dual contouring: triangles of the zero set of a signed distance, sharp where it is sharp.

The cubes of a lattice that the surface passes get a vertex for each sheet within them, and each
lattice edge that the surface crosses gets a quadrilateral between the four cubes around it.
"""

import numpy as np

from touchatlas.atlas.contouring.crossed_cubes import across_of, crossed_cubes, joined
from touchatlas.atlas.contouring.cube_flood import Nodes
from touchatlas.atlas.contouring.cube_lattice import ends_of
from touchatlas.atlas.contouring.quadric_error import seen, vertices_of

# Distance from the surface at which a crossing is exact, in edges: far below any error that a
# measured surface has. Doubled, few crossings take a step less.
_EXACT = 1e-8
# Steps along a lattice edge to its crossing: one is exact for a plane, and at an edge between two
# planes it takes three. Doubled, nothing changes but the time.
_STEPS = 4
# Difference of two diagonals from the surface that is none, in edges. Doubled, more diagonals are
# chosen by shape.
_TIE = 1e-6


def dual_contour(at, at_corners, seeds, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the zero set of a signed distance, sharp where it is sharp.

    Parameters
    ----------
    at : function
        From points (n, 3) to the signed distance (n,), length, positive outside and of first order
        near the surface; and the outward unit normal (n, 3). The normal may jump, as that of the
        largest of several distances does.
    at_corners : function
        The same at corners of the cubes, and whether the surface is known there (n,). The surface
        ends at cubes with an unknown corner.
    seeds : (k, 3) float, length
        Points on the surface, at least one on each connected piece.
    edge : float, length
        Edge of the cubes.

    Returns
    -------
    vertices : (v, 3) float, length
        Exact where planes meet; elsewhere their error is of the order of edge^4, and of the chords
        between them edge^2.
    faces : (f, 3) int
        Counter-clockwise seen from outside; a manifold, with a rim where the surface is unknown.

    Raises
    ------
    ValueError
        The edge is not positive, or there is no seed.

    References
    ----------
    Ju, Losasso, Schaefer and Warren, Dual contouring of Hermite data, 2002. Nielson, Dual marching
    cubes, 2004. Schaefer, Ju and Warren, Manifold dual contouring, 2007.
    """
    found = crossed_cubes(at, at_corners, seeds, edge)
    if found is None:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    points, normals = _crossings(at, found.nodes, found.edges)
    order = np.argsort(found.sheet, kind="stable")
    mine = found.crossing[order]
    vertices, sharp = vertices_of(
        at, points[mine], normals[mine], found.sheet[order], found.low, edge
    )
    return joined(vertices, _halved(at, vertices, found.quads, sharp, edge), edge)


def _crossings(at, nodes: Nodes, edges):
    """Points (e, 3) at which the surface crosses lattice edges (e,), and the normals there.

    The first guess is linear. Then each step is Newton's along the edge, from the last point or
    from an end that is nearer to the same smooth piece; where none stays between the ends, it is
    the secant's (a safeguarded Newton method).
    """
    rows = np.stack([nodes.rows(end) for end in ends_of(edges)], axis=1)
    axis, first = edges & 3, nodes.points(edges >> 2)
    slope = np.take_along_axis(nodes.normal[rows], axis[:, None, None], axis=2)[..., 0]
    # Parameter, distance and slope at the two ends of what holds the crossing, in edges.
    ends = np.stack(
        [np.tile([0.0, 1.0], (len(edges), 1)), nodes.distance[rows] / nodes.edge, slope]
    )
    parameter, live = _secant(ends), np.arange(len(edges))
    normals = np.zeros((len(edges), 3))
    for _ in range(_STEPS):
        points = first[live] + parameter[live, None] * nodes.edge * np.eye(3)[axis[live]]
        distance, normals[live] = seen(at, points)
        off = np.abs(distance) > _EXACT * nodes.edge
        live, distance = live[off], distance[off] / nodes.edge
        slope = normals[live, axis[live]]
        side = ((distance < 0.0) != (ends[1, live, 0] < 0.0)).astype(int)
        ends[:, live, side] = parameter[live], distance, slope
        parameter[live] = _next(ends[:, live], side)
    return first + parameter[:, None] * nodes.edge * np.eye(3)[axis], normals


def _secant(ends) -> np.ndarray:
    """(n,) zero of the line between two ends: parameter, distance and slope (3, n, 2)."""
    place, distance, _ = ends
    return place[:, 0] - distance[:, 0] * np.ptp(place, axis=1) / np.diff(distance)[:, 0]


def _next(ends, side) -> np.ndarray:
    """(n,) next guess between two ends (3, n, 2): Newton's from the end ``side`` (n,), or from the
    other one, or the secant's, whichever is the first to lie between them."""
    guess, row = _secant(ends), np.arange(len(side))
    for which in (1 - side, side):
        place, distance, slope = ends[:, row, which]
        newton = place - distance / np.where(slope == 0.0, np.nan, slope)
        guess = np.where((newton >= ends[0, :, 0]) & (newton <= ends[0, :, 1]), newton, guess)
    return guess


def _halved(at, vertices, quads, sharp, edge: float) -> np.ndarray:
    """(2 q, 3) triangles of quadrilaterals (q, 4), cut along the diagonal nearer to the surface.

    At sharp vertices (v,) a diagonal whose triangles are degenerate or face inward is avoided.
    Where both diagonals are as near, the one with the larger smallest triangle is taken.
    """
    ways = np.stack([quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]], axis=1)
    ways = ways.reshape(-1, 2, 2, 3)
    corners = vertices[ways]
    across, thin = across_of(corners)
    checked = sharp[quads].any(axis=1)
    middles = corners[:, :, 0, [0, 2]].mean(axis=2).reshape(-1, 3)
    centroids = corners[checked].mean(axis=3).reshape(-1, 3)
    distance, normal = seen(at, np.concatenate([middles, centroids]))
    cost = np.abs(distance[: len(middles)]).reshape(-1, 2) / edge
    outward = normal[len(middles) :].reshape(-1, 2, 2, 3)
    folded = (across[checked] * outward).sum(axis=-1) < 0.0
    cost[checked] += (folded | thin[checked]).sum(axis=-1)
    tie = np.abs(cost[:, 0] - cost[:, 1]) < _TIE
    cost[tie] = -np.linalg.norm(across[tie], axis=-1).min(axis=-1)
    return ways[np.arange(len(quads)), cost.argmin(axis=1)].reshape(-1, 3)
