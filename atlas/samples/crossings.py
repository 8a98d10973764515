"""Crossings: where contours of different touches cross, and by how much they miss each other.

There both touches measure one place of the object, whatever its shape, so that the gap between them
is noise, unless the object or the probe has moved between the touches.
"""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import chdtri

from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import cross

# Samples to either side of the middle one through which a contour is a cubic. Parabolas leave gaps
# where the curvature changes along a contour.
_SIDE = 2
# Cosine of the directions of two contours above which they run along each other: the place at which
# they are nearest is not known, and the one is compared with the other abreast of its sample.
_ALONG = 0.9
# Chords from a sample within which it is the one nearest to a crossing, with some slack.
_NEAREST = 0.6
# Steps of Gauss and Newton to where two cubics are nearest, which double the digits.
_STEPS = 4


@dataclass(frozen=True, eq=False)
class Crossings:
    """Crossings of contours of different touches.

    Parameters
    ----------
    earlier, later : (k,) float
        Numbers of both touches.
    points : (k, 3) float, length, world
        Of the later contour.
    normals : (k, 3) float, unit, world
        Of the surface, outward.
    gaps : (k,) float, length
        By which the later contour lies above the earlier one.
    variances : (k,) float, length^2
        Of the gaps, by the noise of the samples and the last term of the cubics.
    """

    earlier: np.ndarray
    later: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    gaps: np.ndarray
    variances: np.ndarray

    @classmethod
    def of_table(cls, table) -> Self:
        """The crossings whose ``table`` (k, 10) it is."""
        table = np.asarray(table, float)
        one, other, points, normals, rest = np.split(table, [1, 2, 5, 8], axis=1)
        return cls(one[:, 0], other[:, 0], points, normals, *rest.T)

    @property
    def table(self) -> np.ndarray:
        """(k, 10) all numbers, for a file."""
        return np.column_stack([getattr(self, field.name) for field in fields(self)])

    def __add__(self, other: "Crossings") -> "Crossings":
        return Crossings.of_table(np.vstack([self.table, other.table]))


# Numbers of a row of a table.
WIDTH = 10
NO_CROSSINGS = Crossings.of_table(np.zeros((0, WIDTH)))


def crossings_of(pool: SamplePool, first: int, levels: Levels = Levels()) -> Crossings:
    """Where the contours of the samples from number ``first`` on, of one touch, cross others.

    Each curve is a cubic in its chord length through five samples, by least squares, and is left
    out where these are farther off it than noise explains, as at an edge. A gap is along the normal
    of both cubics where they are nearest to each other.
    """
    middles = _middles(pool.contours)
    one, other = _near_pairs(pool, middles, first, levels.facing)
    if not len(one):
        return NO_CROSSINGS
    upper, lower = _Cubics(pool, one, middles), _Cubics(pool, other, middles)
    u, v = np.zeros(len(one)), np.zeros(len(one))
    a, b = upper.slope(u), lower.slope(v)
    along = np.abs((a * b).sum(axis=1)) > _ALONG * np.sqrt(_square(a) * _square(b))
    for _ in range(_STEPS):
        u, v = _nearer(upper, lower, u, v, along)
    gap, outward = upper.at(u) - lower.at(v), pool.normals[one]
    upward = _normals(upper.slope(u), lower.slope(v), outward, along)
    height = (gap * upward).sum(axis=1)
    variance = upper.variance(u) + lower.variance(v)
    variance += upper.truncation(u, upward) ** 2 + lower.truncation(v, upward) ** 2
    beside = np.maximum(_square(gap) - height**2, 0.0)
    good = upper.follows(upward, levels.alpha) & lower.follows(upward, levels.alpha)
    good &= (np.abs(u) < _NEAREST) & (np.abs(v) < _NEAREST)
    good &= (beside < levels.sure**2 * variance) & (variance > 0.0)
    # Where contours of two faces meet at their edge, the one does not face as the other.
    good &= (upward * outward).sum(axis=1) > levels.facing
    good &= (upward * pool.normals[other]).sum(axis=1) > levels.facing
    rows = pool.touches[other], pool.touches[one], upper.at(u), upward, height, variance
    return Crossings.of_table(np.column_stack(rows)[good])


def _middles(contours) -> np.ndarray:
    """(n,) numbers of the middle samples of five neighbours among which each sample of ``contours``
    (n,) is; -1 where a contour has fewer."""
    count = len(contours)
    begins = np.flatnonzero(np.append(True, np.diff(contours) != 0)) if count else np.zeros(0, int)
    counts = np.diff(np.append(begins, count))
    first, last = np.repeat(begins, counts), np.repeat(begins + counts - 1, counts)
    found = np.clip(np.arange(count), first + _SIDE, last - _SIDE)
    return np.where(last - first >= 2 * _SIDE, found, -1)


