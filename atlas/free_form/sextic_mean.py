"""Means of sextics: what those that reach a point say of it together."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from touchatlas.atlas.free_form.sextic_sites import FACING
from touchatlas.patch.geometry.arrays import first_largest

# Weight of a sextic that faces away from the side of a point: it counts where no other one does.
# That of one that is folded there is the square of it. Squared, nothing changes.
_SLIGHT = 1e-50
# Share of smaller sextics at a point, over that in the middle of one, at which larger ones have
# none: half-way to where it no longer weighs. Doubled, one small sextic has more of the surface.
_COVERS = 3.0


@dataclass(frozen=True, eq=False)
class SexticMean:
    """What sextics say of n points together.

    Parameters
    ----------
    values : (n, 4) float
        Distance, length, and unit normal, world.
    number : (n,) int
        The sextic that weighs most, whose deviation holds.
    stretch : (n,) float
        Length of a unit of its heights.
    spread : (n,) float, length^2
        Variance of the distances of the sextics.
    alone : (n,) float
        Sum of the squares of their weights: 1 where one has a point alone.
    faces : (n,) bool
        Whether it faces as was asked.
    """

    values: np.ndarray
    number: np.ndarray
    stretch: np.ndarray
    spread: np.ndarray
    alone: np.ndarray
    faces: np.ndarray

    def replaced(self, rows, other: "SexticMean", some) -> "SexticMean":
        """The same with what another one says of some of its own points (k,), which are these here:
        ``rows`` (k,)."""
        columns = [column.copy() for column in vars(self).values()]
        for column, its in zip(columns, vars(other).values(), strict=True):
            column[rows] = its[some]
        return SexticMean(*columns)


@dataclass(frozen=True, eq=False)
class AskedSextics:
    """What sextics say of points, each for itself.

    Parameters
    ----------
    which : (m,) int
        Points, ascending, each at least once.
    number : (m,) int
        The sextic that is asked.
    weight : (m,) float
        By the distance from its middle.
    level : (m,) int
        By how many radii of others it is smaller.
    upward : (m, 3) float, unit, world
        Its normal.
    found : (m, 4) float
        Distance, length, and unit normal.
    stretch : (m,) float
        Length of a unit of its heights.
    """

    which: np.ndarray
    number: np.ndarray
    weight: np.ndarray
    level: np.ndarray
    upward: np.ndarray
    found: np.ndarray
    stretch: np.ndarray

    def some(self, rows) -> "AskedSextics":
        """The same of some of the points (k,), ascending, which are counted anew."""
        own = np.flatnonzero(np.isin(self.which, rows))
        which, *others = (column[own] for column in vars(self).values())
        return AskedSextics(np.searchsorted(rows, which), *others)

    def mean(self, sides, others=None) -> SexticMean:
        """The mean of the sextics that face as ``sides`` (n, 3) do at each of n points, by weights
        that fall with the angle to their normals, where no smaller ones have the point. Where
        ``others`` (n, 3) are given, sextics that rather face as these do are left out."""
        which, count = self.which, len(sides)
        first = np.searchsorted(which, np.arange(count + 1))
        if not count:
            none = np.empty(0)
            return SexticMean(np.empty((0, 4)), first[:0], none, none, none, none > 0.0)
        share, faces = self._shares(sides, others)
        lead = first_largest(share, first[:-1])
        share /= np.add.reduceat(share, first[:-1])[which]
        mean = csr_array((share, np.arange(len(which)), first), (count, len(which))) @ self.found
        spread, alone = _spread(share, self.found[:, 0] - mean[which, 0], first[:-1])
        length = np.sqrt((mean[:, 1:4] ** 2).sum(axis=1))
        mean[:, 1:4] /= np.maximum(length, np.finfo(float).tiny)[:, None]
        return SexticMean(mean, self.number[lead], self.stretch[lead], spread, alone, faces[lead])

    def _shares(self, sides, others) -> tuple[np.ndarray, np.ndarray]:
        """Shares (m,) of the sextics in the means, and whether (m,) each faces as was asked."""
        side = sides[self.which]
        folded = np.einsum("ij,ij->i", self.found[:, 1:4], side) <= 0.0
        cosine = np.einsum("ij,ij->i", self.upward, side)
        turned = np.maximum(cosine - FACING, _SLIGHT)
        if others is not None:
            turned[np.einsum("ij,ij->i", self.upward, others[self.which]) > cosine] = _SLIGHT
        share = np.where(folded, _SLIGHT**2, turned) * self.weight
        if self.level.any():
            share = _left_by_smaller(self.which, share, self.level, len(sides))
        return share, ~folded & (turned > _SLIGHT)


def _spread(share, off, starts) -> tuple[np.ndarray, np.ndarray]:
    """Variance (n,) of sextics about their mean, which they are ``off`` (m,), with shares (m,) of 1
    in all for each point; those of a point begin at ``starts`` (n,). And the sum (n,) of the
    squares of the shares.

    Sextics are less sure where they weigh less: squares of weights count. The variance of n alike
    sextics about their own mean is too small by (n - 1) / n; that of fewer than two is taken twice.
    """
    square = share * share
    alone = np.add.reduceat(square, starts)
    few = np.add.reduceat(square * square, starts) / alone**2
    spread = np.add.reduceat(square * off**2, starts) / (alone * np.maximum(1.0 - few, 0.5))
    return spread, alone


def _left_by_smaller(which, share, level, count: int) -> np.ndarray:
    """(m,) shares (m,) of sextics at ``count`` points ``which`` (m,), less where sextics of higher
    levels (m,) have these: none about the middle of one."""
    out, left = share.copy(), np.ones(count)
    for k in range(level.max(), -1, -1):
        own = level == k
        out[own] *= np.maximum(left[which[own]], _SLIGHT)
        covered = np.bincount(which[own], _COVERS * share[own], count)
        left *= np.maximum(1.0 - covered, 0.0)
    return out
