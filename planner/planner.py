"""Planner: ask it where to touch, tell it what came of it."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import check_unit, cross, frozen_array, real
from touchatlas.patch.geometry.contour import ContourEnd
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.candidates import (
    Candidate,
    frontier_candidate,
    gap_candidate,
    is_spent,
    predicted_curvature,
    weak_candidate,
)
from touchatlas.planner.edges import EdgeGuess, edge_guess
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan, Reason

# Arms are shortened to this share after contours that were too short for a patch, and to no less
# than this share of the least reach.
_CLOSER, _CLOSEST = 0.35, 0.1


@dataclass(frozen=True)
class PlannerOptions:
    """How places and planes are chosen.

    Parameters
    ----------
    curves : int
        Sampling planes a touch.
    samples : int
        Samples each way along a curve.
    max_turn : float, rad
        How far a patch may turn from its reference point to its rim.
    reach : float
        Longest arm of a curve, in tolerances of the atlas.
    least_reach : float
        Shortest arm that is planned, in tolerances.
    """

    curves: int = 3
    samples: int = 12
    max_turn: float = np.pi / 4
    reach: float = 200.0
    least_reach: float = 60.0

    def __post_init__(self) -> None:
        for name, least in (("curves", 3), ("samples", 2)):
            value = getattr(self, name)
            if not (isinstance(value, int | np.integer) and value >= least):
                raise ValueError(f"{name} is {value!r}; it must be a whole number >= {least}")
        if not 0.0 < real(self.max_turn) < np.pi / 2:
            raise ValueError(f"max_turn is {self.max_turn!r}; it must be an angle in (0, pi/2) rad")
        if not 0.0 < real(self.least_reach) <= real(self.reach) < np.inf:
            raise ValueError(
                f"least_reach, reach are {self.least_reach!r}, {self.reach!r}; they must be "
                "numbers of tolerances, 0 < least_reach <= reach"
            )


class Planner:
    """Chooses reference points on the frontier and concurrent sampling planes there.

    Parameters
    ----------
    start : (3,) float, length, world
        Where the object may be touched first.
    outward : (3,) float, unit, world
        From the object toward the free space from which ``start`` is approached.
    options : PlannerOptions

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
    """

    def __init__(self, start, outward, options: PlannerOptions = PlannerOptions()) -> None:
        self._start = frozen_array(start, (3,), "start point")
        self._outward = check_unit(outward, "outward direction")
        self.options = options
        self._position = self._start
        self._asked: ProbePlan | None = None
        self._target: np.ndarray | None = None
        self._spent: list[np.ndarray] = []
        self._tried_ends: list[np.ndarray] = []
        self._retry: ProbePlan | None = None
        self._at_edge = False
        self._count = 0

    def ask(self, atlas: Atlas) -> ProbePlan | None:
        """The next plan; None when nothing is left to explore.

        Asked twice without ``tell`` in between it answers the same plan.
        """
        if self._asked is not None:
            return self._asked
        if self._retry is not None:
            self._asked = self._closer(atlas, self._retry)
            self._retry = None
        if self._asked is None and len(atlas) == 0:
            self._asked = self._start_plan(atlas) if self._count == 0 else None
        elif self._asked is None:
            self._asked = self._next_plan(atlas)
        return self._asked

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """What became of the plan last asked for.

        Raises
        ------
        ValueError
            When no plan is open, or the touch answers another plan.
        """
        if self._asked is None:
            raise ValueError("no plan is open: call ask before tell")
        if touch.number != self._asked.number:
            raise ValueError(
                f"the touch answers plan {touch.number}, but plan {self._asked.number} is open"
            )
        if touch.status is TouchStatus.TOUCHED:
            self._position = touch.contact
        if change.refused and touch.status is TouchStatus.TOUCHED:
            self._retry, self._at_edge = self._asked, _ends_at_edge(touch)
        elif change.refused and self._target is not None:
            self._spent.append(self._target)
        self._count += 1
        self._asked = None

    def _next_plan(self, atlas: Atlas) -> ProbePlan | None:
        """Frontier first, then over edges, then gaps."""
        candidate = self._candidate(atlas, frontier_candidate)
        if candidate is None:
            guess = edge_guess(atlas, self._position, self._tried_ends)
            if guess is not None:
                return self._edge_plan(atlas, guess)
            candidate = self._candidate(atlas, gap_candidate)
        if candidate is None:
            candidate = self._candidate(atlas, weak_candidate)
        return None if candidate is None else self._plan(atlas, candidate)

    def _candidate(self, atlas: Atlas, choose) -> Candidate | None:
        candidate = choose(atlas, self._position, self._spent)
        if (
            candidate is not None
            and self._target is not None
            and is_spent(candidate.point[None], [self._target], atlas.tolerance)[0]
        ):
            # The touch there did not cover it: once is enough.
            self._spent.append(self._target)
            candidate = choose(atlas, self._position, self._spent)
        if candidate is not None:
            self._target = candidate.point.copy()
        return candidate

    def _closer(self, atlas: Atlas, plan: ProbePlan) -> ProbePlan | None:
        """The same place with finer steps, after contours that were too short: with shorter arms,
        too, where not edges ended them. None when the steps would be too fine."""
        step, least = _CLOSER * plan.step, _CLOSEST * self.options.least_reach * atlas.tolerance
        # In the corner of a face contours are short however long their arms may be.
        if step * self.options.samples < (_CLOSER * least if self._at_edge else least):
            if self._target is not None:
                self._spent.append(self._target)
            return None
        heading = cross(plan.planes[0].normal, plan.normal)
        reach = plan.reach if self._at_edge else _CLOSER * plan.reach
        return self._finish(
            plan.reference_point, plan.normal, heading, reach, plan.reason, step / reach
        )

    def _start_plan(self, atlas: Atlas) -> ProbePlan:
        reach = self.options.reach * atlas.tolerance
        heading = any_tangent(self._outward)
        return self._finish(self._start, self._outward, heading, reach, Reason.START)

    def _plan(self, atlas: Atlas, candidate: Candidate) -> ProbePlan:
        reach = self._reach(atlas, candidate.point, candidate.home)
        heading = candidate.point - atlas.table.origin[candidate.home]
        return self._finish(candidate.point, candidate.normal, heading, reach, candidate.reason)

    def _edge_plan(self, atlas: Atlas, guess: EdgeGuess) -> ProbePlan:
        self._tried_ends.append(guess.end.copy())
        self._target = None
        reach = self._reach(atlas, guess.end, guess.home)
        point, normal = guess.target(reach)
        return self._finish(point, normal, guess.normal, reach, Reason.EXPAND)

    def _reach(self, atlas: Atlas, point, home: int) -> float:
        """Length of the arms, as far as a patch predicts the curvature at a point."""
        curvature = predicted_curvature(atlas, point, home)
        longest = self.options.reach * atlas.tolerance
        shortest = self.options.least_reach * atlas.tolerance
        return max(shortest, min(longest, self.options.max_turn / max(curvature, 1.0 / longest)))

    def _finish(self, point, normal, heading, reach, reason, share=None) -> ProbePlan:
        share = 1.0 / self.options.samples if share is None else share
        planes = concurrent_planes(point, normal, heading, self.options.curves)
        return ProbePlan(
            self._count,
            point,
            normal,
            planes,
            reach,
            share * reach,
            self.options.max_turn,
            reason,
        )


def _ends_at_edge(touch: Touch) -> bool:
    """Whether any contour of a touch ended at an edge."""
    return any(end is ContourEnd.EDGE for contour in touch.contours for end in contour.ends)
