"""Polylines: points of curves, put in order."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import (
    breadth_first_order,
    connected_components,
    dijkstra,
    minimum_spanning_tree,
)
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
    tree = minimum_spanning_tree(coo_matrix((lengths, pairs.T), shape=(size, size)))
    _, part = connected_components(tree, directed=False)
    lines = [
        _longest_path(tree, np.flatnonzero(part == k)) for k in range(part.max(initial=-1) + 1)
    ]
    return [_closed(kept[line], points, reach) for line in lines if len(line) > 1]


def _spaced(points, deviation, spacing: float) -> np.ndarray:
    """Points no two of which are nearer than the spacing, the most accurate first; ascending."""
    near = cKDTree(points).query_ball_point(points, spacing)
    free, kept = np.ones(len(points), bool), []
    for i in np.argsort(deviation, kind="stable").tolist():
        if free[i]:
            kept.append(i)
            free[near[i]] = False
    return np.sort(np.array(kept, dtype=int))


def _longest_path(tree, nodes) -> np.ndarray:
    """The longest path in the part of a tree that has the nodes."""
    away = dijkstra(tree, directed=False, indices=nodes[0])
    end = nodes[away[nodes].argmax()]
    away = dijkstra(tree, directed=False, indices=end)
    _, before = breadth_first_order(tree, end, directed=False)
    path = [int(nodes[away[nodes].argmax()])]
    while path[-1] != end:
        path.append(int(before[path[-1]]))
    return np.array(path)


def _closed(line, points, reach: float) -> np.ndarray:
    """A line with its first point again at its end, where both ends are near."""
    ends = np.linalg.norm(points[line[0]] - points[line[-1]])
    around = np.linalg.norm(np.diff(points[line], axis=0), axis=1).sum()
    return np.append(line, line[0]) if len(line) > 3 and ends <= reach < 0.5 * around else line
