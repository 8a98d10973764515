"""Sharp turns: where contours run over a sharp edge, and which points lie beside such a place."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.labels.samples import ContourSamples

# Difference of the slopes on both sides of an edge of 35 degrees. Halved, folds of scanned skin are
# sharp edges.
_SHARP = 2.0 * np.tan(np.deg2rad(17.5))
# Least share of the contours that run over sharp edges for a body to have some (for faces to be
# read at all, ``FaceOptions.kinked`` is enough): on a turned handle
# it falls to 0.44, on a wing nut to 0.62; it was 0.38 or less on scans. Doubled, no body has edges.
# Where it was not asked, folds of a lemon cut its surface: it took 22 touches instead of 15.
MANY = 0.45
# Least cosine of the normals at a point and on its side of a turn: 45 degrees; farther turned it
# lies on another sheet, as on the far side of a thin wall. And largest cosine of those at a point
# and on the other side: 26 degrees.
_SAME_SIDE, _OTHER_SIDE = 0.7, 0.9


def sharp_turns(samples: ContourSamples) -> np.ndarray:
    """(k, 2) samples on both sides of the places at which contours turn by 35 degrees or more."""
    first = np.flatnonzero(np.diff(samples.contours, prepend=-1)).tolist()
    found = [np.zeros(0, int)]
    for start, own in zip(first, samples.hinges, strict=True):
        found.append(start + own.kinks(samples.std, _SHARP))
    return np.concatenate(found)[:, None] + np.array([-2, 2])


def share_of_contours(samples: ContourSamples, turns) -> float:
    """Fraction of the contours that have one of sharp turns (k, 2); points of no curve count for
    none."""
    curves = len(np.unique(samples.contours[samples.planes.any(axis=1)]))
    return len(np.unique(samples.contours[turns[:, 0]])) / max(curves, 1)


@dataclass(frozen=True, eq=False)
class BesideTurns:
    """Points that lie beside a sharp turn.

    Parameters
    ----------
    rows : (r,) int
        Which of the points that were asked for.
    own, other : (r, 3) float, unit, world
        Normals of the surface on their own side of the turn, and on the other.
    sign : (r,) float
        1 where the edge is convex, -1 where it is concave.
    """

    rows: np.ndarray
    own: np.ndarray
    other: np.ndarray
    sign: np.ndarray


class SharpTurns:
    """Places at which contours run over a sharp edge of a surface.

    Parameters
    ----------
    pairs : (k, 2) int
        Samples on both sides of each. Pairs that lie neither over a convex nor over a concave edge
        are left out: noise made them.
    points, normals : (n, 3) float, length; unit, world
        All samples, and normals of the surface there.

    Examples
    --------
    The ridge of a roof is convex, and a point beside it is above its left side:

    >>> points = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0]])
    >>> normals = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0]]) / np.sqrt(2.0)
    >>> turns = SharpTurns(np.array([[0, 1]]), points, normals)
    >>> found = turns.beside(np.array([[-0.5, 0.0, 0.0]]), normals[:1], 2.0)
    >>> found.sign.tolist(), found.other.round(2).tolist()
    ([1.0], [[0.71, 0.0, 0.71]])
    """

    def __init__(self, pairs, points, normals) -> None:
        first, second = pairs.T
        chord = points[second] - points[first]
        behind = (normals[first] * chord).sum(axis=1), -(normals[second] * chord).sum(axis=1)
        sign = -np.sign(behind)
        kept = np.flatnonzero((sign[0] == sign[1]) & (sign[0] != 0.0))
        self._sign, self._sides = sign[0, kept], normals[pairs[kept]]
        self._tree = cKDTree(0.5 * (points[first] + points[second])[kept])

    def beside(self, points, sides, reach: float) -> BesideTurns:
        """Which of points (n, 3), with normals ``sides`` (n, 3) of the nearest samples, have a turn
        within ``reach``, length, one side of which faces as they do; and the nearest such turn."""
        count = min(8, self._tree.n)
        if not count:
            none = np.zeros((0, 3))
            return BesideTurns(np.zeros(0, int), none, none, np.zeros(0))
        away, near = self._tree.query(points, k=count, distance_upper_bound=reach)
        away, near = np.reshape(away, (-1, count)), np.reshape(near, (-1, count))
        rows = np.flatnonzero(np.isfinite(away[:, 0]))
        within = np.isfinite(away[rows])
        turns = np.where(within, near[rows], 0)
        cosines = np.einsum("rksj,rj->rks", self._sides[turns], sides[rows])
        fits = within & (cosines.max(axis=2) > _SAME_SIDE) & (cosines.min(axis=2) < _OTHER_SIDE)
        some = np.flatnonzero(fits.any(axis=1))
        which = fits[some].argmax(axis=1)
        turn, own = turns[some, which], cosines[some, which].argmax(axis=1)
        return BesideTurns(
            rows[some], self._sides[turn, own], self._sides[turn, 1 - own], self._sign[turn]
        )
