"""LostEnds: ends of contours at which contact was lost, and which of them lie side by side."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.contour import Contour, ContourEnd

# A sample ahead of an end, nearer than the first number of spacings and farther on than the second,
# shows that the surface goes on: the probe slipped. With the first doubled, the far side of a hole
# of four spacings refutes both sides; with the second doubled, curves that cross there refute less.
_NEAR, AHEAD = 2.0, 0.5
# Least cosine of the angle between the direction of travel and such a sample: 30 degrees. Doubled
# in angle, curves that end beside a contour along the rim refute it.
_ALONG = 0.87
# Least cosine of the angle between the surface normals at the ends of one rim: 120 degrees, for a
# bowl. Doubled, to -1, the far side of a thin wall has the same rim.
_OPPOSITE = -0.5
# Largest cosines between the directions of travel at two ends, and between that at one and the way
# to the other, at which the other is reached the other way and lies behind: it is at another rim,
# as the outer rim of a ring is to its hole. Doubled, more of them pass for one rim; halved, ends
# that are far apart on a round rim are no longer side by side.
_OPPOSED, _BEHIND = -0.3, -0.2
# Number of spacings over which the direction of travel at an end is measured. Doubled, it has half
# the noise and twice the error from curvature.
_RUN = 2.0
# Distances of the ends that shape a rim, in spacings. The first is the least, because an end lies
# up to an eighth of one off the rim; doubled, rims bend less from one end to the next. Ends farther
# than the second that lie ahead or behind as the contour ran may be at another rim; doubled, both
# ends of a short tube pass for one.
_APART, _LOCAL = 2.0, 10.0


class LostEnds:
    """Ends of contours at which contact was lost, as arrays over the ends.

    Parameters
    ----------
    pool : SamplePool
        All samples.

    Attributes
    ----------
    points : (n, 3) float, length, world
        The last samples before contact was lost.
    tangents : (n, 3) float, unit, world
        Direction of travel there.
    normals : (n, 3) float, unit, world
        Outward normals of the surface there.
    steps : (n,) float, length
        Distance between samples.
    touches : (n,) int
        Number of samples that were known before the touch of each end: ends of one touch have one.

    Notes
    -----
    An end beyond which samples lie shows a slip of the probe; the others are *open*.
    """

    NAMES = "points", "tangents", "normals", "steps", "touches"

    def __init__(self, pool: SamplePool) -> None:
        self._pool = pool
        self.points, self.tangents, self.normals = (np.zeros((0, 3)) for _ in range(3))
        self.steps, self.touches = np.zeros(0), np.zeros(0, int)
        self._open, self._known = np.zeros(0, int), -1

    def __len__(self) -> int:
        return len(self.points)

    def extend(self, contours: Sequence[Contour], normals: Sequence[np.ndarray]) -> None:
        """Add the lost ends of the contours of a touch whose samples the pool does not have yet,
        with the surface normals (k, 3) at the points of each."""
        found = [
            (*end, normal[-side])
            for contour, normal in zip(contours, normals, strict=True)
            for side in (0, 1)
            if contour.ends[side] is ContourEnd.LOST_CONTACT
            and (end := _ahead(contour.learned_points(self._pool.tip_radius), side)) is not None
        ]
        if not found:
            return
        points, tangents, steps, upward = (np.array(column) for column in zip(*found, strict=True))
        new = points, tangents, upward, steps, np.full(len(found), len(self._pool))
        for name, values in zip(self.NAMES, new, strict=True):
            setattr(self, name, np.concatenate([getattr(self, name), values]))

    def open(self) -> np.ndarray:
        """(k,) the ends beyond which no sample lies."""
        if self._known != len(self._pool):
            self._known = len(self._pool)
            tree = cKDTree(self._pool.points) if len(self) else None
            self._open = np.array(
                [i for i in range(len(self)) if not self._is_passed(i, tree)], int
            )
        return self._open

    def _is_passed(self, i: int, samples) -> bool:
        """Whether samples lie beyond an end."""
        near = samples.query_ball_point(self.points[i], _NEAR * self.steps[i])
        offset = self._pool.points[near] - self.points[i]
        length, ahead = np.sqrt((offset * offset).sum(axis=1)), offset @ self.tangents[i]
        return bool(((ahead > AHEAD * self.steps[i]) & (ahead > _ALONG * length)).any())

    def beside(self, i: int) -> tuple[list[int], bool]:
        """The nearest other open end and the nearest on the other side, and whether there is one;
        where not, the next one after the nearest."""
        first = self._next(i)
        if first is None:
            return [], False
        second = self._next(i, self.points[first])
        if second is not None:
            return [first, second], True
        after = self._next(first, self.points[i])
        after = self._next(i, but=first) if after is None else after
        return ([first] if after is None else [first, after]), False

    def _next(self, i: int, beyond=None, but: int | None = None) -> int | None:
        """The open end of the same sheet that is nearest to an end; of those on its other side as
        seen from a point ``beyond`` (3,), or of those away from another end ``but``; None where
        there is none."""
        same = self.open()[self.normals[self.open()] @ self.normals[i] > _OPPOSITE]
        offset = self.points[same] - self.points[i]
        length = np.sqrt((offset * offset).sum(axis=1))
        along = offset @ self.tangents[i]
        some = (length > _APART * self.steps[i]) & (
            (length < _LOCAL * self.steps[i]) | (np.abs(along) < _ALONG * length)
        )
        # What lies behind, and was reached the other way, is another rim.
        opposed = self.tangents[same] @ self.tangents[i] < _OPPOSED
        some &= ~(opposed & (along < _BEHIND * length))
        if beyond is not None:
            some &= offset @ (beyond - self.points[i]) < 0.0
        if but is not None:
            away = self.points[same] - self.points[but]
            some &= (away * away).sum(axis=1) > (_APART * self.steps[i]) ** 2
        return int(same[some][length[some].argmin()]) if some.any() else None


def _ahead(points, side: int) -> tuple[np.ndarray, np.ndarray, float] | None:
    """The end of a contour of points (n, 3), the unit direction of travel there, and the spacing of
    samples; None where the probe stood still."""
    points = points if side else points[::-1]
    steps, offset = np.diff(points, axis=0), points[-1] - points
    length = np.sqrt((steps * steps).sum(axis=1))
    # A probe that stands still moves by its noise across the plane alone.
    if not length.any():
        return None
    spacing, away = float(np.median(length[length > 0.0])), np.sqrt((offset * offset).sum(axis=1))
    far = np.flatnonzero(away >= min(_RUN * spacing, away.max()))
    return points[-1], offset[far[-1]] / away[far[-1]], spacing
