"""Quadric error: the vertex of a sheet of the surface lies where its tangent planes meet.

A vertex minimises the sum of its squared distances from the tangent planes at the crossings of its
sheet (Ju, Losasso, Schaefer and Warren, Dual contouring of Hermite data, 2002). It then lies on the
edge or in the corner of the surface, if there is one, and else above the mean of the crossings.
"""

import numpy as np

# Least singular value of the tangent planes that counts, over the largest: two planes that meet
# at less than 11 degrees are one. Doubled, edges of less than 23 degrees are rounded.
_CUT = 0.1
# The same at tips: two planes that meet at less than 5 degrees are one there. Doubled, wedges of
# less than 9 degrees end early.
_NARROW = 0.04
# Distance of the points beside a vertex at which the planes are taken anew, over the distance of
# the crossings, in two rounds. The error of a plane falls with its square: from a twentieth, the
# error at a curved edge is 1/400 of the first. Doubled, it is four times larger.
_BESIDE = (0.25, 0.05)
# Largest distance of a vertex from its cube, in edges: an edge or corner of the surface may pass
# through a face of the cube and hold no node beyond it. Doubled, no more of them are found; at
# zero, they are cut off, and at 0.5 one corner in 200 of boxes in any position is.
_OUTSIDE = 0.7
# Half of the largest width of a wedge at the cube from which its tip is sought, in edges: both
# sides pass one cube only where the wedge is no wider. Doubled, wedges of 12 degrees end less
# early; at zero, those of 20 degrees end up to 2.9 edges before their tips.
_TIP = 0.5
# Largest distance from the surface of such a tip, in edges: others are no edges of it. Doubled,
# nothing changes.
_ON = 0.02
# Steps that move a smooth vertex onto the surface. Each squares the error over the radius of
# curvature; doubled, nothing changes but the time.
_PROJECTIONS = 2


def seen(at, points):
    """Distance (n,) and normal (n, 3) at points (n, 3)."""
    return at(points) if len(points) else (np.zeros(0), np.zeros((0, 3)))


def vertices_of(at, points, normals, sheet, low, edge: float):
    """Vertices (v, 3) of all sheets, and whether each lies at an edge or corner (v,).

    Parameters
    ----------
    at : function
        Distance and normal at points.
    points, normals : (n, 3) float, length and unit
        Crossings, and the normals there.
    sheet : (n,) int
        The sheet of each crossing, ascending, and each number from 0 on.
    low : (v, 3) float, length
        Lowest corner of the cube of each sheet.
    edge : float, length
        Edge of the cubes.

    Notes
    -----
    Where two planes meet, the vertex is exact. At a curved edge of curvature k its error is
    about 0.001 k edge^2, and on a smooth surface it is of the order of k^3 edge^4.
    """
    starts = np.flatnonzero(np.diff(sheet, prepend=-1))
    means = np.add.reduceat(points, starts) / np.diff(starts, append=len(sheet))[:, None]
    found, rank = _meeting(at, means, means, points, normals, sheet, low, edge)
    for beside in _BESIDE:
        mine = (rank > 1)[sheet]
        sharp, here = np.unique(sheet[mine], return_inverse=True)
        near = found[sheet[mine]] + beside * (points[mine] - found[sheet[mine]])
        distance, normal = seen(at, near)
        feet = near - _bounded(distance, edge)[:, None] * normal
        found[sharp], rank[sharp] = _meeting(
            at, found[sharp], means[sharp], feet, normal, here, low[sharp], edge
        )
    smooth = rank < 2
    found[smooth], _ = projected(at, means[smooth], edge, _PROJECTIONS)
    return found, ~smooth


def _meeting(at, middle, means, points, normals, sheet, low, edge: float):
    """Where the planes of each sheet meet, as near to ``middle`` (v, 3) as they allow, and the
    number (v,) of directions that they fix; ``at`` as in ``vertices_of``.

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
        tip = np.flatnonzero((excess > _OUTSIDE * edge) & (half_width <= _TIP * edge))
        good = (excess <= _OUTSIDE * edge) & wide[:, weakest]
        good[tip] = used[tip, weakest] & (np.abs(seen(at, meeting[tip])[0]) <= _ON * edge)
        place[good], rank[good] = meeting[good], 3 - weakest
    return place, rank


def projected(at, points, edge: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) moved onto the surface by Newton steps along the normal, and the normal (n, 3)
    before the last step."""
    for _ in range(steps):
        distance, normal = seen(at, points)
        points = points - _bounded(distance, edge)[:, None] * normal
    return points, normal


def _bounded(distance, edge: float) -> np.ndarray:
    """Distances (n,) that are no longer than an edge."""
    return np.clip(distance, -edge, edge)
