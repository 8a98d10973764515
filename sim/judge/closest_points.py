"""Closest points of triangles, also where most of them are equally far."""

import igl
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from touchatlas.sim.world.triangles import sample_triangles


def closest_points(points, vertices, faces, rounding: float = 0.0):
    """Distances (n,) of points from a mesh, faces (n,), and the closest points (n, 3) on them.

    Distances up to ``rounding``, length, are 0.

    They are exact but for points that are equally far from many triangles, as the centre of a ball
    is: no tree of boxes can leave one out there, and a query would visit all. For these the nearest
    of a thousand points of the mesh is taken, which is farther by less than 1 %.
    """
    anchors, owners = sample_triangles(vertices, faces, 1000, np.random.default_rng(0))
    distance, index, feet = np.empty(len(points)), np.empty(len(points), int), points.copy()
    # Few points have two anchors as far; the others need not be compared with all.
    nearest = cKDTree(anchors).query(points, k=2)[0]
    # A query is equally far from most of the mesh if more than 2 % of the anchors are at most 1 %
    # farther than the nearest one.
    doubt = np.flatnonzero(nearest[:, 1] <= 1.01 * nearest[:, 0])
    exact = np.ones(len(points), bool)
    # A thousand queries at once: 8 MB of distances, and a moment's wait for Ctrl-C.
    for start in range(0, len(doubt), 1000):
        some = doubt[start : start + 1000]
        away = cdist(points[some], anchors)
        nearest = away.argmin(axis=1)
        least = away[np.arange(len(away)), nearest]
        exact[some] = (away <= 1.01 * least[:, None]).mean(axis=1) <= 0.02
        distance[some], index[some], feet[some] = least, owners[nearest], anchors[nearest]
    rows = np.flatnonzero(exact)
    if len(rows):
        tree = igl.AABB()
        tree.init(vertices, faces)
        for start in range(0, len(rows), 1000):
            some_rows = rows[start : start + 1000]
            square, found, places = tree.squared_distance(vertices, faces, points[some_rows])
            distance[some_rows], index[some_rows], feet[some_rows] = np.sqrt(square), found, places
    return np.where(distance <= rounding, 0.0, distance), index, feet
