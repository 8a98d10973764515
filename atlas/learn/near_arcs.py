"""Near arcs: the part of each contour that one polynomial may follow."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.geometry.contour import Contour, ContourEnd

# Largest angle between a contour and its direction at the contact within the patch of the touch,
# rad: a height function is accurate up to some 50 degrees. Doubled, patches stand upright at their
# rims.
MOST_TURN = np.deg2rad(50.0)
# Chords before and after a point whose mean is the direction there. Doubled, the direction has half
# the noise and lags behind in bends.
_CHORDS = 2


def near_arc(contour: Contour, contact) -> Contour:
    """The part of a contour around the contact until it has turned by ``MOST_TURN`` either way.

    A closed contour is opened opposite the contact.
    """
    points, ends = contour.points, contour.ends
    at = int(((points - contact) ** 2).sum(axis=1).argmin())
    if ContourEnd.CLOSED_LOOP in ends:
        half = len(points) // 2
        points, at = np.roll(points, half - at, axis=0), half
        ends = ContourEnd.LENGTH_REACHED, ContourEnd.LENGTH_REACHED
    ahead, behind = _before_turn(points[at:]), _before_turn(points[at::-1])
    turned = ContourEnd.TURNED_AWAY
    ends = (
        ends[0] if behind == at + 1 else turned,
        ends[1] if ahead == len(points) - at else turned,
    )
    return replace(contour, points=points[at + 1 - behind : at + ahead], ends=ends)


def _before_turn(points) -> int:
    """Number of points of an arm (n, 3) before it has turned by ``MOST_TURN``."""
    chords = np.diff(points, axis=0)
    if len(chords) <= _CHORDS:
        return len(points)
    sums = np.cumsum(np.concatenate([np.zeros((1, 3)), chords]), axis=0)
    runs = sums[_CHORDS:] - sums[:-_CHORDS]
    first = runs[0]
    length = np.sqrt(np.einsum("ij,ij->i", runs, runs) * (first @ first))
    turned = np.flatnonzero(runs @ first < np.cos(MOST_TURN) * length)
    return len(points) if not len(turned) else max(_CHORDS, int(turned[0])) + 1
