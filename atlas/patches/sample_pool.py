"""Samples: every point that was ever touched, kept once."""

import numpy as np


class SamplePool:
    """Growing arrays over all samples of an atlas; an index never changes its meaning.

    Attributes
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward, as their own touch knew them.
    across : (n, 3) float, unit, world
        Normal of the plane that each was tracked in, and is noisy in; zero where unknown.
    edges : (n,) bool
        Whether it is the last of a contour that ended at an edge.
    """

    def __init__(self) -> None:
        self._size = 0
        self._columns = np.zeros((3, 256, 3))
        self._edges = np.zeros(256, bool)

    def __len__(self) -> int:
        return self._size

    @property
    def points(self) -> np.ndarray:
        return self._columns[0, : self._size]

    @property
    def normals(self) -> np.ndarray:
        return self._columns[1, : self._size]

    @property
    def across(self) -> np.ndarray:
        return self._columns[2, : self._size]

    @property
    def edges(self) -> np.ndarray:
        return self._edges[: self._size]

    def add(self, points, normals, across, edges) -> np.ndarray:
        """Enter samples (n, 3), edges (n,); returns their indices (n,)."""
        first, last = self._size, self._size + len(points)
        if last > self._columns.shape[1]:
            # An eighth more: memory is dearer here than one copy of all in a while.
            room = max(last, self._columns.shape[1] * 9 // 8)
            self._columns = np.concatenate(
                [self._columns[:, :first], np.zeros((3, room - first, 3))], axis=1
            )
            self._edges = np.concatenate([self._edges[:first], np.zeros(room - first, bool)])
        self._size = last
        self._columns[:, first:last] = points, normals, across
        self._edges[first:last] = edges
        return np.arange(first, last, dtype=np.int32)
