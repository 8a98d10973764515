"""Arcs: the part of a recorded curve that belongs to one reference point."""

import numpy as np

from touchatlas.patch import ContourEnd
from touchatlas.patch.geometry.kinks import SIDE, kinks
from touchatlas.patch.geometry.section import LEAST_POINTS

_FREE_ENDS = (ContourEnd.UNREACHABLE, ContourEnd.LENGTH_REACHED)


def near_arc(points, point):
    """The part of a curve around a point, until it has turned by 45 degrees either way.

    The chord of a circle's arc that turns by 45 degrees makes 22.5 degrees with its tangent.
    Chords are used because noise changes them less than it changes directions.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel.
    point : (3,) float, length, world

    Returns
    -------
    points : (m, 3) float
    ends : pair of ContourEnd
        TURNED_AWAY where it was cut; UNREACHABLE where the recording ends near the point.
    """
    points = _opened_loop(points, point)
    nearest = int(((points - point) ** 2).sum(axis=1).argmin())
    half = max(2, len(points) // 8)
    low, high = max(nearest - half, 0), min(nearest + half, len(points) - 1)
    chord = points[high] - points[low]
    chord = chord / np.sqrt(max(chord @ chord, np.finfo(float).tiny))
    offset = points - points[nearest]
    along = (offset @ chord) * np.sign(np.arange(len(points)) - nearest)
    across = np.sqrt(np.maximum((offset * offset).sum(axis=1) - along**2, 0.0))
    turned = _not_alone(across > np.tan(np.deg2rad(22.5)) * along)
    before, after = turned[turned < low], turned[turned > high]
    first = before[-1] + 1 if len(before) else 0
    last = after[0] - 1 if len(after) else len(points) - 1
    sides = np.sqrt((offset[[first, last]] ** 2).sum(axis=1))
    # An arm of less than a tenth of the curve does not limit the patch.
    soft = sides >= 0.1 * sides.sum()
    ends = tuple(
        ContourEnd.TURNED_AWAY if cut else _FREE_ENDS[int(long)]
        for cut, long in zip((len(before), len(after)), soft, strict=True)
    )
    return points[first : last + 1], ends


def this_side(points, normal, noise: float, point, ends):
    """The part of an arc on the point's side of any edge, and its ends."""
    first, last = smooth_part(points, normal, noise, point)
    crossed = first > 0, last < len(points) - 1
    ends = tuple(ContourEnd.EDGE if c else e for c, e in zip(crossed, ends, strict=True))
    return points[first : last + 1], ends


def smooth_part(points, normal, noise: float, point):
    """(first, last) samples of a curve around a point between which it has no kink.

    Parameters
    ----------
    points : (n, 3) float, length, world
        In order of travel.
    normal : (3,) float, unit
        Of the curve's plane.
    noise : float, length
    point : (3,) float, length, world

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> roof = np.stack([x, 0.0 * x, -np.abs(x - 0.2)], axis=1)
    >>> smooth_part(roof, np.array([0.0, 1.0, 0.0]), 1e-3, np.zeros(3))
    (0, 12)
    """
    # Of a dense curve the samples on either side of a possible kink are a twelfth.
    stride = max(SIDE, len(points) // 12) // SIDE
    found = kinks(points, normal, noise, stride)
    nearest = int(((points - point) ** 2).sum(axis=1).argmin())
    # The kink itself is of both sides, but known to a stride only.
    before, after = found[found <= nearest] + (stride - 1), found[found > nearest] - (stride - 1)
    return int(before.max(initial=0)), int(after.min(initial=len(points) - 1))


def binding_ends(point, points, ends):
    """Ends of arcs. Free ends much nearer than most become UNREACHABLE, which limits no patch."""
    sides = np.array([((p[[0, -1]] - point) ** 2).sum(axis=1) for p in points])
    # Squares: arms shorter than half of the median one.
    near = sides < 0.25 * np.median(sides)
    free = ContourEnd.LENGTH_REACHED
    return [
        tuple(ContourEnd.UNREACHABLE if n and e is free else e for n, e in zip(*both, strict=True))
        for both in zip(near, ends, strict=True)
    ]


def _not_alone(turned) -> np.ndarray:
    """Indices where a curve has turned, without single points, which are bad contacts."""
    around = np.concatenate([turned[:1], turned, turned[-1:]])
    return np.flatnonzero(turned & (around[:-2] | around[2:]))


def _opened_loop(points, point) -> np.ndarray:
    """A closed curve, cut open opposite to the point; an open curve unchanged."""
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    gap = np.sqrt(((points[-1] - points[0]) ** 2).sum())
    if len(points) <= 2 * LEAST_POINTS or gap > 1.5 * np.median(step):
        return points
    points = points[:-1] if gap == 0.0 else points
    nearest = int(((points - point) ** 2).sum(axis=1).argmin())
    return np.roll(points, len(points) // 2 - nearest, axis=0)
