"""A plan carried out by a machine that triggers: single points in place of tracked curves."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.going import arrives
from touchatlas.planner.tracking.machines import Trigger
from touchatlas.planner.tracking.options import Tip, TriggerOptions

# Where a point is not found straight ahead, it is looked for around an edge, and where the way to
# it is blocked, up a wall: angles by which the direction of travel turns, rad.
_AROUND, _UP = (0.5, 1.0, 1.4), (-0.5, -1.0, -1.4)
# A point is probed from, and looked for as deep as, such fractions of the distance between points,
# if they are more than usual: about the first point of an arm nothing is known, and after it how
# the curve bends.
_FIRST, _RISE = 0.35, 0.12
# A curve is expected to turn by no more than this in a step, rad: more is an edge, that ended.
_BEND = 0.6


@dataclass(frozen=True, eq=False)
class _Hop:
    """A place of the tip in contact: its centre, the direction of travel, that outward, (3,); and
    by which angle the curve turns inward in a step, rad, None where it is not known."""

    centre: np.ndarray
    along: np.ndarray
    outward: np.ndarray
    bend: float | None = None

    def lifted(self, height: float) -> np.ndarray:
        """(3,) the centre lifted off the surface."""
        found: np.ndarray = self.centre + height * self.outward
        return found

    def turned(self, angle: float) -> "_Hop":
        """The same, travelling more inward by an angle."""
        c, s = np.cos(angle), np.sin(angle)
        along, outward = c * self.along - s * self.outward, c * self.outward + s * self.along
        return _Hop(self.centre, along, outward, self.bend)

    def ahead(self, step: float, angle: float = 0.0) -> "_Hop":
        """The place expected a step on along an arc, turned by an angle more."""
        turn = (self.bend or 0.0) + angle
        half, whole = self.turned(0.5 * turn), self.turned(turn)
        return _Hop(self.centre + step * half.along, whole.along, whole.outward, self.bend)


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
    # What is learned and planned are centres.
    origin = plan.begin()
    target = origin - plan.depth * plan.normal
    before = np.asarray(trigger.position(), float)
    if not arrives(trigger, before, plan.way_from(before)):
        return _in_vain(plan, TouchStatus.UNREACHABLE, None, tip)
    centre = trigger.probe(target)
    if centre is None:
        trigger.move(origin[None])
        return _in_vain(plan, TouchStatus.NO_CONTACT, np.stack([origin, target]), tip)
    contours, tracked = [], 0.0
    for plane in plan.planes:
        arms = [
            _arm(trigger, plan, _Hop(centre, way, plan.normal), options)
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


def _arm(trigger: Trigger, plan: ProbePlan, first: _Hop, options: TriggerOptions):
    """Centres (k, 3) of the points of an arm, and why it ended; the tip is then above the contact
    again, on the way that it came."""
    hops, end, step = [first], ContourEnd.LENGTH_REACHED, plan.reach / options.points
    air = [first.lifted(options.retract)]
    trigger.move(air[0][None])
    while len(hops) <= options.points:
        ahead = hops[-1].ahead(step)
        if plan.until is not None and len(hops) > 1 and plan.until(ahead.centre[None])[0]:
            # What is known there teaches nothing.
            break
        found = _next(trigger, hops[-1], step, options, air)
        if found is None:
            end = ContourEnd.TURNED_AWAY
            break
        hops.append(_with_direction(hops, found))
        if hops[-1].along @ first.along < np.cos(plan.max_turn):
            end = ContourEnd.TURNED_AWAY
            break
    trigger.move(np.array(air[::-1]))
    return np.array([hop.centre for hop in hops[1:]]).reshape(-1, 3), end


def _next(
    trigger: Trigger, hop: _Hop, step: float, options: TriggerOptions, air: list[np.ndarray]
) -> _Hop | None:
    """The next point of an arm, a step on; None where there is none ahead, around an edge or up a
    wall. The tip begins and ends at the last of the free places ``air``, which grow."""
    deep = max(options.overtravel, _FIRST * step)
    rise = max(options.approach, (_FIRST if hop.bend is None else _RISE) * step)
    angles = [0.0, *_AROUND]
    while angles:
        angle = angles.pop(0)
        ahead = hop.ahead(step, angle)
        start = ahead.lifted(rise)
        if trigger.move(start[None]):
            centre = trigger.probe(ahead.lifted(-deep))
            trigger.move(start[None])
            if centre is not None:
                air.append(start)
                return _Hop(centre, ahead.along, ahead.outward)
        elif angle <= 0.0:
            angles = list(_UP) if angle == 0.0 else angles
        trigger.move(air[-1][None])
    return None


def _with_direction(hops: list[_Hop], found: _Hop) -> _Hop:
    """A point found after others: it travels, and bends, as an arc through the last three, or, of
    two, through these in the first one's direction."""
    w = cross(found.outward, found.along)
    chord, before = _unit(found.centre - hops[-1].centre, w), hops[-1].along
    if len(hops) > 1:
        before = _unit(hops[-1].centre - hops[-2].centre, w)
    inward = -cross(chord, w)
    turn = float(np.arctan2(-(before @ inward), before @ chord))
    # Of a direction at a point the chord has turned by half a step, of a chord by a whole one.
    bend = turn if len(hops) > 1 else 2.0 * turn
    bend = float(np.clip(bend, -_BEND, _BEND))
    along = np.cos(0.5 * bend) * chord + np.sin(0.5 * bend) * inward
    return _Hop(found.centre, along, cross(along, w), bend)


def _unit(chord: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(3,) unit direction of a chord within the plane of a normal."""
    inside = chord - (chord @ w) * w
    found: np.ndarray = inside / max(float(np.linalg.norm(inside)), 1e-300)
    return found
