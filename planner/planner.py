"""Planner: it touches where least is known, until that is known to the tolerance."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.lawful_surface import fine_edge
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import check_unit, frozen_array
from touchatlas.planner.frontier.frontier_planner import FrontierPlanner
from touchatlas.planner.options import FRONTIER, TOLERANCE, PlannerOptions
from touchatlas.planner.pending import Pending
from touchatlas.planner.place.choose import (
    Target,
    View,
    hole_targets,
    open_places,
    rim_target,
    slip_target,
    start_targets,
)
from touchatlas.planner.place.deviation_ratio import DeviationRatio
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.place.lawful_places import LawfulPlaces, lawful_places, lawful_target
from touchatlas.planner.place.places import Places, apart_from_each_other
from touchatlas.planner.place.rules import RULES
from touchatlas.planner.plans import (
    arms_beside_edges,
    closer_plan,
    first_plan,
    plan_at,
    turned_plan,
)
from touchatlas.planner.probe_plan import ProbePlan, Reason, check_answer
from touchatlas.planner.reach import is_reachable
from touchatlas.planner.search import search_plan
from touchatlas.planner.stop import Forecast, Stop, StopReason

# How often contours that were too short for a patch are tried closer. Before any patch nothing is
# known of the size, so it is tried more often. Doubled, more touches fail in narrow places.
_TIMES_CLOSER, _TIMES_CLOSER_FIRST = 2, 5
# How often the surface is drawn to look for holes. Doubled, some more holes are closed, and
# explorations that leave many take longer.
_LOOKS = 4
# Holes that are touched before the surface is drawn again. Doubled, more touches find their holes
# closed already.
_HOLES = 16


class Planner:
    """Chooses the reference points and sampling planes that make the surface known to the
    tolerance with few touches.

    Places where nothing is known come first, those far from all touches before others; then
    places of large predicted deviation. Neither choice depends on the tolerance, so a looser one
    ends the same sequence of touches earlier. Only the last touches, at rims and holes, depend on
    it.

    Where the probe reports edges, the plans are those of ``FrontierPlanner``.

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
        if not (rng is None or isinstance(rng, np.random.Generator)):
            raise ValueError(f"rng is {rng!r}; it must be a numpy.random.Generator")
        self._start = frozen_array(start, (3,), "start point")
        self._outward = check_unit(outward, "outward direction")
        self.options, self._rng = options, rng
        self.stop: Stop | None = None
        self._places = Places()
        self._stale: set[int] = set()
        self._told = 0
        self._pending: dict[int, Pending] = {}
        self._retries: list[Pending] = []
        self._missed: list[ProbePlan] = []
        self._touched: list[np.ndarray] = []
        self._tried: list[np.ndarray] = []
        self._in_vain: list[np.ndarray] = []
        self._unreachable: list[np.ndarray] = []
        self._known = KnownArea()
        self._lawful = False
        self._beside_edges = FrontierPlanner(self._start, self._outward)
        self._starts = list(start_targets(self._start, self._outward))
        # Plans asked for, plans answered, and plans answered when the area was last measured.
        self._count, self._answered, self._measured = 0, 0, -1
        self._holes: list[Target] = []
        self._looked = 0
        # Rays of the search for other parts: a point and the direction of each.
        self._rays: list[np.ndarray] = []

    def ask(self, atlas: Atlas) -> ProbePlan | None:
        """The next plan; None at the end, and ``stop`` says why.

        Without ``tell`` in between, a second call returns the same plan. Of several pending plans
        it is the first.

        Raises
        ------
        ValueError
            When the argument is no Atlas.
        """
        return next(iter(self.ask_several(atlas, 1)), None)

    def ask_several(self, atlas: Atlas, count: int) -> tuple[ProbePlan, ...]:
        """The pending plans, those that ``tell`` has not answered, and new ones up to ``count``
        in all: for a probe of several arms.

        They may be told in any order. A plan whose touch was lost stays pending, so that it is
        returned until it is told. There are fewer than ``count`` where no other place can be
        chosen before one of them is told: at the first touch, beside edges, and at the end.

        Raises
        ------
        ValueError
            When the arguments are no Atlas and no whole number.
        """
        if not isinstance(atlas, Atlas):
            raise ValueError(f"got {type(atlas).__name__}; ask needs the Atlas that learns")
        whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
        if not (whole and count >= 1):
            raise ValueError(f"count is {count!r}; it must be a whole number >= 1")
        self._pending = {number: one.bound(atlas) for number, one in self._pending.items()}
        while len(self._pending) < count:
            self.stop = None
            found = self._further(atlas)
            if found is None:
                break
            plan = replace(found.plan, number=self._count, known=self._known.coverage)
            self._pending[self._count] = replace(found, plan=plan).bound(atlas)
            self._count += 1
        return tuple(one.plan for one in self._pending.values())

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of a pending plan, that of the touch's number.

        Raises
        ------
        ValueError
            See ``check_answer``.
        """
        asked = check_answer([one.plan for one in self._pending.values()], touch, change)
        pending = self._pending.pop(asked.number)
        self._tried.append(asked.reference_point)
        met = touch.status is TouchStatus.TOUCHED
        if met and not change.refused:
            self._touched.append(touch.contact)
        elif not met:
            self._in_vain.append(asked.reference_point)
        most = _TIMES_CLOSER if self._touched else _TIMES_CLOSER_FIRST
        if self._beside_edges.is_open:
            number = self._beside_edges.count
            self._beside_edges.tell(replace(touch, number=number), replace(change, touch=number))
        elif met and change.refused and pending.closer < most:
            self._retries.append(pending)
        elif not met and asked.reason is Reason.EXPAND and not pending.turned:
            self._missed.append(asked)
        self._stale.update((*change.added, *change.changed))
        self._places.deviation_ratio.learn(change.innovations)
        self._told += 1
        self._answered += 1

    def _further(self, atlas: Atlas) -> Pending | None:
        """One more plan, besides those that are pending; None where there is none."""
        if self._retries:
            before = self._retries.pop(0)
            plan = closer_plan(before.plan, self.options.curves)
            return replace(before, plan=plan, closer=before.closer + 1)
        while self._missed:
            turned = turned_plan(self._missed.pop(0), atlas)
            if turned is not None:
                return Pending(turned, turned.until is not None, turned=True)
        found = self._next_plan(atlas) if len(atlas) else self._start_plan(atlas)
        return None if found is None else Pending(found, found.until is not None)

    def _next_plan(self, atlas: Atlas) -> ProbePlan | None:
        """A plan where nothing is known, else where too little is known."""
        body = self._lawful_body(atlas)
        if body is not None:
            return self._plan_of_law(atlas, body)
        if atlas.membership.pool.edges.any():
            # A new crease changes what patches see that no change names.
            self._places.forget()
        self._update(atlas)
        extent = self._extent(atlas)
        view = self._view(atlas, extent)
        areas = self._places.areas(atlas, view.is_untried)
        self._known.measure(*areas, self._measured == self._answered)
        self._measured = self._answered
        if self.options.name == FRONTIER:
            return self._plan_as_frontier(atlas)
        if atlas.membership.pool.edges.any():
            self._beside_edges.options = arms_beside_edges(self.options, extent / atlas.scale)
            return self._plan_as_frontier(atlas)
        while True:
            target, reason = self._target(self._view(atlas, extent))
            if target is None:
                plan = self._search_plan(atlas, extent)
                return self._end(atlas, reason) if plan is None else plan
            if self._reaches(atlas, target):
                return plan_at(atlas, target, extent, self.options)
            self._unreachable.append(target.point)
            self._tried.append(target.point)

    def _lawful_body(self, atlas: Atlas) -> LawfulBody | None:
        """The body of lawful faces that the planner goes by, if there is one; what was learned of
        errors is forgotten when that changes. Where a probe ends its arms at edges, what lies
        beyond comes first."""
        usual = self.options.name == TOLERANCE and not len(atlas.edge_ends)
        body = atlas.body if usual else None
        if (body is not None) != self._lawful:
            self._lawful, self._known = body is not None, KnownArea()
            self._places.deviation_ratio = DeviationRatio()
        return body

    def _plan_of_law(self, atlas: Atlas, body: LawfulBody) -> ProbePlan | None:
        """A plan where the surface of lawful faces ends, else where too little is known."""
        extent = self._extent(atlas)
        view, places = self._view(atlas, extent), lawful_places(body)
        areas = self._law_areas(view, places)
        self._known.measure(*areas, self._measured == self._answered)
        self._measured = self._answered
        stagnates = self._known.stagnates()
        while not stagnates:
            target = lawful_target(view, places)
            if target is None:
                # The surface that is drawn at the end may show smaller holes.
                edge = fine_edge(body, atlas.options.facets * atlas.tolerance)
                target = lawful_target(view, lawful_places(body, edge))
            if target is None:
                break
            if self._reaches(atlas, target):
                return plan_at(atlas, target, extent, self.options)
            self._unreachable.append(target.point)
            self._tried.append(target.point)
            view = self._view(atlas, extent)
        plan = self._search_plan(atlas, extent)
        if plan is not None:
            return plan
        reason = StopReason.UNREACHABLE if self._unreachable else StopReason.TRIED
        reason = StopReason.STAGNATION if stagnates else reason
        known = self._known.coverage >= self.options.coverage
        return self._end(atlas, StopReason.KNOWN if known else reason)

    def _law_areas(self, view: View, places: LawfulPlaces) -> tuple[float, float, float]:
        """See ``LawfulPlaces.areas``."""
        untried = view.is_untried(places.rim)
        return places.areas(view.atlas.tolerance, self._places.deviation_ratio, untried)

    def _search_plan(self, atlas: Atlas, extent: float) -> ProbePlan | None:
        """The next approach in search of other parts; None where no more are asked for."""
        if len(self._rays) >= self.options.search:
            return None
        plan = search_plan(atlas, self._places, self._rays, extent, self.options)
        if plan is not None:
            self._rays.append(np.stack([plan.reference_point, plan.normal]))
        return plan

    def _reaches(self, atlas: Atlas, target: Target) -> bool:
        """Whether the pin of the options reaches a target."""
        pin = self.options.pin_radius, self.options.pin_length
        return is_reachable(atlas, target.point, target.normal, *pin)

    def _target(self, view: View) -> tuple[Target | None, StopReason]:
        """Where to touch next; or None and why."""
        known = self._known.coverage >= self.options.coverage
        # What is open is then a hole of the surface, until that was drawn too often.
        known &= self._looked < _LOOKS or not len(open_places(view)[0])
        stagnates = self._known.stagnates()
        target = None if known or stagnates else RULES[self.options.name](view, self._rng)
        reason = StopReason.UNREACHABLE if self._unreachable else StopReason.TRIED
        reason = StopReason.STAGNATION if stagnates else reason
        if target is None:
            # Slips of the probe are left, rims, and holes of the surface.
            target = slip_target(view)
            target = rim_target(view) if target is None else target
            target = self._next_hole(view) if target is None else target
            reason = StopReason.KNOWN if known else reason
        return target, reason

    def _view(self, atlas: Atlas, extent: float) -> View:
        """What the choice of a place depends on. Pending plans count as touched where they are."""
        pending = [one.plan.reference_point for one in self._pending.values()]
        touched = np.array([*pending, *(self._touched or [self._start])])
        done = np.array([*self._touched, *self._tried]).reshape(-1, 3)
        in_vain = np.reshape(self._in_vain, (-1, 3))
        open_plans = np.reshape(pending, (-1, 3))
        return View(atlas, self._places, touched, done, in_vain, open_plans, extent)

    def _next_hole(self, view: View) -> Target | None:
        """The next hole of the surface; None where there is none, or they were looked for too
        often."""
        if not self._holes and self._looked < _LOOKS and not self._pending:
            self._holes, self._looked = hole_targets(view)[:_HOLES], self._looked + 1
        return self._holes.pop(0) if self._holes else None

    def _plan_as_frontier(self, atlas: Atlas) -> ProbePlan | None:
        """The plan of a FrontierPlanner. Where the probe reports edges, patches end there, so that
        their cores must fill the faces."""
        plan = None if self._pending else self._beside_edges.ask(atlas)
        if plan is not None:
            return plan
        known = self._known.coverage >= self.options.coverage
        return self._end(atlas, StopReason.KNOWN if known else StopReason.TRIED)

    def _end(self, atlas: Atlas, reason: StopReason) -> ProbePlan | None:
        """No plan: ``stop`` says why, unless a pending one may teach more."""
        if not self._pending:
            self.stop = Stop(reason, self.forecast(atlas), np.reshape(self._unreachable, (-1, 3)))
        return None

    def forecast(self, atlas: Atlas) -> Forecast:
        """What is known of the surface of an atlas, and where too little is."""
        if not len(atlas):
            return Forecast(0.0, np.zeros((0, 3)))
        extent = self._extent(atlas)
        body = self._lawful_body(atlas)
        if body is not None:
            places = lawful_places(body)
            inside, total, _ = self._law_areas(self._view(atlas, extent), places)
            found = apart_from_each_other(places.left(atlas.tolerance), extent)
            return Forecast(inside / total if total > 0.0 else 0.0, found)
        self._update(atlas)
        inside, total, _ = self._places.areas(atlas, self._view(atlas, extent).is_untried)
        left = self._places.left(atlas, extent)
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
        if self._pending or not self._starts:
            return self._end(atlas, StopReason.NO_PATCH)
        plan = self._beside_edges.start_plan(atlas)
        return first_plan(plan, self._starts.pop(0), atlas.scale, self.options)
