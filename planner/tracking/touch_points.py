"""A plan carried out by a machine that triggers: single points in place of tracked curves."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import cross, frozen_array
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.order import out_of_order
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.going import arrives
from touchatlas.planner.tracking.machines import Trigger
from touchatlas.planner.tracking.options import Tip, TriggerOptions
from touchatlas.planner.tracking.points_touched import touch_in_vain, touch_of_centres


@dataclass(frozen=True, eq=False)
class _Hop:
    """A place of the tip in contact: its centre, the direction of travel, that outward, (3,); by
    which angle the curve turns inward in a step, rad; and how far, in rad, that may be off."""

    centre: np.ndarray
    along: np.ndarray
    outward: np.ndarray
    bend: float = 0.0
    off: float = np.pi

    def lifted(self, height: float) -> np.ndarray:
        """(3,) the centre lifted off the surface."""
        found: np.ndarray = self.centre + height * self.outward
        return found

    def around(self, radius: float, angle: float) -> np.ndarray:
        """(3,) the place on a circle about the centre at an angle inward from straight ahead."""
        along = np.cos(angle) * self.along - np.sin(angle) * self.outward
        found: np.ndarray = self.centre + radius * along
        return found


def touch_points(
    trigger: Trigger,
    plan: ProbePlan,
    tip: Tip = Tip(),
    options: TriggerOptions = TriggerOptions(),
) -> Touch:
    """Carry out a plan with a machine that triggers.

    Each arm becomes some points a fraction of its reach apart: where circles about the points
    before meet the surface, whether it goes on, ends at an edge, or rises as a wall.

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
    before = frozen_array(trigger.position(), (3,), "position of the trigger")
    if not arrives(trigger, before, plan.way_from(before)):
        return touch_in_vain(plan, TouchStatus.UNREACHABLE, tip)
    centre = _met(trigger, target)
    if centre is None:
        trigger.move(origin[None])
        return touch_in_vain(plan, TouchStatus.NO_CONTACT, tip)
    contours: list[Contour] = []
    for plane in plan.planes:
        along = cross(plan.normal, plane.normal)
        # One contour has to be long enough to show on which side of it the body is.
        is_long = any(len(one.points) >= LEAST_POINTS for one in contours)
        least = 1 if is_long else LEAST_POINTS // 2
        how = plan, options, least
        ahead, last = _arm(trigger, _Hop(centre, along, plan.normal), *how)
        behind, first = _arm(trigger, _Hop(centre, -along, plan.normal), *how, ahead)
        points = np.vstack([behind[::-1], centre, ahead])
        # All around a body a few points have no order that can be told.
        while len(points) >= LEAST_POINTS and out_of_order(points):
            points = points[1:-1]
        noise = tip.sample_std(1)
        contours.append(Contour(points, SamplingPlane(centre, plane.normal), noise, (first, last)))
    trigger.move(origin[None])
    return touch_of_centres(plan, centre, contours, tip)


def _met(trigger: Trigger, target) -> np.ndarray | None:
    """Where a trigger met something on its way to a target (3,); None where it met nothing."""
    place = trigger.probe(target)
    return None if place is None else frozen_array(place, (3,), "place that probe returned")


def _arm(
    trigger: Trigger, first: _Hop, plan: ProbePlan, options: TriggerOptions, least: int, other=()
):
    """Centres (k, 3) of the points of an arm, and why it ended; the tip is then above the contact
    again, on the way that it came. It ends where it comes to points (m, 3) of the ``other`` arm,
    around the body, or after the ``least`` points to known surface."""
    hops, end, step = [first], ContourEnd.LENGTH_REACHED, plan.reach / options.points
    air = [first.lifted(options.retract)]
    trigger.move(air[0][None])
    while len(hops) <= options.points:
        ahead = hops[-1].around(step, hops[-1].bend / 2.0)
        known = plan.until is not None and len(hops) > least and plan.until(ahead[None])[0]
        if known or (np.linalg.norm(ahead - np.reshape(other, (-1, 3)), axis=1) < 0.5 * step).any():
            # A point there teaches nothing.
            break
        found = _next(trigger, hops[-1], step, options, air)
        if found is None:
            end = ContourEnd.TURNED_AWAY
            break
        hops.append(_with_direction(hops, found, 2.0 * options.turn))
        if hops[-1].along @ first.along < np.cos(plan.max_turn):
            end = ContourEnd.TURNED_AWAY
            break
    _back(trigger, air, cross(first.outward, first.along))
    return np.array([hop.centre for hop in hops[1:]]).reshape(-1, 3), end


