"""Edges between two corners: no contour came near them, but the edges of both faces with a third
face end in one place, at either end."""

from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.pieces.piece import Piece

# Newton steps to a corner of three pieces; of planes one is enough. Doubled, nothing changes.
_STEPS = 4
# Least determinant of the normals of three pieces that meet in a corner. Doubled, flat corners are
# missed.
_LEAST_DETERMINANT = 0.1


def pairs_at_corners(
    pieces: list[Piece], edges: dict[tuple[int, int], np.ndarray], reach: float
) -> dict[tuple[int, int], np.ndarray]:
    """Pairs of lawful pieces without an edge that meet in two corners or more.

    Parameters
    ----------
    pieces : list of Piece
    edges : dict
        Ascending pairs of pieces that meet in a sharp edge, mapped to points (k, 3) of it, length.
    reach : float, length
        Distance between the edges of two pieces with a third, and of these from the corner.

    Returns
    -------
    dict
        Ascending pairs, mapped to the corners (m, 3), one for each third piece, length.
    """
    around: dict[int, dict[int, np.ndarray]] = {}
    for (first, second), points in sorted(edges.items()):
        around.setdefault(first, {})[second] = points
        around.setdefault(second, {})[first] = points
    corners: dict[tuple[int, int], list[np.ndarray]] = {}
    for third, beside in sorted(around.items()):
        for pair in combinations(sorted(beside), 2):
            three = [pieces[k] for k in (*pair, third)]
            if pair in edges or not all(piece.kind.lawful for piece in three):
                continue
            corner = _corner(three, beside[pair[0]], beside[pair[1]], reach)
            if corner is not None:
                corners.setdefault(pair, []).append(corner)
    return {pair: np.array(some) for pair, some in corners.items() if len(some) > 1}


def _corner(three: list[Piece], first, second, reach: float) -> np.ndarray | None:
    """(3,) where three pieces meet, near the nearest points of two edges (k, 3) and (l, 3); None
    where that is farther than ``reach``."""
    away, near = cKDTree(first).query(second)
    nearest = int(away.argmin())
    if away[nearest] > reach:
        return None
    start = at = 0.5 * (first[near[nearest]] + second[nearest])
    for _ in range(_STEPS):
        distances, normals = zip(*(piece.at(at[None]) for piece in three), strict=True)
        matrix = np.concatenate(normals)
        if abs(np.linalg.det(matrix)) < _LEAST_DETERMINANT:
            return None
        at = at - np.linalg.solve(matrix, np.concatenate(distances))
    return at if float(np.linalg.norm(at - start)) <= reach else None
