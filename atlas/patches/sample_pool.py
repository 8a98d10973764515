"""Samples: every point that was ever touched, kept once."""

import numpy as np

# Room for so many samples at first. Twice as much wastes 30 kB.
_ROOM = 256
_VECTORS, _FLAGS = ("points", "normals", "across"), ("edges", "visited")


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
    visited : (n,) bool
        Whether a touch about the place brought no patch of its own: another would not, either.
    """

    points: np.ndarray
    normals: np.ndarray
    across: np.ndarray
    edges: np.ndarray
    visited: np.ndarray

    def __init__(self) -> None:
        self._size = 0
        self._columns: dict[str, np.ndarray] = {name: np.zeros((_ROOM, 3)) for name in _VECTORS}
        self._columns |= {name: np.zeros(_ROOM, bool) for name in _FLAGS}

    def __len__(self) -> int:
        return self._size

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in (*_VECTORS, *_FLAGS):
            raise AttributeError(name)
        return self._columns[name][: self._size]

    def add(self, points, normals, across, edges, visited=False) -> np.ndarray:
        """Enter samples (n, 3), flags (n,); returns their indices (n,)."""
        first, last = self._size, self._size + len(points)
        if last > len(self._columns["points"]):
            # An eighth more: memory is dearer here than one copy of all in a while.
            room = max(last, len(self._columns["points"]) * 9 // 8) - first
            for name, column in self._columns.items():
                more = np.zeros((room, *column.shape[1:]), column.dtype)
                self._columns[name] = np.concatenate([column[:first], more])
        self._size = last
        values = points, normals, across, edges, visited
        for name, value in zip((*_VECTORS, *_FLAGS), values, strict=True):
            self._columns[name][first:last] = value
        return np.arange(first, last, dtype=np.int32)
