"""Closest points of triangles, also where most of them are equally far."""

from functools import cached_property

import igl
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from touchatlas.sim.world.triangles import sample_triangles

# Queries at once: 8 MB of distances, and a moment's wait for Ctrl-C.
_BLOCK = 1000


class ClosestPoints:
    """The closest points of a mesh, whose trees are built once.

    They are exact but for points that are equally far from many triangles, as the centre of a ball
    is: no tree of boxes can leave one out there, and a query would visit all. For these the nearest
    of a thousand points of the mesh is taken, which is farther by less than 1 %.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    """

    def __init__(self, vertices, faces) -> None:
        self.vertices, self.faces = vertices, faces

    def __call__(self, points, rounding: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances (n,) of points (n, 3) from the mesh, faces (n,), and the closest points (n, 3)
        on them. Distances up to ``rounding``, length, are 0."""
        anchors, owners = self._anchors
        distance, index, feet = np.empty(len(points)), np.empty(len(points), int), points.copy()
        exact = np.ones(len(points), bool)
        near, nearest_anchor = self._anchor_tree.query(points, k=2)
        for some in _blocks(_in_doubt(near)):
            away = cdist(points[some], anchors)
            nearest = away.argmin(axis=1)
            least = away[np.arange(len(away)), nearest]
            exact[some] = (away <= 1.01 * least[:, None]).mean(axis=1) <= 0.02
            distance[some], index[some], feet[some] = least, owners[nearest], anchors[nearest]
        # Points one after another that are near each other find what they need of the tree in the
        # processor's cache.
        order = np.argsort(nearest_anchor[:, 0], kind="stable")
        for some in _blocks(order[exact[order]]):
            found = self._tree.squared_distance(self.vertices, self.faces, points[some])
            distance[some], index[some], feet[some] = np.sqrt(found[0]), found[1], found[2]
        return np.where(distance <= rounding, 0.0, distance), index, feet

    @cached_property
    def _anchors(self) -> tuple[np.ndarray, np.ndarray]:
        """A thousand points (k, 3) of the mesh, and their faces (k,)."""
        return sample_triangles(self.vertices, self.faces, 1000, np.random.default_rng(0))

    @cached_property
    def _anchor_tree(self) -> cKDTree:
        return cKDTree(self._anchors[0])

    @cached_property
    def _tree(self) -> igl.AABB:
        tree = igl.AABB()
        tree.init(self.vertices, self.faces)
        return tree


def _in_doubt(near) -> np.ndarray:
    """(d,) points that may be equally far from most of the mesh: from more than 2 % of the anchors
    at most 1 % farther than from the nearest one. Few have two anchors as far, of the distances
    ``near`` (n, 2) of the two nearest; the others need not be compared with all."""
    return np.flatnonzero(near[:, 1] <= 1.01 * near[:, 0])


def _blocks(rows) -> list[np.ndarray]:
    """Rows (n,) in blocks."""
    return [rows[start : start + _BLOCK] for start in range(0, len(rows), _BLOCK)]
