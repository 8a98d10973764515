"""Planner: it touches where least is known, until that is known to the tolerance."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import check_unit, cross, frozen_array
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.choose import (
    Target,
    View,
    hole_targets,
    open_places,
    start_targets,
    worst_target,
)
from touchatlas.planner.frontier_planner import FrontierOptions, FrontierPlanner
from touchatlas.planner.options import FRONTIER, PlannerOptions
from touchatlas.planner.places import Places, known_to
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan, check_answer
from touchatlas.planner.rules import RULES
from touchatlas.planner.stop import Forecast, Stop, StopReason

# Width of the spiral of first attempts, in scales of the atlas: with a scale of five deviations of
# noise, a probe that is good to 1/5,000 of it. Doubled, the attempts are twice as far apart.
_FIRST_EXTENT = 1000.0
# Factor by which arms and steps shrink where contours were too short for a patch, and how often.
# Before any patch nothing is known of the size, so it is tried more often. Doubled, more touches
# fail in narrow places.
_CLOSER, _TIMES_CLOSER, _TIMES_CLOSER_FIRST = 0.35, 2, 5
# Arms beside edges, in arms elsewhere: each patch must be a disc within its face. Doubled, cores
# overlap other faces, and some edges between faces are not found.
_BESIDE_EDGES = 0.75
# Arms end where the predicted deviation is below this fraction of the atlas's scale: there they
# teach little. Doubled, arms are shorter and more touches are needed.
_KNOWN = 0.5
# How often the surface is drawn to look for holes. Doubled, some more holes are closed, and
# explorations that leave many take longer.
_LOOKS = 4
# Stagnation: the area within the tolerance has not grown by this fraction in so many touches, or
# in the last quarter of all touches. Doubled, an exploration is given up earlier, or goes on for
# twice as long.
_LEAST_GAIN, _PATIENCE, _PATIENCE_FRACTION = 2e-3, 16, 0.25


class Planner:
    """Chooses the reference points and sampling planes that make the surface known to the
    tolerance with few touches.

    Places where nothing is known come first, those far from all touches before others; then
    places of large predicted deviation. Neither choice depends on the tolerance, so a looser one
    ends the same sequence of touches earlier. Only the last touches, at single places whose
    deviation exceeds the tolerance, depend on it.

    Where the probe reports edges, the plans are those
    of ``FrontierPlanner``.

    Parameters
    ----------
    start : (3,) float, length, world
        Reference point of the first touch.
    outward : (3,) float, unit, world
        Direction from the object to the free space from which ``start`` is approached.
    options : PlannerOptions
    rng : numpy.random.Generator, optional
        For the rule "random" only.

    Attributes
    ----------
    stop : Stop or None
        Why there is no further plan, and what is left; None before the end.

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
    """

    def __init__(
        self,
        start,
        outward,
        options: PlannerOptions = PlannerOptions(),
        rng: np.random.Generator | None = None,
    ) -> None:
        if not isinstance(options, PlannerOptions):
            raise ValueError(f"options are {options!r}; they must be PlannerOptions")
        self._start = frozen_array(start, (3,), "start point")
        self._outward = check_unit(outward, "outward direction")
        self.options, self._rng = options, rng
        self.stop: Stop | None = None
        self._places = Places()
        self._stale: set[int] = set()
        self._told = 0
        self._asked: ProbePlan | None = None
        self._retry: ProbePlan | None = None
        self._closer_count = 0
        self._touched: list[np.ndarray] = []
        self._tried: list[np.ndarray] = []
        self._area: list[float] = []
        self._coverage = 0.0
        self._beside_edges = FrontierPlanner(self._start, self._outward)
        self._starts = start_targets(self._start, self._outward)
        self._count = 0
        self._holes: list[Target] = []
        self._looked = 0

    def ask(self, atlas: Atlas) -> ProbePlan | None:
        """The next plan; None at the end, and ``stop`` says why.

        Without ``tell`` in between, a second call returns the same plan.

        Raises
        ------
        ValueError
            When the argument is no Atlas.
        """
        if not isinstance(atlas, Atlas):
            raise ValueError(f"got {type(atlas).__name__}; ask needs the Atlas that learns")
        if self._asked is None:
            self.stop = None
            plan: ProbePlan | None
            if self._retry is not None:
                plan, self._retry = self._closer(self._retry), None
            elif len(atlas) == 0:
                plan = self._start_plan(atlas)
            else:
                plan = self._next_plan(atlas)
            self._asked = None if plan is None else replace(plan, known=self._coverage)
        return self._asked

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of the plan last asked for.

        Raises
        ------
        ValueError
            See ``check_answer``.
        """
        asked = check_answer(self._asked, touch, change)
        self._tried.append(asked.reference_point)
        met = touch.status is TouchStatus.TOUCHED
        if met and not change.refused:
            self._touched.append(touch.contact)
        alone = not self._beside_edges.is_open
        most = _TIMES_CLOSER if self._touched else _TIMES_CLOSER_FIRST
        if met and change.refused and alone and self._closer_count < most:
            self._retry, self._closer_count = asked, self._closer_count + 1
        else:
            self._closer_count = 0
        if self._beside_edges.is_open:
            number = self._beside_edges.count
            self._beside_edges.tell(replace(touch, number=number), replace(change, touch=number))
        self._stale.update((*change.added, *change.changed))
        self._told += 1
        self._count += 1
        self._asked = None

    def _next_plan(self, atlas: Atlas) -> ProbePlan | None:
        """A plan where nothing is known, else where too little is known."""
        if atlas.membership.pool.edges.any():
            # A new crease changes what patches see that no change names.
            self._places = Places()
        self._update(atlas)
        extent = self._extent(atlas)
        inside, total = self._places.areas(atlas)
        self._area.append(inside)
        self._coverage = inside / total if total > 0.0 else 0.0
        if self.options.name == FRONTIER:
            return self._plan_as_frontier(atlas)
        if atlas.membership.pool.edges.any():
            self._beside_edges.options = self._long_arms(atlas)
            return self._plan_as_frontier(atlas)
        done = np.array([*self._touched, *self._tried])
        view = View(atlas, self._places, np.array(self._touched), done, extent)
        known = self._coverage >= self.options.coverage and not len(open_places(view)[0])
        stagnates = self._stagnates()
        target = None if known or stagnates else RULES[self.options.name](view, self._rng)
        reason = StopReason.STAGNATION if stagnates else StopReason.TRIED
        if target is None:
            # Single places are left, where the surface would have holes.
            target = worst_target(view) if known else None
            target = self._next_hole(view) if target is None else target
            reason = StopReason.KNOWN if known else reason
        return self._end(atlas, reason) if target is None else self._plan(atlas, target, extent)

    def _next_hole(self, view: View) -> Target | None:
        """The next hole of the surface; None where there is none, or they were looked for too
        often."""
        if not self._holes and self._looked < _LOOKS:
            self._holes, self._looked = hole_targets(view)[:_PATIENCE], self._looked + 1
        return self._holes.pop(0) if self._holes else None

    def _plan_as_frontier(self, atlas: Atlas) -> ProbePlan | None:
        """The plan of a FrontierPlanner. Where the probe reports edges, patches end there, so that
        their cores must fill the faces."""
        plan = self._beside_edges.ask(atlas)
        if plan is not None:
            return replace(plan, number=self._count)
        known = self._coverage >= self.options.coverage
        return self._end(atlas, StopReason.KNOWN if known else StopReason.TRIED)

    def _long_arms(self, atlas: Atlas) -> FrontierOptions:
        """Options of plans beside edges, with arms and steps of this planner."""
        extent, options = self._extent(atlas) / atlas.scale, self.options
        reach = _BESIDE_EDGES * options.reach * extent
        return FrontierOptions(
            options.curves,
            int(_BESIDE_EDGES * options.reach / options.step),
            min(options.max_turn, FrontierOptions().max_turn),
            reach,
            min(FrontierOptions().least_reach, reach),
        )

    def _stagnates(self) -> bool:
        """Whether the area within the tolerance has not grown for long."""
        patience = max(_PATIENCE, int(_PATIENCE_FRACTION * len(self._area)))
        before, since = self._area[:-patience], self._area[-patience:]
        return bool(before) and max(since) < (1.0 + _LEAST_GAIN) * max(before)

    def _end(self, atlas: Atlas, reason: StopReason) -> ProbePlan | None:
        """No plan: ``stop`` says why."""
        self.stop = Stop(reason, self.forecast(atlas))
        return None

    def forecast(self, atlas: Atlas) -> Forecast:
        """What is known of the surface of an atlas, and where too little is."""
        if not len(atlas):
            return Forecast(0.0, np.zeros((0, 3)))
        self._update(atlas)
        inside, total = self._places.areas(atlas)
        left = self._places.left(atlas, self._extent(atlas))
        return Forecast(inside / total if total > 0.0 else 0.0, left)

    def _update(self, atlas: Atlas) -> None:
        """Compute the places of the patches that changed since the last time."""
        self._places.update(atlas, self._stale, self._told)
        self._stale, self._told = set(), 0

    def _extent(self, atlas: Atlas) -> float:
        """Diagonal of the bounding box of all samples, length."""
        points = atlas.membership.pool.points
        return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))

    def _start_plan(self, atlas: Atlas) -> ProbePlan | None:
        """The next attempt at a first touch, with short arms: nothing is known of the size."""
        offset = next(self._starts, None)
        if offset is None:
            return self._end(atlas, StopReason.NO_PATCH)
        plan = self._beside_edges.start_plan(atlas)
        point = self._start + _FIRST_EXTENT * atlas.scale * offset
        heading = cross(plan.planes[0].normal, plan.normal)
        planes = concurrent_planes(point, plan.normal, heading, self.options.curves)
        return replace(plan, number=self._count, reference_point=point, planes=planes)

    def _plan(self, atlas: Atlas, target: Target, extent: float) -> ProbePlan:
        """The plan of a touch at a target, with its first plane across the nearest contour."""
        pool, normal = atlas.membership.pool, target.normal
        offset = pool.points - target.point
        along = cross(pool.across[(offset * offset).sum(axis=1).argmin()], normal)
        heading = cross(normal, along)
        if heading @ heading < np.finfo(float).eps:
            heading = any_tangent(normal)
        until = known_to(atlas, _KNOWN * atlas.scale)
        return self._probe_plan(target.point, normal, heading, extent, target.reason, until)

    def _closer(self, plan: ProbePlan) -> ProbePlan:
        """A plan at the same place with finer steps and shorter arms."""
        heading = cross(plan.planes[0].normal, plan.normal)
        planes = concurrent_planes(plan.reference_point, plan.normal, heading, self.options.curves)
        return ProbePlan(
            self._count,
            plan.reference_point,
            plan.normal,
            planes,
            _CLOSER * plan.reach,
            _CLOSER * plan.step,
            plan.max_turn,
            plan.reason,
            plan.until,
        )

    def _probe_plan(self, point, normal, heading, extent, reason, until) -> ProbePlan:
        """The next ProbePlan."""
        options = self.options
        planes = concurrent_planes(point, normal, heading, options.curves)
        reach, step = options.reach * extent, options.step * extent
        number, turn = self._count, options.max_turn
        return ProbePlan(number, point, normal, planes, reach, step, turn, reason, until)
