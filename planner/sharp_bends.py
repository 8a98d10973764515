"""Sharp bends: where arms end because the surface turns too far ahead, and how it is touched there.

An arm may turn by no more than its plan allows. At the rim of a thin disc, or at an edge of a
wedge, it would turn farther within one step: it ends before the bend, and so do all others that
begin on that side. From outside, against the way of the arm, the bend itself is met.
"""

import numpy as np

from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.probe_plan import ProbePlan, Reason

# Least angle by which an arm that ended before a sharp bend might have turned farther, rad: 45
# degrees. Doubled, rims are told only where arms begin flat.
_SHARP = np.pi / 4.0
# Number of samples over which the direction of an arm is measured. Doubled, it has half the noise,
# and short arms tell nothing.
_RUN = 3
# How far inside the surface before a bend the probe comes, in steps: it meets the bend itself.
# Doubled, it passes thin rims.
_INSIDE = 1.0 / 8.0
# Distance from a place to a bend by which it is touched instead, in extents: arms of a touch there
# would end before the bend, too. Doubled, places that other arms reach wait.
_NEAR = 0.1
# Largest cosine of an arm's direction and the normal of a sample that faces it: 15 degrees past a
# right angle. Doubled in angle, walls of narrow grooves do not count.
_FACES = -0.25
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
    where too few are near, where none of them is away from touches and attempts, and where a wall
    stands ahead of it, as at the bottom of a groove."""
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
    point, ahead = points[nearest], directions[nearest]
    if _stands_ahead(view.atlas.pool, point, ahead, _NEAR * view.extent):
        return None
    return Target(point, ahead, Reason.EXPAND)


def _stands_ahead(pool: SamplePool, point, ahead, reach: float) -> bool:
    """Whether samples within ``reach``, length, of a point face it and stand in the way ahead. On a
    convex body each point lies behind the tangent planes of all samples."""
    offset = point - pool.points
    faces = (pool.normals @ ahead < _FACES) & ((offset * pool.normals).sum(axis=1) > 0.0)
    return bool((faces & ((offset * offset).sum(axis=1) < reach**2)).any())


def _bend(touch: Touch, plan: ProbePlan, contour: Contour, last: bool) -> np.ndarray | None:
    """The bend (2, 3) at the first or last end of a contour, if there is one: a point, length, and
    the unit direction of the arm there, world."""
    if contour.ends[last] is not ContourEnd.TURNED_AWAY:
        return None
    offset = contour.points - touch.contact
    contact = int((offset * offset).sum(axis=1).argmin())
    arm = contour.points[contact:] if last else contour.points[contact::-1]
    if len(arm) <= 2 * _RUN:
        return None
    chords = np.array([arm[_RUN] - arm[0], arm[-1] - arm[-1 - _RUN]])
    lengths = np.linalg.norm(chords, axis=1)
    if not lengths.min() > 0.0:
        return None
    first, ahead = chords / lengths[:, None]
    way = np.linalg.norm(np.diff(arm, axis=0), axis=1).sum()
    # Of an arc the chords leave out the turn of their own mean length.
    turn = np.arccos(np.clip(first @ ahead, -1.0, 1.0)) * way / (way - lengths.mean())
    if turn > plan.max_turn - _SHARP:
        return None
    outward = cross(contour.plane.normal, np.array([first, ahead]))
    outward *= 1.0 if outward[0] @ touch.approach > 0.0 else -1.0
    return np.array([arm[-1] - _INSIDE * plan.step * outward[1], ahead])
