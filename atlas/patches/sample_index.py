"""SampleIndex: which samples lie near a point, as samples are added."""

import numpy as np
from scipy.spatial import cKDTree

# Fraction of all samples that may be outside of the tree; a query looks at each of them. Doubled,
# the tree is rebuilt half as often and queries look at twice as many.
_OUTSIDE = 0.25


class SampleIndex:
    """A k-d tree of the samples, rebuilt when many have been added since.

    Examples
    --------
    >>> index = SampleIndex()
    >>> points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    >>> [found.tolist() for found in index.near(points, [[0.4, 0.0, 0.0]], [0.7])]
    [[0, 1]]
    """

    def __init__(self) -> None:
        self._tree: cKDTree | None = None

    def near(self, points, centres, radii) -> list[np.ndarray]:
        """Ascending indices of the points (n, 3) within each of some balls.

        Parameters
        ----------
        points : (n, 3) float, length
            All samples. Those of an earlier call must come first, unchanged.
        centres : (m, 3) float, length
        radii : (m,) float, length
        """
        inside = self._built_for(points)
        if self._tree is None:
            return [np.zeros(0, np.int32) for _ in radii]
        found = self._tree.query_ball_point(centres, radii, return_sorted=True)
        out = []
        for some, centre, radius in zip(found, np.asarray(centres, float), radii, strict=True):
            new = np.flatnonzero(_in_ball(points[inside:], centre, radius)) + inside
            out.append(np.concatenate([np.array(some, np.int32), new.astype(np.int32)]))
        return out

    def count(self, points, centres, radii) -> np.ndarray:
        """(m,) numbers of the points within each of some balls: see ``near``."""
        inside = self._built_for(points)
        if self._tree is None:
            return np.zeros(len(radii), int)
        found = np.array(self._tree.query_ball_point(centres, radii, return_length=True), int)
        pairs = zip(np.asarray(centres, float), radii, strict=True)
        later = [np.count_nonzero(_in_ball(points[inside:], *pair)) for pair in pairs]
        return found + np.array(later, int)

    def _built_for(self, points) -> int:
        """Number of the points (n, 3) that are in the tree, which is built again if it is due."""
        inside = self._tree.n if self._tree is not None else 0
        if len(points) > (1.0 + _OUTSIDE) * inside:
            self._tree, inside = cKDTree(points), len(points)
        return inside


def _in_ball(points, centre, radius: float) -> np.ndarray:
    """(n,) whether points (n, 3) lie within a ball."""
    offset = points - centre
    return np.asarray((offset * offset).sum(axis=1) <= radius * radius)
