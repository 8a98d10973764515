"""Chains of mesh edges placed on the faces on both sides."""

import numpy as np

from touchatlas.atlas.cad.face_layout import PlacedChain
from touchatlas.atlas.cad.face_regions import BEYOND, Chain
from touchatlas.atlas.cad.law_surfaces import LawSurface
from touchatlas.atlas.cad.shared_points import LEAST_SINE, shared_points
from touchatlas.patch.geometry.arrays import cross

# Distance by which the points of a true edge move onto both faces, in edges of the triangles.
# Doubled, faces are drawn with parts that are not theirs.
_MOVED = 3.0
# Least length of the moved points of a true edge over that of the triangles' edges, whose teeth
# make it 1.5 times longer. Doubled, true edges with teeth are taken for wrong.
_SHRUNK = 0.4
# Least distance of points of a chain, in edges of the triangles: teeth of the border go back by
# less. Doubled, short edges have no points but their ends.
_SPACING = 0.6
# Least distance of the ends of an edge, in edges of the triangles: nearer ones are one corner.
# Doubled, bodies with shorter edges are open there.
_SHORT = 1e-3
# Rounds in which the points of a rim take the mean of their neighbours: it is as jagged as cubes
# are. Doubled, rims are rounded over twice as many cubes.
_SMOOTHED = 8


def placed_chain(
    chain: Chain, surfaces: list[LawSurface], vertices, nodes, edge: float, blunt: float
) -> PlacedChain | None:
    """A chain with points on both faces, or on one at a rim; None where these do not intersect.

    Parameters
    ----------
    chain : Chain
    surfaces : list of LawSurface
        Of all regions.
    vertices : (v, 3) float, length, world
        Of the mesh.
    nodes : dict
        The point at which all faces meet, for each vertex at the end of a chain.
    edge : float, length
        Of the cubes in which the mesh was drawn.
    blunt : float, length
        Distance of the mesh from where its faces intersect, where edges are rounded.
    """
    around = [surfaces[r] for r in (chain.left, chain.right) if r != BEYOND]
    drawn = vertices[chain.vertices]
    found = shared_points(around, drawn)
    start, end = (nodes[int(v)][None] for v in chain.vertices[[0, -1]])
    points = np.concatenate([start, found[1:-1], end])
    if len(around) < 2 or _are_tangent(around[0], around[1], points):
        points = _smoothed(points)
    # Where more than three faces meet, a vertex may lie off the edges that end there.
    points = _spaced(shared_points(around, points), _SPACING * edge)
    if not _meet(around, drawn, found, edge, blunt) or _is_short(points, edge):
        return None
    return PlacedChain(chain.left, chain.right, points, 0, 0, False)


def _meet(around, points, found, edge: float, blunt: float) -> bool:
    """Whether faces intersect near points (k, 3) of a chain, which were moved onto both."""
    far = np.sqrt(((found - points) ** 2).sum(axis=1)).max()
    before, after = (np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in (points, found))
    is_closed = np.array_equal(points[0], points[-1])
    # Two planes meet in no closed curve.
    if is_closed and len(around) == 2 and not any(s.periodic for s in around):
        return False
    return bool(far <= _MOVED * edge + blunt and after >= _SHRUNK * before)


def _is_short(points, edge: float) -> bool:
    """Whether points (k, 3) are no curve: too few of a closed one, or without length."""
    if np.array_equal(points[0], points[-1]):
        return len(points) < 4
    return bool(np.linalg.norm(points[-1] - points[0]) < _SHORT * edge)


def _are_tangent(first: LawSurface, second: LawSurface, points) -> bool:
    """Whether two surfaces have about the same tangent plane at points (k, 3)."""
    across = cross(first.at(points)[1], second.at(points)[1])
    return bool(np.median(np.linalg.norm(across, axis=1)) < LEAST_SINE)


def _smoothed(points) -> np.ndarray:
    """Points (k, 3) of a line, each in the middle of its neighbours, the ends kept."""
    points = points.copy()
    for _ in range(_SMOOTHED):
        points[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
    return points


def _spaced(points, spacing: float) -> np.ndarray:
    """Points (k, 3) of a line without those nearer than ``spacing`` to the last or to the end."""
    kept = [0]
    for i in range(1, len(points) - 1):
        away = np.linalg.norm(points[[kept[-1], -1]] - points[i], axis=1)
        if away.min() >= spacing:
            kept.append(i)
    return np.asarray(points[[*kept, len(points) - 1]])