def _back(trigger: Trigger, air: list[np.ndarray], w: np.ndarray) -> None:
    """Go from the last of free places (3,) to the first: over the outer ones, within the plane of a
    normal w (3,), where that way is free, else through all of them."""
    way = _outer(air, w)[::-1]
    if not arrives(trigger, air[-1], np.array(way[1:]).reshape(-1, 3)):
        trigger.move(np.array(air[::-1]))


def _outer(places: list[np.ndarray], w: np.ndarray) -> list[np.ndarray]:
    """The places (3,) of a way that are on no chord's inner side: the outer hull of a way that
    turns inward (Graham, An efficient algorithm for determining the convex hull, 1972)."""
    kept: list[np.ndarray] = []
    for place in places:
        while len(kept) > 1 and (kept[-1] - kept[-2]) @ cross(place - kept[-2], w) <= 0.0:
            kept.pop()
        kept.append(place)
    return kept


def _next(
    trigger: Trigger, hop: _Hop, step: float, options: TriggerOptions, air: list[np.ndarray]
) -> np.ndarray | None:
    """The centre (3,) of the next point of an arm: where a circle about the last one, gone inward
    in chords, meets the surface; None where it does not. The tip begins and ends at the last of the
    free places ``air``, which grow. The first chord ends as far below the expected place as it
    begins above, as far as it is no longer than others."""
    above = min(options.turn, hop.off + options.retract / step)
    begun = _begun(trigger, hop, step, above, options, air)
    if begun is None:
        return None
    gone, angle = begun
    chord, last = min(options.turn, 2.0 * above), _last(options)
    while angle < last:
        angle, chord = angle + chord, options.turn
        target = hop.around(step, angle)
        centre = _met(trigger, target)
        if centre is None:
            gone.append(target)
            continue
        away = gone[-1] - centre
        length = float(np.linalg.norm(away))
        gone.append(centre + min(1.0, options.retract / max(length, 1e-300)) * away)
        trigger.move(gone[-1][None])
        air += gone
        return centre
    trigger.move(np.array([*gone[-2::-1], air[-1]]))
    return None


def _begun(
    trigger: Trigger, hop: _Hop, step: float, above: float, options: TriggerOptions, air
) -> tuple[list[np.ndarray], float] | None:
    """Go from the last of free places ``air`` to where the measurement of the next point begins: on
    the circle, by an angle ``above`` the expected place, and higher where the way there is blocked.
    Free places (3,) on that way, and the angle where it ends; None where all are blocked."""
    angle, over = 0.5 * hop.bend - above, _over(hop, step, options.retract)
    while not arrives(trigger, air[-1], np.array([*over, hop.around(step, angle)])):
        angle, over = angle - options.turn, []
        if angle < -_last(options):
            return None
    return [*over, hop.around(step, angle)], angle


def _last(options: TriggerOptions) -> float:
    """Angle between straight ahead and where a search ends, straight in or straight out, rad: less
    what is between the tip and the point before."""
    return 0.5 * np.pi + options.turn


def _over(hop: _Hop, step: float, height: float) -> list[np.ndarray]:
    """Where a way to the next point passes in a height over the middle of the arc that is expected:
    one point (3,), or none where the arc rises by less than half of that above its chord."""
    if 0.125 * step * hop.bend < 0.5 * height:
        return []
    return [hop.around(0.5 * step, 0.25 * hop.bend) + height * hop.outward]


def _with_direction(hops: list[_Hop], centre: np.ndarray, most: float) -> _Hop:
    """A point (3,) found after others: it travels, and bends, as an arc through the last three, or,
    of two, through these in the first one's direction. A curve that turned by more than ``most`` in
    a step had an edge, which is over."""
    w = cross(hops[0].outward, hops[0].along)
    chord, before = _unit(centre - hops[-1].centre, w), hops[-1].along
    if len(hops) > 1:
        before = _unit(hops[-1].centre - hops[-2].centre, w)
    inward = -cross(chord, w)
    turn = float(np.arctan2(-(before @ inward), before @ chord))
    # Of a direction at a point the chord has turned by half a step, of a chord by a whole one.
    bend = turn if len(hops) > 1 else 2.0 * turn
    bend = float(np.clip(bend, -most, most))
    off = np.pi if len(hops) == 1 else abs(bend - hops[-1].bend)
    along = np.cos(0.5 * bend) * chord + np.sin(0.5 * bend) * inward
    return _Hop(centre, along, cross(along, w), bend, off)


def _unit(chord: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(3,) unit direction of a chord within the plane of a normal."""
    inside = chord - (chord @ w) * w
    found: np.ndarray = inside / max(float(np.linalg.norm(inside)), 1e-300)
    return found
