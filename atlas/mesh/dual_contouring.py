"""Dual contouring: triangles of the zero set of a signed distance, sharp where it is sharp.

The cubes of a lattice that the surface passes get a vertex for each sheet within them, and each
lattice edge that the surface crosses gets a quadrilateral between the four cubes around it.
"""

import igl
import numpy as np

from touchatlas.atlas.mesh.cube_sheets import edge_ends, sheets_of
from touchatlas.atlas.mesh.marching_cubes import (
    CORNERS,
    EDGES,
    corners_of,
    crossed_neighbours,
    ends_of,
    key,
    unkey,
)
from touchatlas.atlas.mesh.quadric_error import seen, vertices_of
from touchatlas.atlas.mesh.weld import weld

# Offset of the lattice from the first seed, in edges, so that no lattice plane lies in a flat face.
# Any numbers without a small common multiple do; doubled, they do as well.
_OFFSET = np.array([0.31, 0.43, 0.37])
# Distance from the surface at which a crossing is exact, in edges: far below any error that a
# measured surface has. Doubled, few crossings take a step less.
_EXACT = 1e-8
# Steps along a lattice edge to its crossing: one is exact for a plane, and at an edge between two
# planes it takes three. Doubled, nothing changes but the time.
_STEPS = 4
# Distance below which two vertices are one, in edges. Doubled, nothing changes.
_SAME = 1e-6
# Least height of a triangle over its longest side that is no degenerate one. Doubled, slivers
# twice as wide are avoided where the other diagonal allows it.
_THIN = 1e-3
# Difference of two diagonals from the surface that is none, in edges. Doubled, more diagonals are
# chosen by shape.
_TIE = 1e-6


class _Nodes:
    """Corners of the lattice with the signed distance there.

    Parameters
    ----------
    at : function
        Distance, normal and known at points.
    start : (3,) float, length
        The corner of index 0.
    edge : float, length
    """

    def __init__(self, at, start, edge: float):
        self.at, self.start, self.edge = at, start, edge
        self.keys = np.zeros(0, np.int64)
        self.distance = np.zeros(0)
        self.normal = np.zeros((0, 3))

    def points(self, keys) -> np.ndarray:
        """(..., 3) places of nodes (...)."""
        return unkey(keys) * self.edge + self.start

    def rows(self, keys) -> np.ndarray:
        """(...) rows of nodes (...), all of which must be there."""
        return np.searchsorted(self.keys, keys)

    def add(self, keys) -> None:
        """Evaluate those of the nodes (n,) that are not there. NaN stands for unknown."""
        new = _new(keys, self.keys)
        if not len(new):
            return
        distance, normal, known = self.at(self.points(new))
        place = self.rows(new)
        self.keys = np.insert(self.keys, place, new)
        self.distance = np.insert(self.distance, place, np.where(known, distance, np.nan))
        self.normal = np.insert(self.normal, place, normal, axis=0)


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
    seeds = np.asarray(seeds, float).reshape(-1, 3)
    if not edge > 0.0:
        raise ValueError(f"the edge of the cubes must be positive, not {edge}")
    if not len(seeds):
        raise ValueError("a surface needs at least one seed: give a point on it")
    nodes = _Nodes(at_corners, seeds[0] + _OFFSET * edge, edge)
    cubes, inside = _flood(nodes, seeds)
    if not len(cubes):
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    sheets = sheets_of(cubes, inside, lambda points: seen(at, points * edge + nodes.start)[0] < 0.0)
    cube, local = np.nonzero(sheets >= 0)
    sheet = sheets[cube, local]
    edges, crossing = np.unique(_edge_keys(cubes)[cube, local], return_inverse=True)
    points, normals = _crossings(at, nodes, edges)
    order = np.argsort(sheet, kind="stable")
    mine = crossing[order]
    low = nodes.points(cubes[cube[np.unique(sheet, return_index=True)[1]]])
    vertices, sharp = vertices_of(at, points[mine], normals[mine], sheet[order], low, edge)
    quads = _quads(crossing, local, sheet, inside[cube, edge_ends()[local, 0]])
    return _manifold(vertices, _halved(at, vertices, quads, sharp, edge), edge)


