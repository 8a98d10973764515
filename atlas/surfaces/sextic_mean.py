"""The mean of the sextics that reach a point, with weights by place and side."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from touchatlas.atlas.surfaces.sextic_sites import FACING
from touchatlas.patch.geometry.arrays import first_largest

# Weight of a sextic that faces away from the side of a point: it counts where no other one does.
# That of one that is folded there is the square of it.
_SLIGHT = 1e-50


class Sides(NamedTuple):
    """The sides of the surface that n points may be on.

    Parameters
    ----------
    first : (n, 3) float, unit, world
        Normals of the samples nearest to the points.
    second : (n, 3) float, unit, world
        Normals of the nearest samples that face the other way.
    rows : (m,) int
        The points that have a second side.
    """

    first: np.ndarray
    second: np.ndarray
    rows: np.ndarray

    def faced(self, which, normals) -> np.ndarray:
        """(k,) whether normals (k, 3) at points ``which`` (k,) are those of sextics that face as a
        side of the point does."""
        out = np.einsum("ij,ij->i", normals, self.first.take(which, axis=0)) > FACING
        if len(self.rows):
            others = np.zeros(len(self.first), bool)
            others[self.rows] = True
            left = np.flatnonzero(others[which] & ~out)
            second = self.second.take(which[left], axis=0)
            out[left] = np.einsum("ij,ij->i", normals[left], second) > FACING
        return np.asarray(out)


@dataclass(frozen=True, eq=False)
class Mean:
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
        Whether it faces as the side of the point does, and where there are two, another one as the
        other.
    """

    values: np.ndarray
    number: np.ndarray
    stretch: np.ndarray
    spread: np.ndarray
    alone: np.ndarray
    faces: np.ndarray

    def some(self, rows) -> "Mean":
        """The same of some of the points (k,)."""
        return Mean(*(column[rows] for column in vars(self).values()))

    def replaced(self, rows, other: "Mean", some) -> "Mean":
        """The same with ``some`` (k,) of another one at its points, which are ``rows`` (k,)."""
        columns = [column.copy() for column in vars(self).values()]
        for column, its in zip(columns, vars(other).values(), strict=True):
            column[rows] = its[some]
        return Mean(*columns)


@dataclass(frozen=True, eq=False)
class Evaluated:
    """What sextics say of points, each for itself.

    Parameters
    ----------
    which : (m,) int
        Points, ascending, each at least once.
    number : (m,) int
        The sextic that is evaluated.
    weight : (m,) float
        By the distance from its middle.
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
    upward: np.ndarray
    found: np.ndarray
    stretch: np.ndarray

    def some(self, rows) -> "Evaluated":
        """The same of some of the points (k,), ascending, which are counted anew."""
        own = np.flatnonzero(np.isin(self.which, rows))
        which, *others = (column[own] for column in vars(self).values())
        return Evaluated(np.searchsorted(rows, which), *others)

    def joined(self, other: "Evaluated") -> "Evaluated":
        """Both, of the same points; of one point these come first."""
        own, its = vars(self).values(), vars(other).values()
        which, *columns = (np.concatenate(pair) for pair in zip(own, its, strict=True))
        order = np.argsort(which, kind="stable")
        return Evaluated(which[order], *(column.take(order, axis=0) for column in columns))

    def mean(self, sides, others=None) -> Mean:
        """The mean of the sextics that face as ``sides`` (n, 3) do at each of n points, by weights
        that fall with the distance and the angle to their normals. Where ``others`` (n, 3) are
        given, sextics that rather face as these do are left out."""
        which, count = self.which, len(sides)
        first = np.searchsorted(which, np.arange(count + 1))
        if not count:
            none = np.empty(0)
            return Mean(np.empty((0, 4)), first[:0], none, none, none, none > 0.0)
        side = sides.take(which, axis=0)
        folded = np.einsum("ij,ij->i", self.found[:, 1:4], side) <= 0.0
        cosine = np.einsum("ij,ij->i", self.upward, side)
        turned = np.maximum(cosine - FACING, _SLIGHT)
        if others is not None:
            against = np.einsum("ij,ij->i", self.upward, others.take(which, axis=0))
            turned[against > cosine] = _SLIGHT
        share = np.where(folded, _SLIGHT**2, turned) * self.weight
        lead = first_largest(share, first[:-1])
        share /= np.add.reduceat(share, first[:-1])[which]
        mean = csr_array((share, np.arange(len(which)), first), (count, len(which))) @ self.found
        spread, alone = _spread(share, self.found[:, 0] - mean[which, 0], first[:-1])
        length = np.sqrt((mean[:, 1:4] ** 2).sum(axis=1))
        mean[:, 1:4] /= np.maximum(length, np.finfo(float).tiny)[:, None]
        faces = (~folded & (turned > _SLIGHT))[lead]
        return Mean(mean, self.number[lead], self.stretch[lead], spread, alone, faces)


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
