"""A plan carried out by a machine that triggers: single points in place of tracked curves."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.machines import Trigger
from touchatlas.planner.tracking.options import Tip, TriggerOptions

# Where a point is not found straight ahead, it is looked for around an edge, and where the way to
# it is blocked, up a wall: angles by which the direction of travel turns, rad.
_AROUND, _UP = (0.5, 1.0, 1.4), (-0.5, -1.0, -1.4)
# A point is probed from a height of this fraction of the distance between points, if that is more
# than the usual one: curves turn by no more than that between two points.
_RISE = 0.35


@dataclass(frozen=True, eq=False)
class _Hop:
    """A place of the tip in contact: its centre, the direction of travel, that outward, (3,)."""

    centre: np.ndarray
    along: np.ndarray
    outward: np.ndarray

    def lifted(self, height: float) -> np.ndarray:
        """(3,) the centre lifted off the surface."""
        found: np.ndarray = self.centre + height * self.outward
        return found

    def turned(self, angle: float) -> "_Hop":
        """The same, travelling more inward by an angle."""
        c, s = np.cos(angle), np.sin(angle)
        along, outward = c * self.along - s * self.outward, c * self.outward + s * self.along
        return _Hop(self.centre, along, outward)


def touch_points(
    trigger: Trigger,
    plan: ProbePlan,
    tip: Tip = Tip(),
    options: TriggerOptions = TriggerOptions(),
) -> Touch:
    """Carry out a plan with a machine that triggers.

    Each arm becomes some points a fraction of its reach apart. Each is approached along the normal
    that the two points before it let expect.

    Parameters
    ----------
    trigger : Trigger
    plan : ProbePlan
    tip : Tip
    options : TriggerOptions

    Returns
    -------
    Touch
        Of centres of the tip, with its radius.
    """
    origin = plan.begin(tip.radius)
    target = origin - plan.depth * plan.normal
    before = np.asarray(trigger.position(), float)
    if not trigger.move(plan.way_from(before, tip.radius)):
        # What stopped it is not known; where it came from is free.
        trigger.move(before[None])
        return _in_vain(plan, TouchStatus.UNREACHABLE, None, tip)
    centre = trigger.probe(target)
    if centre is None:
        trigger.move(origin[None])
        return _in_vain(plan, TouchStatus.NO_CONTACT, np.stack([origin, target]), tip)
    contours, tracked = [], 0.0
    for plane in plan.planes:
        arms = [
            _arm(trigger, plan, _Hop(centre, way, plan.normal), tip, options)
            for way in (cross(plan.normal, plane.normal), cross(plane.normal, plan.normal))
        ]
        (ahead, last), (behind, first) = arms
        points = np.vstack([behind[::-1], centre, ahead])
        tracked += float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())
        noise = tip.sample_std(1)
        contours.append(Contour(points, SamplingPlane(centre, plane.normal), noise, (first, last)))
    trigger.move(origin[None])
    length = float((origin - centre) @ plan.normal)
    way = np.stack([origin, origin - length * plan.normal]) if length > 0.0 else None
    return Touch(
        plan.number,
        centre,
        plan.normal,
        tuple(contours),
        TouchStatus.TOUCHED,
        tracked,
        0.0,
        way,
        tip.radius,
        tip.radius_std,
    )


def _in_vain(plan: ProbePlan, status: TouchStatus, way: np.ndarray | None, tip: Tip) -> Touch:
    """The touch of a plan without contact."""
    place = plan.reference_point, plan.normal
    return Touch(plan.number, *place, (), status, 0.0, 0.0, way, tip.radius, tip.radius_std)


def _arm(trigger: Trigger, plan: ProbePlan, first: _Hop, tip: Tip, options: TriggerOptions):
    """Centres (k, 3) of the points of an arm, and why it ended; the tip is then above the contact
    again, on the way that it came."""
    hops, end, step = [first], ContourEnd.LENGTH_REACHED, plan.reach / options.points
    air, known = [first.lifted(options.retract)], 0
    trigger.move(air[0][None])
    while len(hops) <= options.points and known < 2:
        found = _next(trigger, hops[-1], step, options, air)
        if found is None:
            end = ContourEnd.TURNED_AWAY
            break
        hops.append(_with_direction(hops, found))
        if hops[-1].along @ first.along < np.cos(plan.max_turn):
            end = ContourEnd.TURNED_AWAY
            break
        if plan.until is not None:
            contact = hops[-1].lifted(-tip.radius)
            known = known + 1 if plan.until(contact[None])[0] else 0
    trigger.move(np.array(air[::-1]))
    return np.array([hop.centre for hop in hops[1:]]).reshape(-1, 3), end


def _next(
    trigger: Trigger, hop: _Hop, step: float, options: TriggerOptions, air: list[np.ndarray]
) -> _Hop | None:
    """The next point of an arm, a step on; None where there is none ahead, around an edge or up a
    wall. The tip begins and ends at the last of the free places ``air``, which grow."""
    rise = max(options.approach, _RISE * step)
    angles = [0.0, *_AROUND]
    while angles:
        angle = angles.pop(0)
        half, turned = hop.turned(0.5 * angle), hop.turned(angle)
        start = hop.centre + step * half.along + rise * turned.outward
        if trigger.move(start[None]):
            centre = trigger.probe(start - (rise + max(options.overtravel, rise)) * turned.outward)
            trigger.move(start[None])
            if centre is not None:
                air.append(start)
                return _Hop(centre, turned.along, turned.outward)
        elif angle <= 0.0:
            angles = list(_UP) if angle == 0.0 else angles
        trigger.move(air[-1][None])
    return None


def _with_direction(hops: list[_Hop], found: _Hop) -> _Hop:
    """A point found after others, travelling as a parabola through the last three does."""
    chord = found.centre - hops[-1].centre
    before = hops[-1].centre - hops[-2].centre if len(hops) > 1 else None
    w = cross(found.outward, found.along)
    chord = chord - (chord @ w) * w
    chord /= max(float(np.linalg.norm(chord)), 1e-300)
    along = 2.0 * chord - hops[-1].along if before is None else _ahead(before, chord)
    along = along - (along @ w) * w
    along /= max(float(np.linalg.norm(along)), 1e-300)
    return _Hop(found.centre, along, cross(along, w))


def _ahead(before: np.ndarray, chord: np.ndarray) -> np.ndarray:
    """Direction (3,) at the end of a chord (3,), unit, after a chord before it."""
    found: np.ndarray = 1.5 * chord - 0.5 * before / max(float(np.linalg.norm(before)), 1e-300)
    return found