def _flood(nodes: _Nodes, seeds):
    """Ascending keys (c,) of the cubes that the surface passes, and whether each corner of them
    (c, 8) is inside. The fill starts from the eight cubes nearest to each seed."""
    near = np.floor((seeds - nodes.start) / nodes.edge - 0.5).astype(np.int64)
    fresh = np.unique(key(near[:, None] + CORNERS))
    tried, found = fresh[:0], [fresh[:0]]
    while len(fresh):
        tried = np.insert(tried, np.searchsorted(tried, fresh), fresh)
        nodes.add(corners_of(fresh))
        distance = nodes.distance[nodes.rows(corners_of(fresh))]
        inside = distance < 0.0
        passed = inside.any(axis=1) & ~inside.all(axis=1) & ~np.isnan(distance).any(axis=1)
        found.append(fresh[passed])
        fresh = _new(crossed_neighbours(fresh[passed], inside[passed]), tried)
    cubes = np.sort(np.concatenate(found))
    return cubes, nodes.distance[nodes.rows(corners_of(cubes))] < 0.0


def _new(keys, old) -> np.ndarray:
    """Ascending keys, once each, of those that are not among ascending old ones (n,)."""
    keys = np.unique(keys)
    place = np.minimum(np.searchsorted(old, keys), len(old) - 1)
    return keys[old[place] != keys] if len(old) else keys


def _edge_keys(cubes) -> np.ndarray:
    """(c, 12) keys of the edges of cubes (c,)."""
    return (corners_of(cubes)[:, edge_ends()[:, 0]] << 2) + EDGES[:, 3]


def _crossings(at, nodes: _Nodes, edges):
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


def _quads(crossing, local, sheet, inside) -> np.ndarray:
    """(q, 4) sheets around each crossed edge with all four cubes, counter-clockwise from outside.

    Parameters
    ----------
    crossing, local, sheet : (n,) int
        Crossed lattice edge, its place in the cube and its sheet there, for each side of a cube.
    inside : (n,) bool
        Whether the lower end of the edge is inside.
    """
    axis = EDGES[:, 3]
    one, two = (EDGES[np.arange(12), (axis + k) % 3] for k in (1, 2))
    # An edge at the lower side of its cube has that cube on its upper side.
    turn = np.array([[2, 3], [1, 0]])[two, one]
    order = np.lexsort((turn[local], crossing))
    whole = np.repeat(np.bincount(crossing), np.bincount(crossing)) == 4
    order = order[whole].reshape(-1, 4)
    quads = sheet[order]
    return np.where(inside[order[:, :1]], quads, quads[:, ::-1])


def _halved(at, vertices, quads, sharp, edge: float) -> np.ndarray:
    """(2 q, 3) triangles of quadrilaterals (q, 4), cut along the diagonal nearer to the surface.

    At sharp vertices (v,) a diagonal whose triangles are degenerate or face inward is avoided.
    Where both diagonals are as near, the one with the larger smallest triangle is taken.
    """
    ways = np.stack([quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]], axis=1)
    ways = ways.reshape(-1, 2, 2, 3)
    corners = vertices[ways]
    across, thin = _across(corners)
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


def _across(corners):
    """Normals (..., 3) of triangles (..., 3, 3), as long as twice their areas, and whether each is
    degenerate (...)."""
    sides = np.roll(corners, -1, axis=-2) - corners
    across = np.cross(sides[..., 0, :], sides[..., 1, :])
    longest = (sides * sides).sum(axis=-1).max(axis=-1)
    return across, np.linalg.norm(across, axis=-1) < _THIN * longest


def _manifold(vertices, faces, edge: float):
    """The mesh without triangles of no extent, and with a vertex for each fan of triangles."""
    faces, kept = weld(vertices, faces, _SAME * edge)
    if not len(faces):
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    faces, index = igl.split_nonmanifold(faces)
    return vertices[kept[index]], faces
