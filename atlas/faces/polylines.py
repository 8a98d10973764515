"""Polylines: points of curves, put in order."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree


def polylines(points, deviation, spacing: float, reach: float) -> list[np.ndarray]:
    """Indices of points (m, 3) in the order of the curves on which they lie.

    Parameters
    ----------
    points : (m, 3) float, length
    deviation : (m,) float, length
        Of two points that are near to each other the more accurate one is kept.
    spacing : float, length
        Least distance of points that are kept.
    reach : float, length
        Longest gap within a curve. A curve whose ends are no farther apart is closed, and begins
        and ends with the same point.

    Notes
    -----
    Each curve is the longest path in the minimum spanning tree of its points.

    Examples
    --------
    >>> angle = np.arange(20) / 20 * 2 * np.pi
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> [line.size for line in polylines(circle, 0 * angle, 0.1, 0.5)]
    [21]
    """
    kept = _spaced(points, deviation, spacing)
    pairs = cKDTree(points[kept]).query_pairs(reach, output_type="ndarray")
    lengths = np.linalg.norm(points[kept[pairs[:, 0]]] - points[kept[pairs[:, 1]]], axis=1)
    size = len(kept)
    tree = minimum_spanning_tree(coo_matrix((lengths, pairs.T), shape=(size, size))).tocoo()
    around: list[dict[int, float]] = [{} for _ in kept]
    for a, b, length in zip(tree.row.tolist(), tree.col.tolist(), tree.data.tolist(), strict=True):
        around[a][b] = around[b][a] = length
    lines: list[np.ndarray] = []
    seen: set[int] = set()
    for node in range(size):
        if node not in seen:
            away, _ = _walk(around, node)
            seen |= away.keys()
            lines.append(kept[_longest_path(around, _farthest(away))])
    return [_closed(line, points, reach) for line in lines if len(line) > 1]


def _spaced(points, deviation, spacing: float) -> np.ndarray:
    """Points no two of which are nearer than the spacing, the most accurate first; ascending."""
    near = cKDTree(points).query_ball_point(points, spacing)
    free, kept = np.ones(len(points), bool), []
    for i in np.argsort(deviation, kind="stable").tolist():
        if free[i]:
            kept.append(i)
            free[near[i]] = False
    return np.sort(np.array(kept, dtype=int))


def _walk(around: list[dict[int, float]], start: int) -> tuple[dict[int, float], dict[int, int]]:
    """Distances from a node of a tree to all others that hang together with it, and the nodes
    before these on the way."""
    away, before, nodes = {start: 0.0}, {}, [start]
    for node in nodes:
        for other, length in around[node].items():
            if other not in away:
                away[other], before[other] = away[node] + length, node
                nodes.append(other)
    return away, before


def _farthest(away: dict[int, float]) -> int:
    """The first of the nodes that are farthest away."""
    return min(away, key=lambda node: (-away[node], node))


def _longest_path(around: list[dict[int, float]], end: int) -> list[int]:
    """The longest path in a tree, to one of its ends."""
    away, before = _walk(around, end)
    path = [_farthest(away)]
    while path[-1] != end:
        path.append(before[path[-1]])
    return path


def _closed(line, points, reach: float) -> np.ndarray:
    """A line with its first point again at its end, where both ends are near."""
    ends = np.linalg.norm(points[line[0]] - points[line[-1]])
    around = np.linalg.norm(np.diff(points[line], axis=0), axis=1).sum()
    return np.append(line, line[0]) if len(line) > 3 and ends <= reach < 0.5 * around else line
