"""Planner: it touches where least is known, until that is known to the tolerance."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import check_unit, frozen_array
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.free_form import FreeForm
from touchatlas.planner.frontier.frontier_planner import FrontierPlanner
from touchatlas.planner.lawful import NO_BODY, Lawful, structure_of
from touchatlas.planner.options import FRONTIER, TOLERANCE, PlannerOptions
from touchatlas.planner.pending import Pending
from touchatlas.planner.place.choose import Target, View, start_targets
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.plans import arms_beside_edges, first_plan, known_plan, plan_at
from touchatlas.planner.probe_plan import ProbePlan, Reason, check_answer
from touchatlas.planner.reach import is_reachable
from touchatlas.planner.search import search_plan
from touchatlas.planner.stop import Forecast, Stop, StopReason

# Share of the ends of contours that are at edges from which places behind edges are guessed: on
# cubes it is 0.5 where contours stop at edges, and 0.1 where they run over all but the sharpest.
# Doubled, probes that stop at edges miss faces.
_OFTEN = 0.25


class Planner:
    """Chooses the reference points and sampling planes that make the surface known to the
    tolerance with few touches.

    Places where nothing is known come first, those far from all touches before others; then
    places of large predicted deviation. Slips of the probe, rims and holes come as soon as they are
    less sure than the rest. None of this depends on the tolerance, so a looser one ends the same
    sequence of touches earlier. What does is the end of one that stagnates, and exploring a body of
    lawful faces.

    Where a probe often ends its contours at edges, what lies behind is guessed and touched first.

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
        start = frozen_array(start, (3,), "start point")
        outward = check_unit(outward, "outward direction")
        self.options, self._rng = options, rng
        self.stop: Stop | None = None
        self._attempts = Attempts(start)
        self._starts = list(start_targets(start, outward))
        self._beside_edges = FrontierPlanner(start, outward)
        self._free_form = FreeForm()
        # Numbers of faces, edges and rounded edges of the lawful body that the last plan went by;
        # zeros without one.
        self._law = NO_BODY
        # What is known, and the plans that were answered when that was last measured.
        self._known, self._measured = KnownArea(), -1
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
        chosen before one of them is told: at the first touch, with the rule "frontier", and at
        the end.

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
        attempts = self._attempts
        attempts.bind(atlas)
        while len(attempts.pending) < count:
            self.stop = None
            found = self._further(atlas)
            if found is None:
                break
            attempts.ask(found, atlas, self._known.coverage)
        return attempts.plans

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of a pending plan, that of the touch's number.

        Raises
        ------
        ValueError
            See ``check_answer``.
        """
        check_answer(self._attempts.plans, touch, change)
        answered = self._attempts.answer(touch, change)
        again = True
        if self._beside_edges.has_asked(answered.plan):
            number = self._beside_edges.count
            self._beside_edges.tell(replace(touch, number=number), replace(change, touch=number))
            # A guess behind an edge that met nothing is followed by another guess.
            again = self.options.name != FRONTIER and touch.status is TouchStatus.TOUCHED
        if again:
            self._attempts.try_again(answered, touch, change, self.options.curves)
        self._free_form.learn(change)

    def forecast(self, atlas: Atlas) -> Forecast:
        """What is known of the surface of an atlas, and where too little is."""
        if not len(atlas):
            return Forecast(0.0, np.zeros((0, 3)))
        choice, view = self._choice(atlas), self._view(atlas)
        inside, total, _ = choice.areas(view)
        return Forecast(inside / total if total > 0.0 else 0.0, choice.left(view))

    def _further(self, atlas: Atlas) -> Pending | None:
        """One more plan, besides those that are pending; None where there is none."""
        again = self._attempts.again(atlas)
        if again is not None:
            return again
        found = self._next_plan(atlas) if len(atlas) else self._start_plan(atlas)
        if found is None or isinstance(found, Pending):
            return found
        return Pending(found, found.until is not None)

    def _start_plan(self, atlas: Atlas) -> ProbePlan | None:
        """The next attempt at a first touch, with short arms: nothing is known of the size."""
        if self._attempts.pending or not self._starts:
            return self._end(atlas, StopReason.NO_PATCH)
        plan = self._beside_edges.start_plan(atlas)
        return first_plan(plan, self._starts.pop(0), atlas.scale, self.options)

    def _next_plan(self, atlas: Atlas) -> ProbePlan | Pending | None:
        """A plan where nothing is known, else where too little is known."""
        choice = self._choice(atlas)
        view = self._view(atlas)
        answered = self._attempts.answered
        self._known.measure(*choice.areas(view), self._measured == answered)
        self._measured = answered
        if self.options.name == FRONTIER:
            return self._plan_as_frontier(atlas)
        # What comes after a touch behind an edge depends on it.
        if self._beside_edges.is_open:
            return None
        if self._ends_at_edges(atlas):
            plan = self._plan_behind_edge(atlas, view.extent)
            if plan is not None:
                return plan
        while True:
            target, known = choice.target(view, self._known, self.options, self._rng)
            if target is None:
                plan = self._search_plan(atlas, view)
                return self._end(atlas, self._reason(known)) if plan is None else plan
            if self._reaches(atlas, target):
                return self._plan_at(atlas, target, view.extent)
            self._attempts.leave(target)
            view = self._view(atlas)

    def _plan_at(self, atlas: Atlas, target: Target, extent: float) -> ProbePlan | Pending:
        """The plan of a target: from a known sample, where approaches beyond patches often miss."""
        plan = plan_at(atlas, target, extent, self.options)
        beyond = target.reason is Reason.EXPAND and self.options.name == TOLERANCE
        if beyond and self._law == NO_BODY and self._attempts.often_miss:
            known = known_plan(plan, atlas)
            if known is not None:
                return Pending(known, known.until is not None, sought=target.point)
        return plan

    def _choice(self, atlas: Atlas) -> FreeForm | Lawful:
        """How places are chosen: by the lawful faces of the atlas, if its body is made of them.

        What was learned of errors is forgotten when the number of faces, edges or rounded edges
        changes: they were those of another surface.
        """
        body = atlas.body if self.options.name == TOLERANCE else None
        law = NO_BODY if body is None else structure_of(body.faces)
        if (law == NO_BODY) != (self._law == NO_BODY):
            self._known = KnownArea()
        if law != self._law:
            self._law = law
            self._free_form.forget_errors()
        if body is not None:
            return Lawful(body)
        self._free_form.update(atlas)
        return self._free_form

    def _view(self, atlas: Atlas) -> View:
        """What the choice of a place depends on."""
        return self._attempts.view(atlas, self._free_form.places)

    def _reaches(self, atlas: Atlas, target: Target) -> bool:
        """Whether the pin of the options reaches a target."""
        pin = self.options.pin_radius, self.options.pin_length
        return is_reachable(atlas, target.point, target.normal, *pin)

    def _ends_at_edges(self, atlas: Atlas) -> bool:
        """Whether contours often end at edges, and what lies behind some is unknown. Where most run
        over edges, places behind the others are found as others are."""
        ends = 2 * self.options.curves * atlas.touches
        return len(atlas.edge_ends) > 0 and atlas.membership.pool.edges.sum() > _OFTEN * ends

    def _plan_behind_edge(self, atlas: Atlas, extent: float) -> ProbePlan | None:
        """A plan behind an edge at which contours ended; None when all guesses were made."""
        self._beside_edges.options = arms_beside_edges(self.options, extent / atlas.scale)
        return self._beside_edges.ask_behind_edge(atlas)

    def _plan_as_frontier(self, atlas: Atlas) -> ProbePlan | None:
        """The plan of a FrontierPlanner."""
        plan = None if self._attempts.pending else self._beside_edges.ask(atlas)
        if plan is not None:
            return plan
        known = self._known.coverage >= self.options.coverage
        return self._end(atlas, StopReason.KNOWN if known else StopReason.TRIED)

    def _search_plan(self, atlas: Atlas, view: View) -> ProbePlan | None:
        """The next approach in search of other parts; None where no more are asked for."""
        if len(self._rays) >= self.options.search:
            return None
        self._free_form.update(atlas)
        plan = search_plan(atlas, view.places, self._rays, view.extent, self.options)
        if plan is not None:
            self._rays.append(np.stack([plan.reference_point, plan.normal]))
        return plan

    def _reason(self, known: bool) -> StopReason:
        """Why there is no further place."""
        if known:
            return StopReason.KNOWN
        if self._known.stagnates():
            return StopReason.STAGNATION
        return StopReason.UNREACHABLE if self._attempts.unreachable else StopReason.TRIED

    def _end(self, atlas: Atlas, reason: StopReason) -> ProbePlan | None:
        """No plan: ``stop`` says why, unless a pending one may teach more."""
        if not self._attempts.pending:
            unreachable = np.reshape(self._attempts.unreachable, (-1, 3))
            self.stop = Stop(reason, self.forecast(atlas), unreachable)
        return None
