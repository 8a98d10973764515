"""Triangles across a hole, from side to side: corners of its rim are cut off one after another."""

from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import igl
import numpy as np

from touchatlas.atlas.mesh.close_holes import error_across

# Least mean cosine between the normals of a hole's triangles and those of its rim: 120 degrees. At
# the crest of a wall it is 0, about the outer rim of what was touched -1. Doubled, surfaces that
# were touched on one side are closed by their own back.
_LEAST_COSINE = -0.5
# By what factor the circle of a corner that points into the hole counts as larger. Doubled, jagged
# rims, where normals err, are closed by edges that are twice as long.
_POINTING = 2.0


@dataclass(frozen=True, eq=False)
class Across:
    """Triangles from side to side of a hole.

    Parameters
    ----------
    triangles : (n - 2, 3) int
        Points of the rim, which are counted along it.
    diagonals : (n - 3, 2) int
        Edges of the triangles that are inside the rim.
    error : (n - 3,) float, length
        That of the surface at the middle of each, exceeded once in twenty.
    """

    triangles: np.ndarray
    diagonals: np.ndarray
    error: np.ndarray

    def widest(self, rim) -> np.ndarray:
        """(3,) the middle of the edge of largest error across a rim (n, 3), or of the rim where
        there is no new edge."""
        ends = self.diagonals[self.error.argmax()] if len(self.error) else slice(None)
        return np.asarray(rim[ends].mean(axis=0))


def triangles_across(rim, normals, edges, longest: float = np.inf) -> Across | None:
    """Triangles across a hole with a rim (n, 3) and normals (n, 3) there; None where one of their
    edges is longer than ``longest``, length, or is among the edges (m, 2) that its points have
    already, and where they face away from the surface at the rim.

    Corners of the rim are cut off one after another, that of the smallest circle through its three
    points first. So the triangles are as wide as the slit, and advance from its ends. Corners that
    point into the hole come later: a triangle there lies on the surface, and faces the other way.
    """
    count = len(rim)
    before, after = np.roll(np.arange(count), 1).tolist(), np.roll(np.arange(count), -1).tolist()
    taken = {frozenset(edge) for edge in np.asarray(edges).tolist()}
    triangles: list[tuple[int, int, int]] = []
    diagonals: list[tuple[int, int]] = []
    errors: list[float] = []

    def corner(i: int) -> tuple[float, int, int, int]:
        a, b = before[i], after[i]
        three = [b, i, a]
        is_free = np.linalg.norm(rim[b] - rim[a]) <= longest and frozenset((a, b)) not in taken
        points_in = _mean_cosine(rim[[three]], normals[[three]]) < _LEAST_COSINE
        radius = (_POINTING if points_in else 1.0) * _circumradius(rim[three])
        return (radius if is_free else np.inf), i, a, b

    waiting = [corner(i) for i in range(count)]
    heapify(waiting)
    while len(triangles) < count - 3:
        radius, i, a, b = heappop(waiting)
        if (before[i], after[i]) != (a, b):
            continue
        if not radius < np.inf:
            return None
        triangles.append((b, i, a))
        diagonals.append((a, b))
        errors.append(_error(rim[[a, b]], normals[[a, b]]))
        taken.add(frozenset((a, b)))
        after[a], before[b], after[i] = b, a, -1
        heappush(waiting, corner(a))
        heappush(waiting, corner(b))
    last = next(i for i in range(count) if after[i] >= 0)
    triangles.append((after[last], last, before[last]))
    found = np.array(triangles)
    if not _mean_cosine(rim[found], normals[found]) >= _LEAST_COSINE:
        return None
    return Across(found, np.array(diagonals, int).reshape(-1, 2), np.array(errors))


def _mean_cosine(triangles, normals) -> float:
    """Mean over the area of triangles (t, 3, 3) of the cosine between their normals and those at
    their corners (t, 3, 3)."""
    a, b, c = triangles.transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    total = np.linalg.norm(across, axis=1).sum()
    return float((across * normals.mean(axis=1)).sum() / max(total, np.finfo(float).tiny))


def _error(ends, normals) -> float:
    """Error of a surface at the middle between two ends (2, 3) of a gap with normals (2, 3),
    exceeded once in twenty, length."""
    gap = ends[1] - ends[0]
    length = max(float(np.linalg.norm(gap)), np.finfo(float).tiny)
    return float(error_across(0.5 * length, np.abs(normals @ gap).max() / length))


def _circumradius(triangle) -> float:
    """Radius of the circle through three points (3, 3), length: a b c / (4 area)."""
    a, b, c = triangle
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a)))
    sides = float(np.linalg.norm(b - a) * np.linalg.norm(c - b) * np.linalg.norm(a - c))
    return sides / (4.0 * area) if area > 0.0 else np.inf


def edges_within(faces, loops) -> list[np.ndarray]:
    """For each loop the edges (m, 2) of triangles (f, 3) that join two of its vertices, which are
    counted along it. No vertex is in two loops."""
    if not loops:
        return []
    label = np.full(int(faces.max()) + 1, -1)
    place = np.zeros(len(label), int)
    for number, loop in enumerate(loops):
        label[loop], place[loop] = number, np.arange(len(loop))
    edges = igl.edges(faces)
    first, second = label[edges].T
    inner = edges[(first >= 0) & (first == second)]
    return [place[inner[label[inner[:, 0]] == number]] for number in range(len(loops))]
