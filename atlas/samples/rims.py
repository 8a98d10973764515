"""Rims: where contours lost contact and nothing was met beyond, the surface ends."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.samples.lost_ends import AHEAD, LostEnds
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import cross

# A rim has the samples near it on one side: those within the first number of spacings, or to the
# next end if that is farther; the second fraction of them may lie on the other side. With the first
# doubled, rims of small holes are none; with the second doubled, wrong ones pass.
_LEAST, _STRAY = 4.0, 0.1
# Fraction of the samples nearest to an end that may lie beyond its rim. At the corners of sheets
# some do. Doubled, a slip of the probe cuts off what is on one side of it.
_REFUTED = 0.25
# Weight of the distance of rims that are drawn on from the next ends: they err by about twice as
# much as those between their ends. Doubled, round rims are touched twice as often.
_DRAWN_ON = 0.5
# Where ends lie close together, a rim counts for points up to so many times as far from its end as
# from the nearest sample. With 3 or 5, as much of balls with holes is taken to be open.
_SPEAKS = 4.0
# Number of the nearest ends whose rims are looked at. Doubled, nothing changes.
_ASKED = 4


class Rims:
    """The rims of the surface that lost ends of contours show.

    Parameters
    ----------
    pool : SamplePool
        All samples.

    Attributes
    ----------
    ends : LostEnds

    Notes
    -----
    At an open end the surface ends where it meets a sphere: that through the end and the next one
    on each side which is perpendicular to the surface there. On a plane and on a ball, circles are
    its rims. At an end alone the rim is taken to lie across the direction of travel.
    """

    def __init__(self, pool: SamplePool) -> None:
        self._pool, self.ends = pool, LostEnds(pool)
        self._known = -1

    def __bool__(self) -> bool:
        return len(self.ends) > 0

    def __len__(self) -> int:
        """Number of ends at which the surface is taken to end."""
        self._update()
        return len(self._home)

    def beyond(self, points, normals) -> np.ndarray:
        """(m,) whether points (m, 3) near the surface, with its normals (m, 3), lie beyond a rim:
        see ``shown_beyond``."""
        return self.shown_beyond(points, normals) > 0

    def shown_beyond(self, points, normals) -> np.ndarray:
        """(m,) number of touches that show the rim beyond which points (m, 3) near the surface,
        with its normals (m, 3), lie: 0 where they lie beyond none, and 2 where it is more than one.

        A rim lies between such a point and the sample nearest to it: the point is ahead of the rim
        and the sample is not. Rims at the nearest ends of its sheet are looked at, each as far as
        half-way to the next ends: about a point amid samples one drawn on farther says nothing.
        """
        points = np.asarray(points, float).reshape(-1, 3)
        self._update()
        if not len(self._home):
            return np.zeros(len(points), int)
        which, beyond = self._passed(points, normals)
        return np.asarray(np.where(beyond, self._shown[which], 0))

    def _holds(self, which, samples) -> np.ndarray:
        """(m,) whether samples (m, 3) lie within the rims at ends ``which`` (m,)."""
        return self._ahead_of(which, samples) <= AHEAD * self.ends.steps[self._home[which]]

    def _passed(self, points, normals) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the nearest rim between points (m, 3) of a sheet and the samples nearest to them,
        and whether there is one."""
        near, facing = self._near(points, normals)
        away, nearest = self._samples.query(points)
        samples, passed = self._pool.points[nearest], np.zeros(near.shape, bool)
        for k, which in enumerate(near.T):
            passed[:, k] = self._speak(which, points, away) & self._holds(which, samples)
            passed[:, k] &= facing[:, k] & (self._ahead_of(which, points) > 0.0)
        return near[np.arange(len(points)), passed.argmax(axis=1)], np.any(passed, axis=1)

    def _speak(self, which, points, away) -> np.ndarray:
        """(m,) whether rims at ends ``which`` (m,) are near enough to points (m, 3), whose nearest
        samples are ``away`` (m,), length, to say anything of them: half-way to the next ends, or
        not much farther than the samples."""
        home = self._home[which]
        far = np.sqrt(((points - self.ends.points[home]) ** 2).sum(axis=1))
        least = np.maximum(self._half[which], _SPEAKS * self.ends.steps[home])
        return np.asarray(far <= np.maximum(least, _SPEAKS * away))

    def _near(self, points, normals) -> tuple[np.ndarray, np.ndarray]:
        """(m, k) the rims at the ends nearest to points (m, 3), the nearest first, and whether they
        are of their sheet."""
        asked = min(_ASKED, len(self._home))
        near = self._tree.query(points, k=asked)[1].reshape(len(points), asked)
        facing = np.einsum("mki,mi->mk", self.ends.normals[self._home[near]], normals) > 0.0
        return near, facing

    def onto(self, points, normals) -> np.ndarray:
        """(m, 3) points (m, 3) that lie beyond rims, with surface normals (m, 3), moved onto them
        over the tangent plane, length, world."""
        if not len(points):
            return np.asarray(points)
        for _ in range(2):
            # At a corner the point of one rim may lie beyond the other.
            which, beyond = self._passed(points, normals)
            out = self._across[which] - self._bend[which, None] * (
                points - self.ends.points[self._home[which]]
            )
            out -= (out * normals).sum(axis=1)[:, None] * normals
            length = np.sqrt((out * out).sum(axis=1))[:, None]
            out /= np.maximum(length, np.finfo(float).tiny)
            points = points - np.where(beyond, self._ahead_of(which, points), 0.0)[:, None] * out
        return np.asarray(points)

    def unsure(self, limit: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places half-way between ends where the rims at both and at the next ones on either side,
        drawn on, do not meet, and as far beyond the last ends of a rim as the next ones are.

        Parameters
        ----------
        limit : float, length
            Distance of rims that needs no touch. A quarter of a spacing comes to it, because an end
            may lie an eighth off the rim.

        Returns
        -------
        points : (k, 3) float, length, world
            Within the rims by their distance, and by a spacing at least.
        normals : (k, 3) float, unit, world
        apart : (k,) float, length
            Distance of the rims, or of the place from the next end where one shows none.
        """
        self._update()
        pairs: set[tuple[int, int]] = set()
        found = []
        for i in self.ends.open().tolist():
            beside, both = self.ends.beside(i)
            pairs.update((min(i, j), max(i, j)) for j in (beside if both else beside[:1]))
            if not both:
                before = self.ends.points[beside[0] if beside else i]
                found.append(self._place(2.0 * self.ends.points[i] - before, [i], limit))
        for pair in sorted(pairs):
            found.append(self._place(self.ends.points[[*pair]].mean(axis=0), pair, limit))
        kept = [place for place in found if place is not None]
        points, normals, apart = zip(*kept, strict=True) if kept else ((),) * 3
        return np.reshape(points, (-1, 3)), np.reshape(normals, (-1, 3)), np.array(apart)

    def _place(self, point, ends, limit: float):
        """The place within the rims at one or two ends that is nearest to a point (3,), its normal,
        and the distance of the rims there, those at the next ends included; None where that needs
        no touch."""
        normal = self.ends.normals[[*ends]].sum(axis=0)
        normal = normal / np.sqrt(normal @ normal)
        step, gap = self.ends.steps[[*ends]].max(), point - self.ends.points[ends[0]]
        apart = float(np.sqrt(gap @ gap)) or np.inf
        back = _LEAST * step * self.ends.tangents[ends[0]]
        rims = [k for k in ends if k in self._rims]
        if rims:
            ahead = self._ahead_at(point, rims)
            if len(rims) > 1:
                beside = {k for i in ends for k in self.ends.beside(i)[0] if k in self._rims}
                drawn_on = self._ahead_at(point, sorted(beside.union(rims)))
                apart = float(max(np.ptp(ahead), _DRAWN_ON * np.ptp(drawn_on)))
            back = _unit(np.sum([self._rims[k][0] for k in rims], axis=0))
            back = (float(ahead.mean()) + min(max(step, apart), _LEAST * step)) * back
        return (point - back, normal, apart) if apart > limit + 0.25 * step else None

    def at(self, points, limit: float) -> np.ndarray:
        """(m,) whether points (m, 3) lie at the rim of one of the nearest ends, to a limit, length,
        and a quarter of a spacing."""
        self._update()
        if not len(self._home):
            return np.zeros(len(points), bool)
        asked, away = min(_ASKED, len(self._home)), self._samples.query(points)[0]
        out = np.zeros(len(points), bool)
        for which in self._tree.query(points, k=asked)[1].reshape(len(points), asked).T:
            near = limit + 0.25 * self.ends.steps[self._home[which]]
            at = np.abs(self._ahead_of(which, points)) <= near
            out |= at & self._speak(which, points, away)
        return out

    def _ahead_at(self, point, ends: list[int]) -> np.ndarray:
        """(k,) distance of a point (3,) ahead of the rims at some ends, length."""
        return self._ahead_of(np.searchsorted(self._home, ends), point[None])

    def _ahead_of(self, which, points) -> np.ndarray:
        """(m,) distance of points (m, 3) ahead of the rims at ends ``which`` (m,), length."""
        home = self._home[which]
        return _ahead_of_sphere(
            points - self.ends.points[home], self._across[which], self._bend[which]
        )

    def _update(self) -> None:
        """Find the rims again where samples were added."""
        if self._known == len(self._pool):
            return
        self._known = len(self._pool)
        if len(self.ends):
            self._samples = cKDTree(self._pool.points)
        found = {i: self._rim_at(i) for i in self.ends.open().tolist()}
        self._rims = {i: rim for i, rim in found.items() if rim is not None}
        self._index_rims()
        if self._rims:
            # What lies beyond a rim was not touched. Where it was the probe slipped.
            near, facing = self._near(self._pool.points, self._pool.normals)
            # The nearest rim of the sheet of each sample, and whether there is one.
            which = near[np.arange(len(near)), facing.argmax(axis=1)]
            facing = np.any(facing, axis=1)
            of_rim = np.bincount(which[facing], minlength=len(self._home))
            facing &= ~self._holds(which, self._pool.points)
            beyond = np.bincount(which[facing], minlength=len(self._home))
            for i in self._home[beyond > _REFUTED * of_rim].tolist():
                del self._rims[i]
            self._index_rims()

    def _index_rims(self) -> None:
        """Arrays of the rims, and a tree of their ends."""
        self._home = np.array(list(self._rims), int)
        if self._rims:
            columns = zip(*self._rims.values(), strict=True)
            self._across, self._bend = (np.array(column) for column in columns)
            self._half = 0.5 * np.array([self._farthest(i) for i in self._home.tolist()])
            touches = [self.ends.touches[[i, *self.ends.beside(i)[0]]] for i in self._home.tolist()]
            self._shown = np.array([min(len(np.unique(some)), 2) for some in touches])
            self._tree = cKDTree(self.ends.points[self._home])

    def _farthest(self, i: int) -> float:
        """Distance from an end to the farther one of the next ends, length; 0 without any."""
        offset = self.ends.points[self.ends.beside(i)[0]] - self.ends.points[i]
        return float(np.sqrt((offset * offset).sum(axis=1)).max(initial=0.0))

    def _rim_at(self, i: int) -> tuple[np.ndarray, float] | None:
        """The rim at an end: the direction (3,) out of the surface, and the curvature, 1/length, of
        the sphere through the end and the next ones that meets the surface at right angles there;
        positive about an opening. None where they show no rim."""
        beside = self.ends.points[self.ends.beside(i)[0]] - self.ends.points[i]
        for count in range(len(beside), -1, -1):
            rim = self._checked(i, beside[:count])
            if rim is not None:
                return rim
        return None

    def _checked(self, i: int, beside) -> tuple[np.ndarray, float] | None:
        """The rim at an end through points at offsets ``beside`` (k, 3), or across the direction of
        travel without any; None where samples lie on both sides of it."""
        normal, reach = self.ends.normals[i], _LEAST * self.ends.steps[i]
        across, bend = self.ends.tangents[i], 0.0
        if len(beside):
            across, bend = _sphere(beside, normal)
            if not across.any():
                return None
            reach = max(reach, float(np.sqrt((beside * beside).sum(axis=1).max())))
        near = np.array(self._samples.query_ball_point(self.ends.points[i], reach))
        near = near[self._pool.normals[near] @ normal > 0.0]
        ahead = _ahead_of_sphere(self._pool.points[near] - self.ends.points[i], across, bend)
        sign = -1.0 if ahead.sum() > 0.0 else 1.0
        if (sign * ahead > AHEAD * self.ends.steps[i]).mean() > _STRAY:
            return None
        return sign * across, sign * bend


def _sphere(beside, normal) -> tuple[np.ndarray, float]:
    """Direction (3,) to the centre, perpendicular to ``normal``, and curvature, 1/length, of the
    sphere through zero and one or two points ``beside`` (k, 3); a plane through one point. The
    direction is zero where none is that of all spheres, because a point lies along the normal."""
    first = _unit(cross(cross(normal, beside[0]), normal))
    second = cross(normal, first)
    if len(beside) < 2:
        return second, 0.0
    # Through zero with unit normal n there: 2 (n d) = bend |d|^2.
    flat, square = beside @ np.stack([first, second], axis=1), (beside * beside).sum(axis=1)
    x, y = square[1] * flat[0] - square[0] * flat[1]
    length = np.hypot(x, y)
    across = (x * second - y * first) / max(length, np.finfo(float).tiny)
    return across, 2.0 * float(across @ beside[0]) / float(square[0])


def _unit(vector) -> np.ndarray:
    """A vector (3,) divided by its length; zero stays zero."""
    out: np.ndarray = vector / max(np.sqrt(vector @ vector), np.finfo(float).tiny)
    return out


def _ahead_of_sphere(offset, across, bend) -> np.ndarray:
    """(m,) signed distance of offsets (m, 3) from spheres through zero with unit normals (3,) or
    (m, 3) and curvatures there, length: positive on the side of the normal."""
    twice = 2.0 * (offset * across).sum(axis=1) - bend * (offset * offset).sum(axis=1)
    # R - |d - c| with R = 1 / bend, written so that a plane is the limit of large R.
    return np.asarray(twice / (1.0 + np.sqrt(np.maximum(1.0 - bend * twice, 0.0))))
