"""Dual contouring: triangles of the zero set of a signed distance, sharp where it is sharp.

The cubes of a lattice that the surface passes get a vertex for each sheet within them, and each
lattice edge that the surface crosses gets a quadrilateral between the four cubes around it. Where
the normal turns within a cube, the vertex minimises the sum of its squared distances from the
tangent planes at the crossings: it lies on the edge or in the corner of the surface. Elsewhere it
is the mean of the crossings, moved onto the surface (Ju, Losasso, Schaefer and Warren, Dual
contouring of Hermite data, 2002).
"""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.mesh.cubes import (
    Nodes,
    corners_of,
    edge_keys,
    ends_of,
    flood,
    quads_of,
    sheets_of,
)
from touchatlas.atlas.records.surface import manifold

# Least singular value of the tangent planes that counts, over the largest: two planes that meet
# at less than 11 degrees are one, at the tip of a wedge at less than 5 degrees.
_CUT, _NARROW = 0.1, 0.04
# Largest distance of a vertex from its cube, in edges: an edge or corner of the surface may pass
# through a face of the cube and hold no node beyond it. At 0.5 one corner in 200 of boxes in any
# position is cut off.
_OUTSIDE = 0.7


def dual_contour(
    at, at_corners, seeds, edge: float, sharp: bool = True, is_sure=None
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the zero set of a signed distance, sharp where it is sharp.

    Parameters
    ----------
    at : function
        From points (n, 3) to the signed distance (n,), length, positive outside and of first order
        near the surface; and the outward unit normal (n, 3). The normal may jump, as that of the
        largest of several distances does.
    at_corners : function
        The same at corners of the cubes, whether the surface is known there (n,), and where that
        is unsure (n,). The surface ends at cubes with an unknown corner.
    seeds : (k, 3) float, length
        Points on the surface, at least one on each connected piece.
    edge : float, length
        Edge of the cubes.
    sharp : bool
        Whether the surface may have edges and corners.
    is_sure : function, optional
        From points (n, 3) that are unsure, with distances (n,) and normals (n, 3), to whether the
        surface is known there (n,). It is asked once.

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
    Nielson, Dual marching cubes, 2004. Schaefer, Ju and Warren, Manifold dual contouring, 2007.
    """
    nodes, cubes, inside = flood(at_corners, seeds, edge, is_sure)
    if not len(cubes):
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    sheets = sheets_of(cubes, inside, lambda points: _ask(at, points * edge + nodes.start)[0] < 0.0)
    cube, local = np.nonzero(sheets >= 0)
    sheet = sheets[cube, local]
    edges, crossing = np.unique(edge_keys(cubes)[cube, local], return_inverse=True)
    below = nodes.distance[nodes.rows(edges >> 2)][crossing] < 0.0
    quads = quads_of(crossing, local, sheet, below)
    owner = cube[np.unique(sheet, return_index=True)[1]]
    bent = _bent(nodes, cubes)[owner] if sharp else np.zeros(len(owner), bool)
    rows = nodes.rows(ends_of(edges))
    slope = np.take_along_axis(nodes.normal[rows], (edges & 3)[:, None, None], axis=2)[..., 0]
    ends = np.stack([np.tile([0.0, 1.0], (len(edges), 1)), nodes.distance[rows] / edge, slope])
    points, normals = _crossings(at, nodes, edges, ends, np.unique(crossing[bent[sheet]]))
    order = np.argsort(sheet, kind="stable")
    crossing, sheet = crossing[order], sheet[order]
    starts = np.flatnonzero(np.diff(sheet, prepend=-1))
    means = np.add.reduceat(points[crossing], starts) / np.bincount(sheet)[:, None]
    mine, chosen = bent[sheet], np.flatnonzero(bent)
    vertices, out, at_edge = means.copy(), np.zeros((len(means), 3)), np.zeros(len(means), bool)
    vertices[chosen], at_edge[chosen] = _sharp_vertices(
        *(at, points[crossing[mine]], normals[crossing[mine]]),
        *(np.unique(sheet[mine], return_inverse=True)[1], nodes.points(cubes[owner[chosen]])),
        *(means[chosen], edge),
    )
    # A step to the surface errs by the square of its length over the radius of curvature.
    smooth = ~at_edge
    distance, out[smooth] = _ask(at, means[smooth])
    vertices[smooth] = means[smooth] - np.clip(distance, -edge, edge)[:, None] * out[smooth]
    faces = _halved(at, vertices, out, quads, at_edge, edge)
    faces, index = manifold(_collapsed(vertices, faces, 1e-6 * edge)[faces])
    return vertices[index], faces


def _ask(at, points):
    """Distance (n,) and normal (n, 3) at points (n, 3)."""
    return at(points) if len(points) else (np.zeros(0), np.zeros((0, 3)))


def _bent(nodes: Nodes, cubes) -> np.ndarray:
    """(c,) whether the normals at the corners of cubes (c,) turn by the least angle that counts:
    the plane that halves an edge of the surface has corners of its cube on both sides."""
    normals = nodes.normal[nodes.rows(corners_of(cubes))]
    mean = normals.mean(axis=1)
    return np.asarray((mean * mean).sum(axis=1) < np.cos(0.5 * _CUT) ** 2)


def _crossings(at, nodes: Nodes, edges, ends, exact):
    """Points (e, 3) at which the surface crosses lattice edges (e,) with parameter, distance and
    slope at their ends (3, e, 2), and the normals there, at those that are to be ``exact`` (k,).

    The first guess is linear. Then each step is Newton's along the edge, from the last point or
    from an end that is nearer to the same smooth piece; where none stays between the ends, it is
    the secant's (a safeguarded Newton method).
    """
    axis, first = edges & 3, nodes.points(edges >> 2)
    parameter, live, normals = _secant(ends), exact, np.zeros((len(edges), 3))
    for _ in range(4):
        points = first[live] + parameter[live, None] * nodes.edge * np.eye(3)[axis[live]]
        distance, normals[live] = _ask(at, points)
        # Far below any error that a measured surface has.
        off = np.abs(distance) > 1e-8 * nodes.edge
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


def _sharp_vertices(at, points, normals, sheet, low, means, edge: float):
    """Places (v, 3) where the planes of sheets meet, and whether (v,) they meet at an angle.

    ``points`` and ``normals`` (n, 3) are the crossings of the sheets ``sheet`` (n,), ascending,
    ``low`` (v, 3) the lowest corners of their cubes, and ``means`` (v, 3) of their crossings.
    Planes are taken anew at a quarter and a twentieth of the way to the crossings: the error of a
    plane falls with the square of its distance.
    """
    found, rank = _meeting(at, means, means, points, normals, sheet, low, edge)
    for share in (0.25, 0.05):
        mine = (rank > 1)[sheet]
        sharp, here = np.unique(sheet[mine], return_inverse=True)
        near = found[sheet[mine]] + share * (points[mine] - found[sheet[mine]])
        distance, normal = _ask(at, near)
        feet = near - np.clip(distance, -edge, edge)[:, None] * normal
        found[sharp], rank[sharp] = _meeting(
            at, found[sharp], means[sharp], feet, normal, here, low[sharp], edge
        )
    return found, rank > 1


def _meeting(at, middle, means, points, normals, sheet, low, edge: float):
    """Where the planes of each sheet meet, as near to ``middle`` (v, 3) as they allow, and the
    number (v,) of directions that they fix; others as in ``_sharp_vertices``.

    Directions are given up, weakest first, until the place lies within the cube or near it, or at
    the tip of a wedge beyond it, which is thinner than the cube.
    Where it never does, it is the mean of the crossings, and the number is 0.
    """
    place, rank = means.copy(), np.zeros(len(means), int)
    if not len(sheet):
        return place, rank
    starts = np.flatnonzero(np.diff(sheet, prepend=-1))
    height = ((points - middle[sheet]) * normals).sum(axis=1)
    matrix = np.add.reduceat(normals[:, :, None] * normals[:, None, :], starts)
    right = np.add.reduceat(height[:, None] * normals, starts)
    values, vectors = np.linalg.eigh(matrix)
    counts, wide = (values > cut**2 * values[:, 2:] for cut in (_NARROW, _CUT))
    along = np.einsum("vij,vi->vj", vectors, right) / np.where(counts, values, 1.0)
    for weakest in (2, 1, 0):
        used = counts & (np.arange(3) >= weakest)
        meeting = middle + np.einsum("vij,vj->vi", vectors, np.where(used, along, 0.0))
        excess = np.abs(meeting - low - 0.5 * edge).max(axis=1) - 0.5 * edge
        # Of two planes that meet at an angle a and have as many crossings, the root is tan(a / 2).
        half_width = excess * np.sqrt(np.maximum(values[:, weakest], 0.0) / values[:, 2])
        # Both sides pass one cube only where the wedge is no wider there.
        tip = np.flatnonzero((excess > _OUTSIDE * edge) & (half_width <= 0.5 * edge))
        good = (excess <= _OUTSIDE * edge) & wide[:, weakest]
        good[tip] = used[tip, weakest] & (np.abs(_ask(at, meeting[tip])[0]) <= 0.02 * edge)
        place[good], rank[good] = meeting[good], 3 - weakest
    return place, rank


def _halved(at, vertices, normals, quads, sharp, edge: float) -> np.ndarray:
    """(2 q, 3) triangles of quadrilaterals (q, 4), cut along the diagonal nearer to the surface.

    How near it is follows from the normals (v, 3) at its ends. At sharp vertices (v,) the surface
    is asked, and a diagonal whose triangles are degenerate or face inward is avoided. Where both
    diagonals are as near, the one with the larger smallest triangle is taken.
    """
    ways = np.stack([quads[:, [0, 1, 2, 0, 2, 3]], quads[:, [1, 2, 3, 1, 3, 0]]], axis=1)
    ways = ways.reshape(-1, 2, 2, 3)
    corners = vertices[ways]
    sides = np.roll(corners, -1, axis=3) - corners
    across = np.cross(sides[..., 0, :], sides[..., 1, :])
    area = np.linalg.norm(across, axis=-1)
    first, second = ways[:, :, 0, 0], ways[:, :, 0, 2]
    rise = (vertices[second] - vertices[first]) * (normals[second] - normals[first])
    cost = np.abs(rise.sum(axis=2)) / (8.0 * edge)
    asked = sharp[quads].any(axis=1)
    middles = corners[asked, :, 0][:, :, [0, 2]].mean(axis=2).reshape(-1, 3)
    centroids = corners[asked].mean(axis=3).reshape(-1, 3)
    distance, normal = _ask(at, np.concatenate([middles, centroids]))
    folded = (across[asked] * normal[len(middles) :].reshape(-1, 2, 2, 3)).sum(axis=-1) < 0.0
    thin = area[asked] < 1e-3 * (sides[asked] ** 2).sum(axis=-1).max(axis=-1)
    cost[asked] = np.abs(distance[: len(middles)]).reshape(-1, 2) / edge
    cost[asked] += (folded | thin).sum(axis=-1)
    tie = np.abs(cost[:, 0] - cost[:, 1]) < np.where(asked, 1e-6, 1e-3)
    cost[tie] = -area[tie].min(axis=-1)
    return ways[np.arange(len(quads)), cost.argmin(axis=1)].reshape(-1, 3)


def _collapsed(points, faces, least: float) -> np.ndarray:
    """(v,) the vertex that each becomes when edges shorter than ``least`` (length) of triangles
    (f, 3) between points (v, 3) are collapsed: the first of those that become one."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    square = ((points[ends[:, 1]] - points[ends[:, 0]]) ** 2).sum(axis=1)
    first, second = ends[square < least * least].T
    graph = coo_array((np.ones(len(first)), (first, second)), (len(points), len(points)))
    group = connected_components(graph, directed=False)[1]
    return np.asarray(np.unique(group, return_index=True)[1][group])
