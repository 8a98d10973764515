"""Planner: it touches where least is known, until that is known to the tolerance."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.check.faults import faults, moved_object
from touchatlas.atlas.check.free_disc import FreeDisc
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.samples.predictive_law import PredictiveLaw
from touchatlas.patch.geometry.arrays import check_unit, frozen_array
from touchatlas.patch.words import count_of
from touchatlas.planner.attempts import Attempts, Target
from touchatlas.planner.behind_edges import sharp_bends
from touchatlas.planner.clearance import pin_is_clear
from touchatlas.planner.features import free_disc
from touchatlas.planner.known import Areas, KnownArea
from touchatlas.planner.options import TOLERANCE, PlannerOptions
from touchatlas.planner.places import Places, places_of
from touchatlas.planner.plans import ending_where_known, plan_at
from touchatlas.planner.probe_plan import ProbePlan, check_answer
from touchatlas.planner.sources import next_target
from touchatlas.planner.stop import Forecast, Stop, StopReason
from touchatlas.planner.view import Phase, View, margin_about

if TYPE_CHECKING:
    from k3d.plot import Plot


class Planner:
    """Chooses the reference points and sampling planes that make the surface known to the
    tolerance with few touches.

    The next target is that of the first source that has one, in the order of ``SOURCES``: what is
    to be tried again; behind edges, where a probe often ends its contours at edges; where the
    surface ends, far from all touches before elsewhere; of a part with round holes, places where
    another one may be hidden; places about which the variance of the surface is large; small holes
    of the surface. None of this depends on the tolerance, so a looser one ends the same sequence of
    touches earlier, but for holes and guessed edges that matter to it.

    Parameters
    ----------
    start : (3,) float, length, world
        Reference point of the first touch.
    outward : (3,) float, unit, world
        Direction from the object to the free space from which ``start`` is approached.
    options : PlannerOptions
    rng : numpy.random.Generator, optional
        For the baseline "random" only.

    Attributes
    ----------
    stop : Stop or None
        Why there is no further plan, and what is left; None before the end.
    places : Places or None
        The places of the surface, and the surface, by which the last plan was made; None before
        the first. For pictures.

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
        if options.name == "random" and rng is None:
            raise ValueError("the planner random needs rng, a numpy.random.Generator; pass one")
        start = frozen_array(start, (3,), "start point")
        self.options, self._rng = options, rng
        self.stop: Stop | None = None
        self.places: Places | None = None
        self._attempts = Attempts(start, check_unit(outward, "outward direction"))
        # Whether the body that the last plan went by is one face.
        self._is_one = False
        # What is known, and the answers that it was last measured after.
        self._known, self._measured = KnownArea(self.options.levels), -1
        # How far from the region the surface is wanted.
        self._margin = np.inf

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
        attempts.bind(lambda plan: ending_where_known(plan, atlas, self.options))
        while len(attempts.pending) < count:
            self.stop = None
            target = self._further(atlas)
            if target is None:
                break
            attempts.ask(target, plan_at(atlas, target, self.options), self._known.coverage)
        return attempts.plans

    @property
    def pending(self) -> tuple[ProbePlan, ...]:
        """The plans that ``tell`` has not answered."""
        return self._attempts.plans

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of a pending plan, that of the touch's number.

        Raises
        ------
        ValueError
            See ``check_answer``.
        """
        plan = check_answer(self._attempts.plans, touch, change)
        self._attempts.bends += sharp_bends(touch, plan)
        self._attempts.answer(touch, change)

    def forecast(self, atlas: Atlas) -> Forecast:
        """What is known of the surface of an atlas, and where too little is.

        Small holes that would not be closed within the tolerance count as unknown, unless the
        planner ended as known: then none of them is left in the fine drawing.
        """
        return self._forecast(atlas, self.stop is not None and self.stop.reason is StopReason.KNOWN)

    def free_disc(self, atlas: Atlas) -> FreeDisc | None:
        """The largest disc without a sample on the surface of an atlas, where that is wanted: how
        large a hole or a horn may have been missed. None where no surface is known."""
        return free_disc(self._view(atlas), places_of(atlas))

    def plot(self, atlas: Atlas, unit: str = "") -> "Plot":
        """What the planner knows and wants, in three dimensions, for a notebook: the surface by its
        deviation, contacts, open places, and the planes of the plans that are pending.

        Returns
        -------
        k3d.plot.Plot
        """
        from touchatlas.planner.scene import planner_plot

        return planner_plot(self._attempts, places_of(atlas), atlas.tolerance, unit)

    def __repr__(self) -> str:
        """One line: what is known, and what comes next."""
        touched, pending = len(self._attempts.touched), self._attempts.plans
        words = f"{count_of(touched, 'touch')}, {self._known.coverage:.1%} known to the tolerance"
        if self.stop is not None:
            words += f", ended: {self.stop.reason.value}"
        elif pending:
            x, y, z = pending[0].reference_point
            words += f", next: {pending[0].reason.value} at ({x:.4g}, {y:.4g}, {z:.4g})"
        return f"<Planner: {words}>"

    def _forecast(self, atlas: Atlas, known: bool) -> Forecast:
        """The same; whether the planner ended as known is given."""
        if atlas.body is None:
            return Forecast(0.0, np.zeros((0, 3)))
        view = self._view(atlas)
        places = view.limited(places_of(atlas))
        open_ = places.are_large(view.extent)
        if not known:
            open_ |= places.stay_open(atlas.tolerance, view.extent)
        expected, sure = (
            self._known.share(self._areas(places, view, open_, law))
            for law in (atlas.law, atlas.law.wider)
        )
        left = places.left(atlas.tolerance, atlas.law, self.options.levels.about * view.extent)
        return Forecast(expected, left, expected - sure)

    def _further(self, atlas: Atlas) -> Target | None:
        """One more target, besides those of pending plans; None where there is none. Places that
        the pin does not reach are given up."""
        places = self._measure(atlas)
        draws = self.options.name not in (TOLERANCE, "farthest", "variance")
        while True:
            draw = self._rng.random() if draws and self._rng is not None else 0.0
            view = self._view(atlas, draw)
            # Touches of before and after a move do not make one surface.
            moved = moved_object(atlas) is not None
            target = None if moved else self._target(view, places)
            if target is None:
                self._end(view, places)
                return None
            if pin_is_clear(atlas, target.point, target.normal, self.options):
                return target
            self._attempts.leave(target)

    def _target(self, view: View, places: Places) -> Target | None:
        """Where to touch next, see ``next_target``. Another planner has another choice here."""
        return next_target(view, places)

    def _measure(self, atlas: Atlas) -> Places:
        """The places of an atlas, after its area within the tolerance is measured. What was known
        is forgotten when one face becomes many, or many become one."""
        places = places_of(atlas)
        self._margin = margin_about(places, self.options, atlas.pool.extent)
        self.places = places = self._view(atlas).limited(places)
        learned = self._attempts.learned
        if atlas.body is None:
            return places
        is_one = atlas.body.is_one_face
        if is_one != self._is_one:
            self._is_one, self._known = is_one, KnownArea(self.options.levels)
        view = self._view(atlas)
        # The end follows from what is surely known, and not from chance in the law.
        areas = self._areas(places, view, places.are_large(view.extent), atlas.law.wider)
        self._known.measure(areas, self._measured == learned)
        self._measured = learned
        return places

    def _areas(self, places: Places, view: View, open_, law: PredictiveLaw) -> Areas:
        """See ``Places.areas``: of the rims ``open_`` (k,) bool, those count that no touch or
        attempt was near."""
        counted = open_ & view.is_untried(places.rim)
        return places.areas(view.atlas.tolerance, law, counted)

    def _view(self, atlas: Atlas, draw: float = 0.0) -> View:
        """What the choice of a target depends on, with a number from 0 to 1."""
        phase = self._phase(atlas)
        return View(atlas, self.options, self._attempts, phase, draw, self._margin)

    @property
    def _is_known(self) -> bool:
        """Whether enough of the surface is expected within the tolerance."""
        return self._known.coverage >= self.options.coverage

    def _phase(self, atlas: Atlas) -> Phase:
        """How far the exploration is. The surface is drawn finely, to find what is left, when it is
        known and no plan is pending."""
        if atlas.body is None:
            return Phase.FIRST
        if self._is_known:
            return Phase.END if self._attempts.pending else Phase.FINISH
        if self._known.stagnates():
            return Phase.END
        return Phase.GROW if self.options.name == TOLERANCE else Phase.COMPARE

    def _end(self, view: View, places: Places) -> None:
        """No target: ``stop`` says why, unless a pending plan may teach more."""
        if not self._attempts.pending:
            reason, unreachable = self._reason(view, places), self._attempts.unreachable
            forecast = self._forecast(view.atlas, reason is StopReason.KNOWN)
            disc = free_disc(view, places)
            found = faults(view.atlas)
            self.stop = Stop(reason, forecast, np.reshape(unreachable, (-1, 3)), disc, found)

    def _reason(self, view: View, places: Places) -> StopReason:
        """Why there is no further target."""
        if moved_object(view.atlas) is not None:
            return StopReason.MOVED
        if view.phase is Phase.FIRST:
            return StopReason.NO_PATCH
        finish = replace(view, phase=Phase.FINISH)
        if view.phase is Phase.FINISH or (self._is_known and next_target(finish, places) is None):
            return StopReason.KNOWN
        if self._known.stagnates():
            return StopReason.STAGNATION
        return StopReason.UNREACHABLE if self._attempts.unreachable else StopReason.TRIED
