"""Plans: the sampling planes and arms of a touch at a target."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal
from touchatlas.planner.attempts import Target
from touchatlas.planner.clearance import clear_height
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.probe_plan import ProbePlan, Reason
from touchatlas.planner.region import region_of
from touchatlas.planner.safe_ways import ways_of


def concurrent_planes(point, normal, heading, count: int) -> tuple[SamplingPlane, ...]:
    """``count`` sampling planes through a point that contain the normal, at even angles.

    Even angles (60 degrees for three planes) give the system for the principal curvatures its best
    condition number, sqrt 2 (see ``curvatures_from_sections``).

    Parameters
    ----------
    point : (3,) float, length, world
    normal : (3,) float, unit, world
    heading : (3,) float, world
        Direction whose part across the normal lies in the first plane.
    count : int
    """
    e1, e2, _ = axes_from_normal(normal, heading)
    angles = np.pi / count * np.arange(count)
    return tuple(SamplingPlane(point, np.cos(a) * e2 - np.sin(a) * e1) for a in angles)


def plan_at(atlas: Atlas, target: Target, options: PlannerOptions) -> ProbePlan:
    """The plan of a touch at a target, with the number 0.

    Its arms may end where the surface is known, but where that is to be verified, and in a search.
    Those of a first touch are short: nothing is known of the size.
    """
    point, normal, levels = target.point, target.normal, options.levels
    planes = concurrent_planes(point, normal, _heading(atlas, target), options.curves)
    extent, starts = atlas.pool.extent, target.reason is Reason.START
    reach, step = options.reach * extent, options.step * extent
    if starts:
        # With a scale of five deviations of the noise, a fifth of the extent of a body to which
        # the probe is good to 1/5000.
        reach, step = 200.0 * atlas.scale, 200.0 / 12.0 * atlas.scale
    shrink = levels.closer**target.closer
    # The second time closer, arms may turn farther: the contact may be on a sharp edge.
    turn = min(np.pi / 4.0, options.max_turn) if starts and target.closer < 2 else options.max_turn
    plan = ProbePlan(
        0,
        point,
        normal,
        planes,
        shrink * reach,
        shrink * step,
        turn,
        target.reason,
        step_turn=options.step_turn,
        approach=target.approach,
    )
    if target.reason is not Reason.SEARCH:
        within = clear_height(atlas, point, normal, plan.usual_approach)
        nearer = [one for one in (within, target.approach) if one > 0.0]
        plan = replace(plan, approach=min(nearer, default=0.0))
    return ending_where_known(plan, atlas, options)


def ending_where_known(plan: ProbePlan, atlas: Atlas, options: PlannerOptions) -> ProbePlan:
    """A plan whose ways keep clear of what the atlas knows, and whose arms may end where it knows
    the surface, or it is not wanted, if arms for its reason may."""
    plan = replace(plan, way=ways_of(atlas, options.levels.room * atlas.pool.extent))
    if plan.reason not in (Reason.EXPAND, Reason.REFINE):
        return plan
    known = known_to(atlas, options)
    if not options.region or options.elsewhere:
        return replace(plan, until=known)
    region = region_of(options.region)
    if region.distance(plan.reference_point[None])[0] > 0.0:
        return replace(plan, until=known)
    return replace(plan, until=lambda points: known(points) | (region.distance(points) > 0.0))


def known_to(atlas: Atlas, options: PlannerOptions) -> Callable[[np.ndarray], np.ndarray]:
    """A function from points (n, 3) to whether (n,) the surface is known there: its deviation is
    within the level of the options, and the points lie on it as surely."""
    limit = options.levels.known * atlas.scale

    def known(points: np.ndarray) -> np.ndarray:
        if atlas.body is None:
            return np.zeros(len(points), bool)
        found, sure = atlas.body.at(points)
        near = np.abs(found.distance) <= atlas.levels.sure * limit
        return np.asarray(sure & (found.deviation <= limit) & near)

    return known


def _heading(atlas: Atlas, target: Target) -> np.ndarray:
    """Direction (3,) in the first plane: that of the target, else across the nearest contour."""
    pool, normal = atlas.pool, target.normal
    if target.heading is not None:
        return target.heading
    if not len(pool):
        return any_tangent(normal)
    heading = cross(normal, cross(pool.across[pool.nearest(target.point)], normal))
    return any_tangent(normal) if heading @ heading < np.finfo(float).eps else heading
