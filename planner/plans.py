"""Plans: the planes and arms of a touch at a place."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.frontier.frontier_planner import FrontierOptions
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target
from touchatlas.planner.place.places import known_to
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan

# Width of the spiral of first attempts, in scales of the atlas: with a scale of five deviations of
# noise, a probe that is good to 1/5,000 of it. Doubled, the attempts are twice as far apart.
_FIRST_EXTENT = 1000.0
# Factor by which arms and steps shrink where contours were too short for a patch. Doubled, more
# touches fail in narrow places.
_CLOSER = 0.35
# Arms end where the predicted deviation is below this fraction of the atlas's scale: 99.5 % of
# normal errors are less than the scale there, and more samples teach little. Doubled, arms are
# shorter, more touches are needed, and textured bodies stay below the share that is asked.
_KNOWN = 0.36
# Longest arm of a section, in extents: a body that is not folded closes within it, as its sections
# are no longer than 4 extents. Doubled, those of folded bodies close as well, and others run on.
_SECTION = 2.0


def plan_at(atlas: Atlas, target: Target, extent: float, options: PlannerOptions) -> ProbePlan:
    """The plan of a touch at a target, with its first plane across the nearest contour.

    Its number is 0. ``extent`` is the length that reach and step of the options are fractions of.
    """
    if target.across is not None:
        return _section_plan(target, target.across, extent, options)
    pool, normal = atlas.membership.pool, target.normal
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
    return ending_where_known(plan, atlas)


def _section_plan(target: Target, across, extent: float, options: PlannerOptions) -> ProbePlan:
    """The plan of one whole section: arms turn as far as the body does, and end where they meet."""
    planes = (SamplingPlane(target.point, across),)
    reach, step = _SECTION * extent, options.step * extent
    return ProbePlan(
        0,
        target.point,
        target.normal,
        planes,
        reach,
        step,
        np.pi,
        target.reason,
        step_turn=options.step_turn,
    )


def ending_where_known(plan: ProbePlan, atlas: Atlas) -> ProbePlan:
    """A plan whose arms may end where the atlas knows the surface."""
    return replace(plan, until=known_to(atlas, _KNOWN * atlas.scale))


def closer_plan(plan: ProbePlan, curves: int) -> ProbePlan:
    """A plan at the same place with finer steps and shorter arms, in ``curves`` planes."""
    heading = cross(plan.planes[0].normal, plan.normal)
    planes = concurrent_planes(plan.reference_point, plan.normal, heading, curves)
    return replace(plan, planes=planes, reach=_CLOSER * plan.reach, step=_CLOSER * plan.step)


def turned_plan(plan: ProbePlan, atlas: Atlas) -> ProbePlan | None:
    """A plan for a place that the probe missed beside a surface that bends away; None where no
    sample faces as the place does.

    The probe comes half from the side, between the place and the nearest sample.
    """
    pool, normal = atlas.membership.pool, plan.normal
    beside = np.flatnonzero(pool.normals @ normal > 0.0)
    offset = plan.reference_point - pool.points[beside]
    if not len(beside):
        return None
    nearest = int((offset * offset).sum(axis=1).argmin())
    away = offset[nearest] - (offset[nearest] @ normal) * normal
    if not away @ away > 0.0:
        return None
    outward = normal + away / np.sqrt(away @ away)
    outward /= np.sqrt(outward @ outward)
    point = plan.reference_point - 0.5 * offset[nearest]
    planes = concurrent_planes(point, outward, cross(outward, away), len(plan.planes))
    return replace(plan, reference_point=point, normal=outward, planes=planes)


def first_plan(plan: ProbePlan, offset, scale: float, options: PlannerOptions) -> ProbePlan:
    """The plan of a first touch at an offset (3,) in extents of the spiral of
    ``start_targets``."""
    point = plan.reference_point + _FIRST_EXTENT * scale * offset
    heading = cross(plan.planes[0].normal, plan.normal)
    planes = concurrent_planes(point, plan.normal, heading, options.curves)
    return replace(plan, reference_point=point, planes=planes, step_turn=options.step_turn)


def arms_beside_edges(options: PlannerOptions, extent: float) -> FrontierOptions:
    """Options of plans beside edges, with arms and steps of a planner; ``extent`` in scales."""
    reach, usual = options.reach * extent, FrontierOptions()
    return FrontierOptions(
        options.curves,
        int(options.reach / options.step),
        min(options.max_turn, usual.max_turn),
        reach,
        min(usual.least_reach, reach),
    )
