"""Closest points of triangles, also where most of them are equally far."""

import igl
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from touchatlas.sim.world.triangles import sample_triangles

# Points of the mesh with which each query is compared first. Doubled, the comparison takes twice as
# long, and distances that are estimated err by half as much.
_ANCHORS = 1000
# A query is equally far from most of a mesh if more than this fraction of the anchors are no
# farther than this factor of the nearest one. Doubled, the tree has to visit twice as many
# triangles; distances that are estimated err by less than the factor says.
_MANY, _AS_FAR = 0.02, 1.01
# Queries asked at once: 8 MB of distances. Ctrl-C waits for them, as no signal is heard within a
# compiled call. Doubled, it takes twice the memory, and Ctrl-C twice as long.
_AT_ONCE = 1000


def closest_points(points, vertices, faces):
    """Distances (n,) of points from a mesh, faces (n,), and the closest points (n, 3) on them.

    They are exact but for points that are equally far from many triangles, as the centre of a ball
    is: no tree of boxes can leave one out there, and a query would visit all. For these the nearest
    of a thousand points of the mesh is taken, which is farther by less than 1 %.
    """
    anchors, owners = sample_triangles(vertices, faces, _ANCHORS, np.random.default_rng(0))
    distance, index, feet = np.empty(len(points)), np.empty(len(points), int), points.copy()
    # Few points have two anchors as far; the others need not be compared with all.
    nearest = cKDTree(anchors).query(points, k=2)[0]
    doubt = np.flatnonzero(nearest[:, 1] <= _AS_FAR * nearest[:, 0])
    exact = np.ones(len(points), bool)
    for start in range(0, len(doubt), _AT_ONCE):
        some = doubt[start : start + _AT_ONCE]
        away = cdist(points[some], anchors)
        nearest = away.argmin(axis=1)
        least = away[np.arange(len(away)), nearest]
        exact[some] = (away <= _AS_FAR * least[:, None]).mean(axis=1) <= _MANY
        distance[some], index[some], feet[some] = least, owners[nearest], anchors[nearest]
    rows = np.flatnonzero(exact)
    if len(rows):
        tree = igl.AABB()
        tree.init(vertices, faces)
        for start in range(0, len(rows), _AT_ONCE):
            some_rows = rows[start : start + _AT_ONCE]
            square, found, places = tree.squared_distance(vertices, faces, points[some_rows])
            distance[some_rows], index[some_rows], feet[some_rows] = np.sqrt(square), found, places
    return distance, index, feet
