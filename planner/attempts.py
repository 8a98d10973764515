"""Attempts: where a planner touched, what it tried, and what is to be tried again."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from touchatlas.atlas.atlas import AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.planner.probe_plan import ProbePlan, Reason


@dataclass(frozen=True, eq=False)
class Target:
    """Where to touch next, and how.

    Parameters
    ----------
    point : (3,) float, length, world
    normal : (3,) float, unit, world
        Predicted outward normal.
    reason : Reason
    heading : (3,) float, world, optional
        Direction in the first sampling plane; without, it crosses the nearest contour.
    approach : float, length
        Distance from which the probe comes, if that is less than usual; 0 is the usual one. In
        search of other parts it is more.
    closer : int
        How often arms and steps are shortened; where it is negative, lengthened.
    times : int
        How often the place was tried with other arms.
    sought : (3,) float, length, world, optional
        A place beyond what is known that was missed, and is sought from a known sample.
    end : (3,) float, length, world, optional
        The end of a contour at an edge behind which the point is guessed.
    """

    point: np.ndarray
    normal: np.ndarray
    reason: Reason
    heading: np.ndarray | None = None
    approach: float = 0.0
    closer: int = 0
    times: int = 0
    sought: np.ndarray | None = None
    end: np.ndarray | None = None

    @property
    def place(self) -> np.ndarray:
        """(3,) the place that it was chosen for, length, world."""
        return self.point if self.sought is None else self.sought

    @property
    def may_miss(self) -> bool:
        """Whether a contour from a known sample will show why, if the probe meets nothing: where
        the surface ends, or the rim of a hole."""
        expands = self.reason is Reason.EXPAND and self.end is None
        return self.sought is None and (expands or self.reason is Reason.VERIFY)


@dataclass(frozen=True, eq=False)
class Pending:
    """A plan that is not answered yet, and its target."""

    plan: ProbePlan
    target: Target


@dataclass(eq=False)
class Attempts:
    """Where a planner touched, what it tried, and what is to be tried again.

    Parameters
    ----------
    start : (3,) float, length, world
        Reference point of the first touch.
    outward : (3,) float, unit, world
        Direction from which it is approached.

    Attributes
    ----------
    pending : dict of int to Pending
        Plans that are not answered yet, by their numbers.
    asked, starts : int
        Number of plans that were asked for, and of the places of a first touch among them.
    learned : int
        Number of answers that may have made more of the surface known.
    touched, tried, in_vain, unreachable : list of (3,) float, length, world
        Contacts of touches; places of plans that were answered, or given up; of these the ones
        that met nothing; places that the pin does not reach.
    closer, missed : list of Target
        What is to be touched again with other arms, and from a known sample.
    ends : list of (3,) float, length, world
        Ends of contours at edges, once for each guess behind them.
    bends : list of (2, 3) float
        Points before sharp bends at which arms ended, length, and the directions of the arms.
    rays : list of (2, 3) float
        Point, length, and direction, unit, of each approach in search of other parts.
    datums : int
        How often the first place was chosen again.
    """

    start: np.ndarray
    outward: np.ndarray
    pending: dict[int, Pending] = field(default_factory=dict)
    asked: int = 0
    starts: int = 0
    learned: int = 0
    touched: list[np.ndarray] = field(default_factory=list)
    tried: list[np.ndarray] = field(default_factory=list)
    in_vain: list[np.ndarray] = field(default_factory=list)
    unreachable: list[np.ndarray] = field(default_factory=list)
    closer: list[Target] = field(default_factory=list)
    missed: list[Target] = field(default_factory=list)
    ends: list[np.ndarray] = field(default_factory=list)
    bends: list[np.ndarray] = field(default_factory=list)
    rays: list[np.ndarray] = field(default_factory=list)
    datums: int = 0

    @property
    def plans(self) -> tuple[ProbePlan, ...]:
        """The plans that are not answered yet."""
        return tuple(one.plan for one in self.pending.values())

    @property
    def guesses(self) -> bool:
        """Whether a guess behind an edge is not answered yet: the next one depends on it."""
        return any(one.target.end is not None for one in self.pending.values())

    def bind(self, ending: Callable[[ProbePlan], ProbePlan]) -> None:
        """Let ``ending`` say where arms of pending plans end, and safe ways: plans from a file lack
        both."""
        for number, one in self.pending.items():
            if one.plan.way is None:
                self.pending[number] = replace(one, plan=ending(one.plan))

    def ask(self, target: Target, plan: ProbePlan, known: float) -> None:
        """Keep the plan of a target until it is answered. It has the next number, and ``known`` is
        the fraction of the surface that is expected within the tolerance."""
        self._choose(target)
        plan = replace(plan, number=self.asked, known=known)
        self.pending[self.asked] = Pending(plan, target)
        self.asked += 1

    def leave(self, target: Target) -> None:
        """Give up a target that the pin does not reach."""
        self._choose(target)
        self.unreachable.append(target.point)
        self.tried.append(target.point)

    def _choose(self, target: Target) -> None:
        """Take a target out of what is to be tried again, and note what is chosen but once."""
        self.closer = [one for one in self.closer if one is not target]
        if target.sought is not None:
            self.missed = [one for one in self.missed if one.point is not target.sought]
        if target.end is not None:
            self.ends.append(target.end)
        if target.reason is Reason.SEARCH:
            self.rays.append(np.stack([target.point, target.normal]))
        self.starts += target.reason is Reason.START and not target.times
        self.datums += target.reason is Reason.DATUM

    def answer(self, touch: Touch, change: AtlasChange) -> None:
        """Take the touch of a pending plan, and what the atlas made of it. Where its contours were
        too short for a patch, it is to be tried closer; where noise hid their shape, with longer
        arms; where it met nothing, from a known sample."""
        target = self.pending.pop(touch.number).target
        self.tried.append(target.place)
        met = touch.status is TouchStatus.TOUCHED
        # Before any touch gave a patch, nothing is known of the size: other arms are tried longer.
        again = met and bool(change.refused) and target.times < (2 if self.touched else 5)
        if again:
            closer = target.closer + (-1 if change.hidden else 1)
            self.closer.append(replace(target, closer=closer, times=target.times + 1))
        elif not met and target.may_miss:
            self.missed.append(target)
        if met and not change.refused:
            self.touched.append(touch.contact)
        elif not met:
            self.in_vain.append(target.place)
        # A touch that verifies adds nothing where the surface is right.
        self.learned += not again and target.reason not in (Reason.VERIFY, Reason.DATUM)
