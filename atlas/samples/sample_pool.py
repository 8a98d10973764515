"""SamplePool: all samples of an atlas, each stored once."""

import numpy as np
from scipy.spatial import cKDTree

# Number of samples that a new pool has room for.
_ROOM = 256
_VECTORS = "points", "normals", "across"
NAMES = *_VECTORS, "edges", "noise", "contours", "measured", "touches"
# Number of the touch of samples that are of none.
NO_TOUCH = -1


class SamplePool:
    """One growing array for each property of the samples. The index of a sample never changes.

    Parameters
    ----------
    tip_radius : float, length
        Of the ball whose centres the samples are; 0 where they are contacts.

    Attributes
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward surface normals, as fitted to the sample's own touch.
    across : (n, 3) float, unit, world
        Normal of the sampling plane; the noise of a sample lies in that plane. Zero for a point
        that no curve was tracked through.
    edges : (n,) bool
        Whether the sample is the last of a contour that ended at an edge.
    noise : (n,) float, length
        Standard deviation of the sample's noise, as its contour states it.
    contours : (n,) int
        Number of the contour, ascending; a point that is of no curve has a number of its own.
    measured : (n,) bool
        Whether the probe measured the normal.
    touches : (n,) int
        Number of the touch, -1 of a scan.
    """

    points: np.ndarray
    normals: np.ndarray
    across: np.ndarray
    edges: np.ndarray
    noise: np.ndarray
    contours: np.ndarray
    measured: np.ndarray
    touches: np.ndarray

    def __init__(self) -> None:
        self.tip_radius, self._size = 0.0, 0
        self._columns: dict[str, np.ndarray] = {name: np.zeros((_ROOM, 3)) for name in _VECTORS}
        self._columns |= {"edges": np.zeros(_ROOM, bool), "noise": np.zeros(_ROOM)}
        self._columns |= {"contours": np.zeros(_ROOM, np.int32), "measured": np.zeros(_ROOM, bool)}
        self._columns["touches"] = np.zeros(_ROOM, np.int64)
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        # Tree of the samples that there were when it was built.
        self._tree: cKDTree | None = None

    def __len__(self) -> int:
        return self._size

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in NAMES:
            raise AttributeError(name)
        return self._columns[name][: self._size]

    def add(
        self,
        points,
        normals,
        across,
        edges,
        noise,
        contours=None,
        measured=False,
        touches=NO_TOUCH,
    ) -> np.ndarray:
        """Append samples: vectors (n, 3), flags (n,), lengths (n,), numbers (n,) of contours from 0
        on, a new one with each plane where they are not given, flags (n,), and numbers (n,) of
        touches. Returns their indices (n,)."""
        first, last = self._size, self._size + len(points)
        own = contours_of_planes(across) if contours is None else np.asarray(contours)
        start = int(self.contours[-1]) + 1 if first else 0
        values = points, normals, across, edges, noise, start + own, measured, touches
        for name, value in zip(NAMES, values, strict=True):
            self._columns[name] = _grown(self._columns[name], last)
            self._columns[name][first:last] = value
        self._size = last
        if last > first:
            self._low = np.minimum(self._low, np.min(points, axis=0))
            self._high = np.maximum(self._high, np.max(points, axis=0))
        return np.arange(first, last, dtype=np.int32)

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box of all samples, length."""
        return float(np.linalg.norm(self._high - self._low)) if self._size else 0.0

    def nearest(self, point) -> int:
        """Index of the sample nearest to a point (3,), length, world."""
        count = 0 if self._tree is None else self._tree.n
        if self._size > count + max(_ROOM, count // 8):
            self._tree, count = cKDTree(self.points), self._size
        later = self.points[count:] - point
        found = (later * later).sum(axis=1)
        first = self._tree.query(point)[1] if self._tree is not None else 0
        offset = self.points[first] - point
        if not len(found) or (offset * offset).sum() <= found.min():
            return int(first)
        return count + int(found.argmin())


def contours_of_planes(planes) -> np.ndarray:
    """(n,) numbers of contours of samples with the normals of their planes (n, 3): a new one begins
    where the plane changes, and with each sample of none."""
    planes = np.asarray(planes)
    new = (planes[1:] != planes[:-1]).any(axis=1) | ~planes[1:].any(axis=1)
    return np.concatenate([np.zeros(min(len(planes), 1), int), np.cumsum(new)])


def _grown(array: np.ndarray, rows: int) -> np.ndarray:
    """The array, or a copy of it that has room for a number of rows, and for an eighth more than
    before at least, so that many small steps copy each row few times."""
    if rows <= len(array):
        return array
    added = max(rows, len(array) * 9 // 8) - len(array)
    return np.concatenate([array, np.zeros((added, *array.shape[1:]), array.dtype)])
