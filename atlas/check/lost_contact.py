"""Where contours lost contact and nothing was met beyond: the surface may end there."""

from collections.abc import Iterable

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.patch.geometry.contour import Contour, ContourEnd

# A sample ahead of an end, nearer than the first number of spacings and farther on than the second,
# shows that the surface goes on: the probe slipped. With the first doubled, the far side of a hole
# of four spacings refutes both sides; with the second doubled, curves that cross there refute less.
_NEAR, _AHEAD = 2.0, 0.5


def lost_contact(contours: Iterable[Contour]) -> np.ndarray:
    """(k, 3) the ends of contours at which contact was lost, and beyond which no sample lies.

    Parameters
    ----------
    contours : iterable of Contour
        Of all touches. Those of fewer than two points are passed over.

    Examples
    --------
    A contour that lost contact at its last point, and one that was tracked on from there:

    >>> from touchatlas.patch import SamplingPlane
    >>> plane = SamplingPlane(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    >>> kept = ContourEnd.LENGTH_REACHED
    >>> x = np.arange(5.0)[:, None] * [1.0, 0.0, 0.0]
    >>> first = Contour(x, plane, 0.0, (kept, ContourEnd.LOST_CONTACT))
    >>> lost_contact([first]).tolist()
    [[4.0, 0.0, 0.0]]
    >>> second = Contour(x + [3.0, 0.0, 0.0], plane, 0.0, (kept, kept))
    >>> lost_contact([first, second]).shape
    (0, 3)
    """
    every = [c for c in contours if len(c.points) > 1]
    ends = [_ahead(c, side) for c in every for side in (0, 1) if _is_lost(c, side)]
    if not ends:
        return np.zeros((0, 3))
    points = np.concatenate([c.points for c in every])
    tree = cKDTree(points)
    bare = [
        end
        for end, direction, spacing in ends
        if not (
            (points[tree.query_ball_point(end, _NEAR * spacing)] - end) @ direction
            > _AHEAD * spacing
        ).any()
    ]
    return np.reshape(bare, (-1, 3))


def _is_lost(contour: Contour, side: int) -> bool:
    return contour.ends[side] is ContourEnd.LOST_CONTACT


def _ahead(contour: Contour, side: int) -> tuple[np.ndarray, np.ndarray, float]:
    """The end of a contour, the unit direction in which it was tracked there, and its spacing."""
    points = contour.points if side else contour.points[::-1]
    steps = np.diff(points, axis=0)
    lengths = np.sqrt((steps * steps).sum(axis=1))
    last = steps[-1] / max(lengths[-1], np.finfo(float).tiny)
    return points[-1], last, float(np.median(lengths))
