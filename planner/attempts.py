"""Attempts: where a planner touched, what it tried, and the plans that are not answered yet."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.pending import Pending
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.plans import (
    across_plan,
    beside_plan,
    closer_plan,
    coming_clear,
    known_plan,
)
from touchatlas.planner.probe_plan import ProbePlan, Reason

# How often contours that were too short for a patch are tried closer. Before any patch nothing is
# known of the size, so it is tried more often. Doubled, more touches fail in narrow places.
_TIMES_CLOSER, _TIMES_CLOSER_FIRST = 2, 5
# Share of approaches to places beyond what is known that met nothing, no unit, from which places
# are sought from known samples. Doubled, more approaches meet nothing.
_MISSES = 0.25
# Successful approaches that are thought to have come first. Doubled, one more miss is made first.
_FIRST = 4


class Attempts:
    """Where a planner touched, what it tried, and the plans that are not answered yet.

    Parameters
    ----------
    start : (3,) float, length, world
        Reference point of the first touch.

    Attributes
    ----------
    pending : dict of int to Pending
        Plans that are not answered yet, by their numbers.
    asked, answered, verified : int
        Number of plans that were asked for, of those that were answered, and of these that verified
        what was known: they add nothing where it was right.
    touched, tried, unreachable : list of (3,) float, length, world
        Contacts of touches; reference points of plans that were answered or given up; places that
        the pin does not reach.
    """

    def __init__(self, start: np.ndarray) -> None:
        self.pending: dict[int, Pending] = {}
        self.asked, self.answered, self.verified = 0, 0, 0
        self.touched: list[np.ndarray] = []
        self.tried: list[np.ndarray] = []
        self.unreachable: list[np.ndarray] = []
        self._start = start
        self._in_vain: list[np.ndarray] = []
        # How many places beyond what is known were approached, and how many of these in vain.
        self._approached, self._vain_beyond = 0, 0
        self._retries: list[Pending] = []
        self._missed: list[Pending] = []

    @property
    def plans(self) -> tuple[ProbePlan, ...]:
        """The plans that are not answered yet."""
        return tuple(one.plan for one in self.pending.values())

    def bind(self, atlas: Atlas) -> None:
        """Let pending plans ask an atlas where arms end."""
        self.pending = {number: one.bound(atlas) for number, one in self.pending.items()}

    def ask(self, found: Pending, atlas: Atlas, known: float) -> None:
        """Give a plan the next number, and keep it until it is answered; ``known`` is the fraction
        of the surface that is expected within the tolerance."""
        plan = replace(found.plan, number=self.asked, known=known)
        self.pending[self.asked] = replace(found, plan=plan).bound(atlas)
        self.asked += 1

    def answer(self, touch: Touch, change: AtlasChange) -> Pending:
        """Take the touch of a pending plan, and what the atlas made of it; that plan."""
        pending = self.pending.pop(touch.number)
        self.tried.append(pending.place)
        self.answered += 1
        self.verified += pending.plan.reason is Reason.VERIFY
        met = touch.status is TouchStatus.TOUCHED
        if met and not change.refused:
            self.touched.append(touch.contact)
        elif not met:
            self._in_vain.append(pending.place)
        self._approached += pending.is_beyond
        self._vain_beyond += pending.is_beyond and not met
        return pending

    @property
    def guesses(self) -> bool:
        """Whether a guess behind an edge is not answered yet: the next one depends on it."""
        return any(one.is_guess for one in self.pending.values())

    @property
    def often_miss(self) -> bool:
        """Whether approaches to places beyond what is known often meet nothing, as beside edges."""
        return self._vain_beyond > _MISSES * (self._approached + _FIRST)

    def try_again(
        self, pending: Pending, touch: Touch, change: AtlasChange, options: PlannerOptions
    ) -> None:
        """Keep another attempt at a place: beside an edge, across a side of it, or closer, where
        its contours were too short for a patch, and from a known sample, where it met nothing."""
        met, most = touch.status is TouchStatus.TOUCHED, _TIMES_CLOSER_FIRST
        if self.touched:
            most = _TIMES_CLOSER
        if met and change.refused and pending.closer < most:
            aside = across_plan if pending.closer else beside_plan
            beside = aside(pending.plan, touch, options.curves)
            # The second time arms may turn farther: the contact may be on a sharp edge.
            turn = options.max_turn if pending.closer else pending.plan.max_turn
            closer = closer_plan(pending.plan, options.curves, turn)
            plan = closer if beside is None else beside
            self._retries.append(replace(pending, plan=plan, closer=pending.closer + 1))
        elif not met and pending.may_miss:
            self._missed.append(pending)

    def again(self, atlas: Atlas) -> Pending | None:
        """The next attempt at a place that was kept for one; None where there is none."""
        if self._retries:
            found = self._retries.pop(0)
            return replace(found, plan=coming_clear(found.plan, atlas))
        while self._missed:
            missed = self._missed.pop(0)
            plan = known_plan(missed.plan, atlas)
            if plan is not None:
                return replace(missed, plan=plan, sought=missed.place)
        return None

    def leave(self, target: Target) -> None:
        """Give up a place that the pin does not reach."""
        self.unreachable.append(target.point)
        self.tried.append(target.point)

    def view(self, atlas: Atlas, ratio: float) -> View:
        """What the choice of a place depends on. Pending plans count as touched where they are."""
        pending = [one.place for one in self.pending.values()]
        touched = np.array([*pending, *(self.touched or [self._start])])
        done = np.array([*self.touched, *self.tried]).reshape(-1, 3)
        in_vain = np.reshape(self._in_vain, (-1, 3))
        open_plans = np.reshape(pending, (-1, 3))
        return View(atlas, ratio, touched, done, in_vain, open_plans, atlas.pool.extent)
