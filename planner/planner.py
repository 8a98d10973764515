"""Planner: it touches where least is known, until that is known to the tolerance."""

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.patch.geometry.arrays import check_unit, frozen_array
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.behind_edges import edge_target, unknown_ends
from touchatlas.planner.options import TOLERANCE, PlannerOptions
from touchatlas.planner.pending import Pending
from touchatlas.planner.place.choose import Target, View, start_targets
from touchatlas.planner.place.deviation_ratio import DeviationRatio, structure_of
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.place.places import Places, places_of
from touchatlas.planner.place.rules import RULES, left_target
from touchatlas.planner.plans import first_plan, known_plan, plan_at
from touchatlas.planner.probe_plan import ProbePlan, Reason, check_answer
from touchatlas.planner.reach import is_reachable
from touchatlas.planner.search import search_plan
from touchatlas.planner.sharp_bends import sharp_bends, side_target
from touchatlas.planner.stop import Forecast, Stop, StopReason

# Share of the ends of contours that are at edges from which places behind edges are guessed: on
# cubes it is 0.5 where contours stop at edges, and 0.1 where they run over all but the sharpest.
# Doubled, probes that stop at edges miss faces.
_OFTEN = 0.25


class Planner:
    """Chooses the reference points and sampling planes that make the surface known to the
    tolerance with few touches.

    Where the surface ends comes first, far from all touches before elsewhere; then, of a part with
    round holes, places where another one may be hidden; then places about which the variance of the
    surface is large; small holes of the surface come last. None of this depends on the tolerance,
    so a looser one ends the same sequence of touches earlier, but for holes and guessed edges that
    matter to it.

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
        self._start = frozen_array(start, (3,), "start point")
        self._outward = check_unit(outward, "outward direction")
        self.options, self._rng = options, rng
        self.stop: Stop | None = None
        self._attempts = Attempts(self._start)
        self._starts = list(start_targets(self._start, self._outward))
        # Ends of contours behind which was guessed.
        self._tried_ends: list[np.ndarray] = []
        self._ratio = DeviationRatio()
        # Numbers of faces, edges and rounded edges of the body that the last plan went by.
        self._structure = (0, 0, 0, "")
        # What is known, and the plans that were answered when that was last measured.
        self._known, self._measured = KnownArea(), -1
        # Points before sharp bends at which arms ended, and the direction of each arm.
        self._bends: list[np.ndarray] = []
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
        chosen before one of them is told: at the first touch, and at the end.

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
        self._bends += sharp_bends(touch, answered.plan)
        self._attempts.try_again(answered, touch, change, self.options)
        self._ratio.learn(change.innovations)

    def forecast(self, atlas: Atlas) -> Forecast:
        """What is known of the surface of an atlas, and where too little is.

        Small holes that would not be closed within the tolerance count as unknown, unless the
        planner ended as known: then none of them is left in the fine drawing.
        """
        return self._forecast(atlas, self.stop is not None and self.stop.reason is StopReason.KNOWN)

    def _forecast(self, atlas: Atlas, known: bool) -> Forecast:
        """The same; whether the planner ended as known is given."""
        if atlas.body is None:
            return Forecast(0.0, np.zeros((0, 3)))
        places, view = places_of(atlas), self._view(atlas)
        open_ = places.are_large(view.extent)
        if not known:
            open_ |= places.stay_open(atlas.tolerance, view.extent)
        inside, total, _ = self._areas(places, view, open_)
        share = inside / total if total > 0.0 else 0.0
        return Forecast(share, places.left(atlas.tolerance, view.extent))

    def _further(self, atlas: Atlas) -> Pending | None:
        """One more plan, besides those that are pending; None where there is none."""
        again = self._attempts.again(atlas)
        if again is not None:
            return again
        found = self._start_plan(atlas) if atlas.body is None else self._next_plan(atlas)
        if found is None or isinstance(found, Pending):
            return found
        return Pending(found, found.until is not None)

    def _start_plan(self, atlas: Atlas) -> ProbePlan | None:
        """The next attempt at a first touch, with short arms: nothing is known of the size."""
        if self._attempts.pending or not self._starts:
            return self._end(atlas, StopReason.NO_PATCH)
        offset = self._starts.pop(0)
        return first_plan(self._start, self._outward, offset, atlas.scale, self.options)

    def _next_plan(self, atlas: Atlas) -> ProbePlan | Pending | None:
        """A plan behind an edge, else where nothing is known, else where too little is known."""
        self._forget_errors_of_another_body(atlas)
        places, view = places_of(atlas), self._view(atlas)
        answered = self._attempts.answered - self._attempts.verified
        areas = self._areas(places, view, places.are_large(view.extent))
        self._known.measure(*areas, self._measured == answered)
        self._measured = answered
        guess = self._guess_behind_edge(atlas, view)
        if guess is not None:
            return guess
        while True:
            target, known = self._target(places, view)
            if target is None:
                plan = self._search_plan(atlas, places, view)
                return self._end(atlas, self._reason(known)) if plan is None else plan
            if self._reaches(atlas, target):
                return self._plan_at(atlas, target, view)
            self._attempts.leave(target)
            view = self._view(atlas)

    def _target(self, places: Places, view: View) -> tuple[Target | None, bool]:
        """Where to touch next, if anywhere, and whether the surface is known. The surface is drawn
        finely, to find small holes, when it is known and no plan pends."""
        enough = self._known.coverage >= self.options.coverage
        if enough and len(view.pending):
            return None, True
        left = left_target(view, places) if enough else None
        if self._known.stagnates():
            return None, enough and left is None
        if enough:
            return left, True
        return RULES[self.options.name](view, places, self._rng), False

    def _areas(self, places: Places, view: View, open_) -> tuple[float, float, float]:
        """See ``Places.areas``: of the rims ``open_`` (k,) bool, those count that no touch or
        attempt was near."""
        counted = open_ & view.is_untried(places.rim)
        return places.areas(view.atlas.tolerance, self._ratio, counted)

    def _plan_at(self, atlas: Atlas, target: Target, view: View) -> ProbePlan | Pending:
        """The plan of a target: from outside, where arms ended before a sharp bend near it; from a
        known sample, where approaches beyond samples of a free-form body often miss."""
        beyond = target.reason is Reason.EXPAND and self.options.name == TOLERANCE
        side = side_target(target, self._bends, view) if beyond else None
        if side is not None and self._reaches(atlas, side):
            return plan_at(atlas, side, view.extent, self.options)
        plan = plan_at(atlas, target, view.extent, self.options)
        if beyond and atlas.known_body.is_one and self._attempts.often_miss:
            known = known_plan(plan, atlas)
            if known is not None:
                return Pending(known, known.until is not None, sought=target.point)
        return plan

    def _forget_errors_of_another_body(self, atlas: Atlas) -> None:
        """Forget what was learned of errors when the number of faces, edges or rounded edges, or
        the law of a single face changes: they were those of another surface."""
        body = atlas.body
        found = (0, 0, 0, "") if body is None else structure_of(body.faces)
        if found != self._structure:
            if (found[0] == 1) != (self._structure[0] == 1):
                self._known = KnownArea()
            self._structure, self._ratio = found, DeviationRatio()

    def _view(self, atlas: Atlas) -> View:
        """What the choice of a place depends on."""
        return self._attempts.view(atlas, self._ratio.value)

    def _reaches(self, atlas: Atlas, target: Target) -> bool:
        """Whether the pin of the options reaches a target."""
        pin = self.options.pin_radius, self.options.pin_length
        return is_reachable(atlas, target.point, target.normal, *pin)

    def _guess_behind_edge(self, atlas: Atlas, view: View) -> Pending | None:
        """A plan behind an edge, where contours often end at edges and what lies behind some is
        unknown; None elsewhere, when all guesses were made, or a guess is pending. Where most
        contours run over edges, places behind the others are found as others are."""
        ends = 2 * self.options.curves * atlas.touches
        if atlas.pool.edges.sum() <= _OFTEN * ends or self._attempts.guesses:
            return None
        reach = self.options.reach * view.extent
        found = unknown_ends(atlas)
        target = edge_target(found, view.touched[-1], self._tried_ends, atlas.scale, reach)
        if target is None:
            return None
        return Pending(plan_at(atlas, target, view.extent, self.options), True, is_guess=True)

    def _search_plan(self, atlas: Atlas, places: Places, view: View) -> ProbePlan | None:
        """The next approach in search of other parts; None where no more are asked for."""
        if len(self._rays) >= self.options.search:
            return None
        plan = search_plan(atlas, places, self._rays, view.extent, self.options)
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
            forecast = self._forecast(atlas, reason is StopReason.KNOWN)
            self.stop = Stop(reason, forecast, unreachable)
        return None
