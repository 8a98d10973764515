"""Plans: the planes and arms of a touch at a place."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.touch import Touch
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.patch.geometry.kinks import kinks
from touchatlas.planner.approach import approach_within
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan, Reason

# Width of the spiral of first attempts, in scales of the atlas: with a scale of five deviations of
# noise, a probe that is good to 1/5,000 of it. Doubled, the attempts are twice as far apart.
_FIRST_EXTENT = 1000.0
# Arms of a first touch in scales of the atlas, their samples, and the largest angle by which they
# turn. Doubled, the first touch goes round small bodies.
_FIRST_REACH, _FIRST_SAMPLES, _FIRST_TURN = 200.0, 12, np.pi / 4.0
# Factor by which arms and steps shrink where contours were too short for a patch. Doubled, more
# touches fail in narrow places.
_CLOSER = 0.35
# Arms end where the predicted deviation is below this fraction of the atlas's scale: 99.5 % of
# normal errors are less than the scale there, and more samples teach little. Doubled, arms are
# shorter, more touches are needed, and textured bodies stay below the share that is asked.
_KNOWN = 0.36
# Sine of the angle between an arc and the approach, no unit, below which the arc is part of the
# side from which the probe came: 30 degrees from across. Doubled, it may be another side.
_FACING = 0.5
# Cosine of the angle between an arc and the approach beyond which the probe came along it: 30
# degrees. Doubled in angle, sides of blunt edges are approached across.
_ALONG = np.cos(np.pi / 6.0)
# Distance from which a probe comes to what is known, in steps: the first approach may have begun
# behind an opposite wall. Doubled, it begins there in slots of less than four steps.
_SURELY = 2.0
# Least distance of the ends of a contour over its length, no unit: below it the contour is closed.
# Doubled, contours that bend by three quarters of a turn are left out.
_OPEN = 0.1
# Distance of a contact from the middle of that arc, over its length, from which the contact is at
# an edge. Doubled, only contacts at its very end are.
_ASIDE = 0.25


def plan_at(atlas: Atlas, target: Target, extent: float, options: PlannerOptions) -> ProbePlan:
    """The plan of a touch at a target, with its first plane across the nearest contour. Its arms
    may end where the surface is known, but where that is to be verified.

    Its number is 0. ``extent`` is the length that reach and step of the options are fractions of.
    """
    pool, normal = atlas.pool, target.normal
    along = cross(pool.across[pool.nearest(target.point)], normal)
    heading = cross(normal, along)
    if heading @ heading < np.finfo(float).eps:
        heading = any_tangent(normal)
    planes = concurrent_planes(target.point, normal, heading, options.curves)
    plan = ProbePlan(
        0,
        target.point,
        normal,
        planes,
        options.reach * extent,
        options.step * extent,
        options.max_turn,
        target.reason,
        step_turn=options.step_turn,
    )
    plan = coming_clear(plan, atlas)
    return plan if target.reason is Reason.VERIFY else ending_where_known(plan, atlas)


def coming_clear(plan: ProbePlan, atlas: Atlas) -> ProbePlan:
    """A plan whose approach begins on this side of what is known to face its place."""
    pool, usual = atlas.pool, plan.usual_approach
    return replace(plan, approach=approach_within(pool, plan.reference_point, plan.normal, usual))


def ending_where_known(plan: ProbePlan, atlas: Atlas) -> ProbePlan:
    """A plan whose arms may end where the atlas knows the surface."""
    return replace(plan, until=known_to(atlas, _KNOWN * atlas.scale))


def closer_plan(plan: ProbePlan, curves: int, turn: float) -> ProbePlan:
    """A plan at the same place with finer steps and shorter arms, in ``curves`` planes, whose arms
    may turn by ``turn``, rad."""
    heading = cross(plan.planes[0].normal, plan.normal)
    planes = concurrent_planes(plan.reference_point, plan.normal, heading, curves)
    reach, step = _CLOSER * plan.reach, _CLOSER * plan.step
    return replace(plan, planes=planes, reach=reach, step=step, max_turn=turn)


def beside_plan(plan: ProbePlan, touch: Touch, curves: int) -> ProbePlan | None:
    """A plan beside a contact at a sharp edge, in ``curves`` planes: in the middle of the longest
    smooth arc that faces the probe. None where there is none, or the contact is near its middle."""
    arcs = [arc for contour in touch.contours for arc in _open_arcs(contour)]
    if len(plan.planes) == 1 or not arcs:
        return None
    # From the middle of an arc to both of its ends.
    halves = np.array([[arc[0], arc[-1]] - arc[len(arc) // 2] for arc in arcs])
    lengths = np.linalg.norm(halves, axis=2)
    faces = (np.abs(halves @ plan.normal) < _FACING * lengths).all(axis=1)
    longest = int(np.where(faces, lengths.sum(axis=1), 0.0).argmax())
    point = arcs[longest][len(arcs[longest]) // 2]
    aside = np.linalg.norm(point - touch.contact) > _ASIDE * lengths[longest].sum()
    if not (faces[longest] and aside):
        return None
    heading = cross(plan.planes[0].normal, plan.normal)
    planes = concurrent_planes(point, plan.normal, heading, curves)
    return replace(plan, reference_point=point, planes=planes)


def across_plan(plan: ProbePlan, touch: Touch, curves: int) -> ProbePlan | None:
    """A plan beside a contact at a thin edge, in ``curves`` planes: across the longest smooth arc
    along which the probe came, from the side that rather faces it. None where there is none."""
    arcs = [arc for contour in touch.contours for arc in _open_arcs(contour)]
    chords = np.reshape([arc[-1] - arc[0] for arc in arcs], (-1, 3))
    lengths = np.linalg.norm(chords, axis=1)
    along = np.abs(chords @ plan.normal) > _ALONG * lengths
    if not along.any():
        return None
    longest = int(np.where(along, lengths, 0.0).argmax())
    heading = chords[longest] / lengths[longest]
    outward = plan.normal - (plan.normal @ heading) * heading
    size = float(np.linalg.norm(outward))
    if not size > np.sqrt(np.finfo(float).eps):
        return None
    point, normal = arcs[longest][len(arcs[longest]) // 2], outward / size
    planes = concurrent_planes(point, normal, heading, curves)
    return replace(plan, reference_point=point, normal=normal, planes=planes)


def _open_arcs(contour: Contour) -> list[np.ndarray]:
    """The arcs (k, 3) of a contour between its kinks; none of a closed one."""
    points = contour.points
    way = np.linalg.norm(points[-1] - points[0])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    if not way > _OPEN * length:
        return []
    found = kinks(points, contour.plane.normal, contour.noise_std).tolist()
    return [points[a:b] for a, b in pairwise([0, *found, len(points)])]


def known_plan(plan: ProbePlan, atlas: Atlas) -> ProbePlan | None:
    """A plan at the known sample nearest to a place that the probe missed, with its first plane
    through that place: its contour shows how the surface bends away or ends. None where no sample
    faces as the place does."""
    pool, missed = atlas.pool, plan.reference_point
    facing = np.flatnonzero(pool.normals @ plan.normal > 0.0)
    if not len(facing):
        return None
    offset = missed - pool.points[facing]
    nearest = int((offset * offset).sum(axis=1).argmin())
    point, normal = pool.points[facing[nearest]], pool.normals[facing[nearest]]
    away = offset[nearest] - (offset[nearest] @ normal) * normal
    if not away @ away > 0.0:
        return None
    planes = concurrent_planes(point, normal, away, len(plan.planes))
    near = coming_clear(replace(plan, reference_point=point, normal=normal, planes=planes), atlas)
    return replace(near, approach=min(near.approach or np.inf, _SURELY * plan.step))


def first_plan(start, outward, offset, scale: float, options: PlannerOptions) -> ProbePlan:
    """The plan of a first touch at an offset (3,) in extents of the spiral of ``start_targets``,
    with short arms: nothing is known of the size."""
    point, reach = start + _FIRST_EXTENT * scale * offset, _FIRST_REACH * scale
    planes = concurrent_planes(point, outward, any_tangent(outward), options.curves)
    return ProbePlan(
        0,
        point,
        outward,
        planes,
        reach,
        reach / _FIRST_SAMPLES,
        _FIRST_TURN,
        Reason.START,
        step_turn=options.step_turn,
    )


def known_to(atlas: Atlas, limit: float) -> Callable[[np.ndarray], np.ndarray]:
    """A function from points (n, 3) to whether (n,) the surface is known there to a deviation: the
    points lie within three deviations of it, and its deviation is ``limit`` at most, length."""

    def known(points: np.ndarray) -> np.ndarray:
        if atlas.body is None:
            return np.zeros(len(points), bool)
        found, sure = atlas.body.at(points)
        near = np.abs(found.distance) <= 3.0 * limit
        return np.asarray(sure & (found.deviation <= limit) & near)

    return known
