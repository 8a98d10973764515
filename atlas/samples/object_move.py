"""The most probable move of the object while it was touched, as crossings of contours tell it."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from touchatlas.atlas.samples.crossings import Crossings


@dataclass(frozen=True)
class Move:
    """The most probable move of the object.

    Parameters
    ----------
    after : int or None
        Number of the last touch before it; None where it moves with every touch.
    shift : (3,) float, length, world
        As far as crossings show it; from one touch to the next where it moves with every touch.
    explained : float
        The sum of squares of the gaps, over their variances, that it explains, but for the gap that
        tells most.
    freedom : float
        How many directions it is known in: the sum that is expected of an object that lies still.
    chance : float
        Of such a sum where nothing moved.
    places : (k, 3) float, length, world
        Of the crossings that tell it.
    """

    after: int | None
    shift: np.ndarray
    explained: float
    freedom: float
    chance: float
    places: np.ndarray


def most_probable_move(crossings: Crossings, order, sure: float) -> Move | None:
    """The move that is least by chance, of the object between two touches or with every touch; None
    where no crossing tells of one.

    Gaps d with normals n are x n . t with one shift t: x is 1 of touches before and after a move,
    and 0 of others, or the number of touches from the one to the other of a drift. The chance is
    that of chi-square, times the number of moves that were looked for. Where the surface has detail
    finer than samples, gaps are larger than noise explains: variances are scaled by what no shift
    explains. A gap counts no more than one that is ``sure`` does, and the one that tells most does
    not count, so that a few false ones tell no move.

    Parameters
    ----------
    crossings : Crossings
    order : list of float
        Numbers of all touches, in the order in which they were made.
    sure : float
        Deviations beyond which a gap is surely more than noise.

    Examples
    --------
    Twelve crossings of touch 0 with 1 and 2 in three directions, which lie 1 apart along the first:

    >>> normals = np.tile(np.eye(3), (4, 1))
    >>> later, variances = np.repeat([1.0, 2.0], 6), np.full(12, 0.01)
    >>> found = Crossings(0.0 * later, later, normals, normals, normals[:, 0], variances)
    >>> move = most_probable_move(found, [0.0, 1.0, 2.0], 4.0)
    >>> move.after, move.shift
    (0, array([1., 0., 0.]))
    """
    moved = _times_moved(crossings, order)
    if not moved.any():
        return None
    deviation = np.sqrt(crossings.variances)
    normals, gaps = crossings.normals / deviation[:, None], crossings.gaps / deviation
    bounded = np.clip(gaps, -sure, sure)
    outer = (normals[:, :, None] * normals[:, None]).reshape(-1, 9)
    inverse, freedom = _inverses((moved**2 @ outer).reshape(-1, 3, 3))
    vector = moved @ (normals * bounded[:, None])
    shifts = np.einsum("kij,kj->ki", inverse, vector)
    foreseen = moved * (shifts @ normals.T)
    each = bounded**2 - (bounded - foreseen) ** 2
    explained = each.sum(axis=1)
    rest = (bounded @ bounded - explained) / np.maximum(len(gaps) - freedom, 1.0)
    # One gap alone tells no move, nor do those of one touch tell a drift.
    place = {number: k for k, number in enumerate(order)}
    places = [place.get(number, -1) for number in crossings.later.tolist()]
    later, of = np.unique(places, return_inverse=True)
    alone = np.append(each[:-1].max(axis=1), np.bincount(of, each[-1]).max())
    explained = np.maximum(explained - alone, 0.0)
    chance = chdtrc(np.maximum(freedom, 1.0), explained / np.maximum(rest, 1.0))
    chance[(freedom == 0.0) | (len(gaps) <= freedom)] = 1.0
    # Two touches after a move tell it: on detail finer than samples the gaps of one are alike.
    second_last = later[-2] if len(later) > 1 else -1
    chance[:-1][np.arange(len(order) - 1) >= second_last] = 1.0
    best = int(chance.argmin())
    return Move(
        int(order[best]) if best < len(order) - 1 else None,
        inverse[best] @ (moved[best] @ (normals * gaps[:, None])),
        float(explained[best]),
        float(freedom[best]),
        float(min(1.0, len(chance) * chance[best])),
        crossings.points[moved[best] != 0.0],
    )


def _times_moved(crossings: Crossings, order) -> np.ndarray:
    """(t, k) how many times the object has moved between both touches of k crossings: once after
    each of t - 1 touches, and with every touch."""
    place = {number: k for k, number in enumerate(order)}
    before, after = (
        np.array([place.get(number, -1) for number in numbers.tolist()], int)
        for numbers in (crossings.earlier, crossings.later)
    )
    between = np.arange(len(order) - 1)[:, None]
    across = (before <= between) & (after > between)
    told = (before >= 0) & (before < after)
    return np.vstack([across, after - before]) * told


def _inverses(matrices) -> tuple[np.ndarray, np.ndarray]:
    """Pseudoinverses (t, 3, 3) of matrices (t, 3, 3), and their ranks (t,): in directions in which
    a shift is known to ten times the least deviation."""
    values, axes = np.linalg.eigh(matrices)
    known = values > np.maximum(1e-2 * values[:, -1:], np.finfo(float).tiny)
    inverse = np.where(known, 1.0 / np.where(known, values, 1.0), 0.0)
    found = (axes * inverse[:, None]) @ np.swapaxes(axes, 1, 2)
    return found, known.sum(axis=1).astype(float)
