"""FrontierPlanner: it touches until no sample, edge, outline or gap is open. A baseline."""

from collections import Counter
from dataclasses import dataclass
from functools import partial

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.arrays import check_unit, cross, frozen_array, real
from touchatlas.patch.geometry.contour import ContourEnd
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.frontier.candidates import (
    Candidate,
    frontier_candidate,
    gap_candidate,
    is_spent,
    predicted_curvature,
    weak_candidate,
)
from touchatlas.planner.frontier.edges import EdgeGuess, edge_guess
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan, Reason, check_answer

# _CLOSER: factor by which arms and steps shrink after contours that were too short for a patch.
# Doubled, more touches fail in narrow places. _CLOSEST: the shortest arm that is tried then, as a
# fraction of ``least_reach``. Doubled, narrow places are given up.
_CLOSER, _CLOSEST = 0.35, 0.1
# Touches for the gaps and weak places of one patch that brought no patch, after which these are
# left as they are: no touch can cover them, or its polynomial is off there. Doubled, such patches
# cost twice the touches.
_MOST_IN_VAIN = 4


_LAST = Reason.CLOSE_GAP, Reason.REFINE


@dataclass(frozen=True)
class FrontierOptions:
    """Options for reference points and sampling planes.

    Parameters
    ----------
    curves : int
        Sampling planes per touch.
    samples : int
        Samples each way along a curve.
    max_turn : float, rad
        Largest angle by which a curve may turn from the contact to its end.
    reach : float
        Longest arm of a curve, in scales of the atlas.
    least_reach : float
        Shortest arm that is planned, in scales.
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
                "numbers of scales, 0 < least_reach <= reach"
            )


class FrontierPlanner:
    """Chooses reference points on the frontier and concurrent sampling planes there.

    Parameters
    ----------
    start : (3,) float, length, world
        Reference point of the first touch.
    outward : (3,) float, unit, world
        Direction from the object to the free space from which ``start`` is approached.
    options : FrontierOptions

    Examples
    --------
    The whole loop, with ``robot`` a function from ProbePlan to Touch::

        while (plan := planner.ask(atlas)) is not None:
            touch = robot(plan)
            planner.tell(touch, atlas.add(touch))
    """

    def __init__(self, start, outward, options: FrontierOptions = FrontierOptions()) -> None:
        if not isinstance(options, FrontierOptions):
            raise ValueError(f"options are {options!r}; they must be FrontierOptions")
        self._start = frozen_array(start, (3,), "start point")
        self._outward = check_unit(outward, "outward direction")
        self.options = options
        self._position = self._start
        self._asked: ProbePlan | None = None
        self._target: np.ndarray | None = None
        self._home: int | None = None
        self._vain: Counter[int] = Counter()
        self._spent: list[np.ndarray] = []
        self._tried_ends: list[np.ndarray] = []
        self._retry: ProbePlan | None = None
        self._at_edge = False
        self._count = 0

    def ask(self, atlas: Atlas) -> ProbePlan | None:
        """The next plan; None when nothing is left to explore.

        Without ``tell`` in between, a second call returns the same plan.

        Raises
        ------
        ValueError
            When the argument is no Atlas.
        """
        if not isinstance(atlas, Atlas):
            raise ValueError(f"got {type(atlas).__name__}; ask needs the Atlas that learns")
        if self._asked is not None:
            return self._asked
        if self._retry is not None:
            self._asked = self._closer(atlas, self._retry)
            self._retry = None
        if self._asked is None and len(atlas) == 0:
            self._asked = self.start_plan(atlas) if self._count == 0 else None
        elif self._asked is None:
            self._asked = self._next_plan(atlas)
        return self._asked

    def ask_behind_edge(self, atlas: Atlas) -> ProbePlan | None:
        """A plan at a guess behind an edge; None when all were made."""
        guess = edge_guess(atlas, self._position, self._tried_ends)
        self._asked = None if guess is None else self._edge_plan(atlas, guess)
        return self._asked

    @property
    def is_open(self) -> bool:
        """Whether a plan is open, that ``tell`` has not answered yet."""
        return self._asked is not None

    def has_asked(self, plan: ProbePlan) -> bool:
        """Whether a plan is at the place of the one that is open."""
        asked = self._asked
        return asked is not None and np.array_equal(plan.reference_point, asked.reference_point)

    @property
    def count(self) -> int:
        """Number of plans that were answered."""
        return self._count

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of the plan last asked for.

        Raises
        ------
        ValueError
            See ``check_answer``.
        """
        asked = check_answer([self._asked] if self._asked else [], touch, change)
        if touch.status is TouchStatus.TOUCHED:
            self._position = touch.contact
        if self._home is not None and not change.added and asked.reason in _LAST:
            self._vain[self._home] += 1
        if change.refused and touch.status is TouchStatus.TOUCHED:
            self._retry, self._at_edge = asked, _ends_at_edge(touch)
        elif change.refused and self._target is not None:
            self._spent.append(self._target)
        self._count += 1
        self._asked = None

    def _next_plan(self, atlas: Atlas) -> ProbePlan | None:
        """A plan on the frontier, else behind an edge, else in a gap, else where the predicted
        deviation is too large."""
        given_up = self._given_up()
        candidate = self._candidate(atlas, frontier_candidate)
        if candidate is None:
            plan = self.ask_behind_edge(atlas)
            if plan is not None:
                return plan
            candidate = self._candidate(atlas, partial(gap_candidate, given_up=given_up))
        if candidate is None:
            candidate = self._candidate(atlas, partial(weak_candidate, given_up=given_up))
        return None if candidate is None else self._plan(atlas, candidate)

    def _candidate(self, atlas: Atlas, choose) -> Candidate | None:
        """The candidate that ``choose`` finds, unless the last touch was there already."""
        candidate = choose(atlas, self._position, self._spent)
        if (
            candidate is not None
            and self._target is not None
            and is_spent(self._target[None], [candidate.point], candidate.extent)[0]
        ):
            # The last touch did not cover it, so another one would not either.
            self._spent.append(candidate.point)
            candidate = choose(atlas, self._position, self._spent)
        if candidate is not None:
            self._target = candidate.point.copy()
            self._home = candidate.home
        return candidate

    def _given_up(self) -> list[int]:
        """Patches whose gaps and weak places are left as they are."""
        return [home for home, count in self._vain.items() if count >= _MOST_IN_VAIN]

    def _closer(self, atlas: Atlas, plan: ProbePlan) -> ProbePlan | None:
        """A plan at the same place with finer steps, after contours that were too short; None when
        the steps would be too fine. The arms are shorter too, unless edges ended the contours."""
        step, least = _CLOSER * plan.step, _CLOSEST * self.options.least_reach * atlas.scale
        # In the corner of a face edges end the contours, so finer steps are allowed there.
        if step * self.options.samples < (_CLOSER * least if self._at_edge else least):
            if self._target is not None:
                self._spent.append(self._target)
            return None
        heading = cross(plan.planes[0].normal, plan.normal)
        reach = plan.reach if self._at_edge else _CLOSER * plan.reach
        return self._probe_plan(
            plan.reference_point, plan.normal, heading, reach, plan.reason, step / reach
        )

    def start_plan(self, atlas: Atlas) -> ProbePlan:
        """The plan of the first touch."""
        reach = self.options.reach * atlas.scale
        heading = any_tangent(self._outward)
        return self._probe_plan(self._start, self._outward, heading, reach, Reason.START)

    def _plan(self, atlas: Atlas, candidate: Candidate) -> ProbePlan:
        """The plan of a touch at a candidate, with its first plane away from the patch there."""
        reach = self._reach(atlas, candidate.point, candidate.home)
        heading = candidate.point - atlas.table.origin[candidate.home]
        return self._probe_plan(candidate.point, candidate.normal, heading, reach, candidate.reason)

    def _edge_plan(self, atlas: Atlas, guess: EdgeGuess) -> ProbePlan:
        """The plan of a touch behind an edge."""
        self._tried_ends.append(guess.end.copy())
        self._target = self._home = None
        reach = self._reach(atlas, guess.end, guess.home)
        point, normal = guess.target(reach)
        return self._probe_plan(point, normal, guess.normal, reach, Reason.EXPAND)

    def _reach(self, atlas: Atlas, point, home: int) -> float:
        """Length of arms that turn by ``max_turn``, within the limits of the options, by the
        curvature that patch ``home`` predicts at a point."""
        curvature = predicted_curvature(atlas, point, home)
        longest = self.options.reach * atlas.scale
        shortest = self.options.least_reach * atlas.scale
        return max(shortest, min(longest, self.options.max_turn / max(curvature, 1.0 / longest)))

    def _probe_plan(self, point, normal, heading, reach, reason, fraction=None) -> ProbePlan:
        """The next ProbePlan; ``fraction`` is the step over the reach."""
        fraction = 1.0 / self.options.samples if fraction is None else fraction
        planes = concurrent_planes(point, normal, heading, self.options.curves)
        turn = self.options.max_turn
        return ProbePlan(self._count, point, normal, planes, reach, fraction * reach, turn, reason)


def _ends_at_edge(touch: Touch) -> bool:
    """Whether any contour of a touch ended at an edge."""
    return any(end is ContourEnd.EDGE for contour in touch.contours for end in contour.ends)
