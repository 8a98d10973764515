"""Edge collapse: the ends of edges of no extent become one vertex."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def collapsed(points, faces, least: float) -> np.ndarray:
    """(v,) the vertex that each becomes when edges shorter than ``least`` (length) of triangles
    (f, 3) between points (v, 3) are collapsed: the first of those that become one."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    square = ((points[ends[:, 1]] - points[ends[:, 0]]) ** 2).sum(axis=1)
    first, second = ends[square < least * least].T
    graph = coo_array((np.ones(len(first)), (first, second)), (len(points), len(points)))
    group = connected_components(graph, directed=False)[1]
    return np.asarray(np.unique(group, return_index=True)[1][group])
