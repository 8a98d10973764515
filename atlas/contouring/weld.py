"""Weld: vertices of one place become one."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def weld(points, faces, tolerance: float):
    """Unite vertices of one place, those within ``tolerance`` of each other.

    Parameters
    ----------
    points : (v, 3) float, length
    faces : (f, 3) int
    tolerance : float, length

    Returns
    -------
    faces : (g, 3) int
        Without triangles that have become edges, and without pairs that lie on each other.
    kept : (w,) int
        Index of each vertex of the new faces among the old ones.
    """
    near = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(near)), near.T), (len(points), len(points)))
    _, group = connected_components(graph, directed=False)
    faces = np.unique(group, return_index=True)[1][group][faces]
    one, two, three = faces.T
    faces = faces[(one != two) & (two != three) & (three != one)]
    # Two triangles of the same vertices lie on each other and enclose nothing.
    corners = np.sort(faces)
    order = np.lexsort(corners.T)
    place = np.cumsum((np.diff(corners[order], axis=0, prepend=-1) != 0).any(axis=1))
    faces = faces[np.sort(order[np.bincount(place)[place] == 1])]
    kept, faces = np.unique(faces, return_inverse=True)
    return faces.reshape(-1, 3), kept
