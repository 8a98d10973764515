"""SamplePool: all samples of an atlas, each stored once."""

import numpy as np

from touchatlas.patch.geometry.arrays import box_diagonal

NAMES = "points", "normals", "across", "edges", "noise", "contours", "measured", "touches"
# Number of the touch of samples that are of none.
NO_TOUCH = -1


class SamplePool:
    """One growing array for each property of the samples. The index of a sample never changes.

    Attributes
    ----------
    tip_radius : float, length
        Of the ball whose centres the samples are; 0 where they are contacts.
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

    def __init__(self) -> None:
        self.tip_radius = 0.0
        self.points, self.normals, self.across = (np.zeros((0, 3)) for _ in range(3))
        self.edges, self.measured = np.zeros(0, bool), np.zeros(0, bool)
        self.noise, self.contours = np.zeros(0), np.zeros(0, np.int32)
        self.touches = np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self.points)

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
    ) -> None:
        """Append samples: vectors (n, 3), flags (n,), lengths (n,), numbers (n,) of contours from 0
        on, a new one with each plane where they are not given, flags (n,), and numbers (n,) of
        touches."""
        own = contours_of_planes(across) if contours is None else np.asarray(contours)
        start = int(self.contours[-1]) + 1 if len(self) else 0
        values = points, normals, across, edges, noise, start + own, measured, touches
        grown = {}
        for name, value in zip(NAMES, values, strict=True):
            old = getattr(self, name)
            new = np.empty((len(points), *old.shape[1:]), old.dtype)
            new[:] = value
            grown[name] = np.concatenate([old, new])
        vars(self).update(grown)

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box of all samples, length."""
        return box_diagonal(self.points)

    def nearest(self, point) -> int:
        """Index of the sample nearest to a point (3,), length, world."""
        return int(((self.points - point) ** 2).sum(axis=1).argmin())


def contours_of_planes(planes) -> np.ndarray:
    """(n,) numbers of contours of samples with the normals of their planes (n, 3): a new one begins
    where the plane changes, and with each sample of none."""
    planes = np.asarray(planes)
    new = (planes[1:] != planes[:-1]).any(axis=1) | ~planes[1:].any(axis=1)
    return np.concatenate([np.zeros(min(len(planes), 1), int), np.cumsum(new)])