def _near_pairs(pool: SamplePool, middles, first: int, facing: float):
    """(m,) numbers of samples from ``first`` on, and of the nearest of each older contour, within a
    step of both, whose normals face the same way; one pair for five samples of a contour."""
    old, new = np.flatnonzero(middles[:first] >= 0), first + np.flatnonzero(middles[first:] >= 0)
    none = np.zeros(0, int)
    if not (len(old) and len(new)):
        return none, none
    steps = _steps(pool.points, middles)
    reach = 0.75 * (steps[new] + steps[old].max())
    near = cKDTree(pool.points[old]).query_ball_point(pool.points[new], reach)
    one = np.repeat(new, [len(some) for some in near])
    other = old[np.concatenate([none, *near]).astype(int)]
    faces = (pool.normals[one] * pool.normals[other]).sum(axis=1) > facing
    faces &= pool.touches[other] >= 0
    one, other = one[faces], other[faces]
    away = _square(pool.points[one] - pool.points[other])
    groups = pool.contours[one], one // (2 * _SIDE + 1), pool.contours[other]
    order = np.lexsort((away, *groups))
    begins = np.any([np.diff(group[order]) != 0 for group in groups], axis=0)
    chosen = order[np.append(len(order) > 0, begins).nonzero()[0]] if len(order) else none
    return one[chosen], other[chosen]


def _steps(points, middles) -> np.ndarray:
    """(n,) half the distance of the neighbours of the ``middles`` (n,); 0 where there is none."""
    some = np.flatnonzero(middles >= 0)
    found, middle = np.zeros(len(middles)), middles[some]
    found[some] = 0.5 * np.sqrt(_square(points[middle + 1] - points[middle - 1]))
    return found


class _Cubics:
    """Cubics through five samples of a contour each, in the chord length from samples ``of``
    (m,), over the longest chord of the five."""

    def __init__(self, pool: SamplePool, of, middles) -> None:
        own = middles[of][:, None] + np.arange(-_SIDE, _SIDE + 1)
        points, self._noise = pool.points[own], pool.noise[of]
        chords = np.sqrt(_square(np.diff(points, axis=1)))
        chords /= np.maximum(chords.max(axis=1), np.finfo(float).tiny)[:, None]
        length = np.cumsum(np.pad(chords, ((0, 0), (1, 0))), axis=1)
        place = of - own[:, 0]
        length -= np.take_along_axis(length, place[:, None], axis=1)
        about = np.clip(place, 1, 2 * _SIDE - 1)[:, None] + [-1, 0, 1]
        self._nearest = np.take_along_axis(length, about, axis=1)
        terms = _terms(length)
        across = np.swapaxes(terms, 1, 2)
        self._inverse = np.linalg.pinv(across @ terms)
        self._coefficients = self._inverse @ (across @ points)
        self._rest = points - terms @ self._coefficients

    def at(self, s) -> np.ndarray:
        """(m, 3) points at lengths (m,)."""
        return np.einsum("mi,mij->mj", _terms(s), self._coefficients)

    def slope(self, s) -> np.ndarray:
        """(m, 3) their derivatives."""
        _, c, d, e = np.moveaxis(self._coefficients, 1, 0)
        s = s[:, None]
        return np.asarray(c + 2.0 * s * d + 3.0 * s * s * e)

    def variance(self, s) -> np.ndarray:
        """(m,) variance of each coordinate of these points."""
        terms = _terms(s)
        return self._noise**2 * np.einsum("mi,mij,mj->m", terms, self._inverse, terms)

    def truncation(self, s, normals) -> np.ndarray:
        """(m,) by how much these cubics differ along normals (m, 3) from parabolas through three
        samples about them, length: the third divided difference by the product of the distances
        (Newton). A term that matters says that the next one may."""
        height = (self._coefficients[:, 3] * normals).sum(axis=1)
        return np.asarray(height * np.prod(s[:, None] - self._nearest, axis=1))

    def follows(self, normals, alpha: float) -> np.ndarray:
        """(m,) whether noise explains what is left along normals (m, 3), but for a chance."""
        left = np.einsum("mij,mj->mi", self._rest, normals)
        freedom = 2.0 * _SIDE - 3.0
        return (left * left).sum(axis=1) <= chdtri(freedom, alpha) * self._noise**2


def _nearer(upper: _Cubics, lower: _Cubics, u, v, along):
    """(m,) lengths after a step to where two cubics are nearest; of those that run along
    each other the first is held. No step leads beyond a chord."""
    off, a, b = upper.at(u) - lower.at(v), upper.slope(u), -lower.slope(v)
    a = np.where(along[:, None], 0.0, a)
    aa, bb, ab = _square(a) + along, _square(b), (a * b).sum(axis=1)
    at, bt, determinant = (a * off).sum(axis=1), (b * off).sum(axis=1), aa * bb - ab * ab
    u = u - (bb * at - ab * bt) / determinant
    v = v - (aa * bt - ab * at) / determinant
    return np.clip(u, -1.0, 1.0), np.clip(v, -1.0, 1.0)


def _normals(one, other, outward, along) -> np.ndarray:
    """(m, 3) unit normals of two directions (m, 3), on the side of ``outward`` (m, 3), which stands
    for those that run ``along`` (m,) each other."""
    found = cross(one, other)
    found *= np.sign((found * outward).sum(axis=1))[:, None]
    found[along] = outward[along]
    return found / np.maximum(np.sqrt(_square(found)), np.finfo(float).tiny)[:, None]


def _terms(s) -> np.ndarray:
    """(..., 3) powers of s from 0 to 3."""
    return np.asarray(np.asarray(s)[..., None] ** np.arange(4.0))


def _square(vectors) -> np.ndarray:
    """(...,) squared lengths of vectors (..., 3)."""
    return np.asarray((vectors * vectors).sum(axis=-1))
