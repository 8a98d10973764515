"""Sharp bends: where arms end because the surface turns too far ahead, and how it is touched there.

An arm may turn by no more than its plan allows. At the rim of a thin disc, or at an edge of a
wedge, it would turn farther within one step: it ends before the bend, and so do all others that
begin on that side. From outside, against the way of the arm, the bend itself is met.
"""

import numpy as np

from touchatlas.atlas.records.touch import Touch
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.probe_plan import ProbePlan, Reason

# Least angle by which a bend turns within a step, rad: 45 degrees, as on a circle with a radius of
# 1.3 steps. Doubled, rims of radii of half a step are not told.
_SHARP = np.pi / 4.0
# Number of samples over which the direction of an arm is measured. Doubled, it has half the noise
# and twice the error from curvature.
_RUN = 3
# How far inside the surface before a bend the probe comes, in steps: it meets the bend itself.
# Doubled, it passes thin rims.
_INSIDE = 1.0 / 8.0
# Distance from a place to a bend by which it is touched instead, in extents: arms of a touch there
# would end before the bend, too. Doubled, places that other arms reach wait.
_NEAR = 0.1
# Bends near a place that tell of a sharp bend of the surface there: one in an oblique plane may be
# that of its contour alone. Doubled, thin discs take more touches.
_LEAST = 3


def sharp_bends(touch: Touch, plan: ProbePlan) -> list[np.ndarray]:
    """Points before sharp bends at the ends of the contours of a touch, and the directions of the
    arms there: (2, 3) each, length and unit, world."""
    found = (_bend(touch, plan, one, last) for one in touch.contours for last in (False, True))
    return [bend for bend in found if bend is not None]


def side_target(target: Target, bends: list[np.ndarray], view: View) -> Target | None:
    """The bend that is nearest to a place where nothing is known, to be touched from outside; None
    where fewer than three are near, or none of them is away from touches and attempts."""
    if target.reason is not Reason.EXPAND or not bends:
        return None
    points, directions = np.stack(bends, axis=1)
    offset = points - target.point
    away = np.sqrt((offset * offset).sum(axis=1))
    near = away <= _NEAR * view.extent
    free = np.flatnonzero(near & view.is_free(points))
    if np.count_nonzero(near) < _LEAST or not len(free):
        return None
    nearest = free[away[free].argmin()]
    return Target(points[nearest], directions[nearest], Reason.EXPAND)


def _bend(touch: Touch, plan: ProbePlan, contour: Contour, last: bool) -> np.ndarray | None:
    """The bend at the first or last end of a contour, if there is one."""
    if contour.ends[last] is not ContourEnd.TURNED_AWAY:
        return None
    offset = contour.points - touch.contact
    contact = int((offset * offset).sum(axis=1).argmin())
    arm = contour.points[contact:] if last else contour.points[contact::-1]
    if len(arm) <= _RUN:
        return None
    chords = np.array([arm[_RUN] - arm[0], arm[-1] - arm[-1 - _RUN]])
    first, ahead = chords / np.linalg.norm(chords, axis=1)[:, None]
    if np.arccos(np.clip(first @ ahead, -1.0, 1.0)) > plan.max_turn - _SHARP:
        return None
    outward = cross(contour.plane.normal, np.array([first, ahead]))
    outward *= 1.0 if outward[0] @ touch.approach > 0.0 else -1.0
    return np.array([arm[-1] - _INSIDE * plan.step * outward[1], ahead])
