"""ProbePlan: where and how to touch next."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from touchatlas.atlas.records.touch import AtlasChange, Touch
from touchatlas.patch.geometry.arrays import check_unit, frozen_array, real
from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.patch.words import count_of


class Reason(Enum):
    """Why a place was chosen."""

    START = "start"
    EXPAND = "expand"
    REFINE = "refine"
    VERIFY = "verify"
    SEARCH = "search"
    DATUM = "datum"


@dataclass(frozen=True, eq=False)
class ProbePlan:
    """The instructions for one touch.

    Move toward ``reference_point`` against ``normal`` until contact. Then track the surface in
    each plane, both ways from the contact.

    Parameters
    ----------
    number : int
        Number of the plan, from 0 for the first of a planner.
    reference_point : (3,) float, length, world
        Predicted point of contact; of the centre of the tip, where touches hold centres.
    normal : (3,) float, unit, world
        Predicted outward normal.
    planes : tuple of SamplingPlane
        Sampling planes through the reference point.
    reach : float, length
        Arc length to track from the contact each way.
    step : float, length
        Arc length between samples.
    max_turn : float, rad
        Angle between the curve and its direction at the contact at which tracking stops.
    reason : Reason
    until : function from points (n, 3) to (n,) bool, optional
        Whether the surface is known at points. An arm may end where it is, for some samples in a
        row. Without, arms go on.
    step_turn : float, rad
        Angle between the curve and its direction one step before, beyond which there are samples
        between the two.
    approach : float, length
        Distance above the reference point from which the probe comes: it looks as far below, or as
        far as usual if that is more. 0 is the usual one (``usual_approach``). It is less where
        another side of the body faces the place, and more in search of other parts.
    way : function from start (3,), goal (3,) and radius of the tip to points (k, 3), optional
        A way of the tip's centre through air that is free as far as is known, with the goal last;
        None where none is known. Without the function, ways are straight.
    known : float
        Expected fraction of the surface within the tolerance when this was planned.
    """

    number: int
    reference_point: np.ndarray
    normal: np.ndarray
    planes: tuple[SamplingPlane, ...]
    reach: float
    step: float
    max_turn: float
    reason: Reason
    until: Callable[[np.ndarray], np.ndarray] | None = None
    step_turn: float = np.pi
    approach: float = 0.0
    known: float = 0.0
    way: Callable[[np.ndarray, np.ndarray, float], np.ndarray | None] | None = None

    def __post_init__(self) -> None:
        point = frozen_array(self.reference_point, (3,), "reference point")
        object.__setattr__(self, "reference_point", point)
        object.__setattr__(self, "normal", check_unit(self.normal, "plan normal"))
        if not 0.0 < real(self.step) <= real(self.reach):
            raise ValueError(f"step is {self.step} and reach {self.reach}; need 0 < step <= reach")

    def __repr__(self) -> str:
        """One line."""
        x, y, z = self.reference_point
        words = f"{self.reason.value} at ({x:.4g}, {y:.4g}, {z:.4g})"
        planes = count_of(len(self.planes), "plane")
        return f"<ProbePlan {self.number}: {words}, {planes} of {self.reach:.4g}>"

    def begin(self, radius: float = 0.0) -> np.ndarray:
        """(3,) centre of a tip of a radius where the approach begins."""
        height = (self.approach or self.usual_approach) + radius
        found: np.ndarray = self.reference_point + height * self.normal
        return found

    @property
    def depth(self) -> float:
        """How far below its beginning an approach looks for the surface, length."""
        height = self.approach or self.usual_approach
        return height + max(height, self.usual_approach)

    def way_from(self, start, radius: float = 0.0) -> np.ndarray | None:
        """(k, 3) points of a way of the tip's centre from a start (3,) to where the approach
        begins, which is the last; None where no clear way is known: the touch is unreachable."""
        goal = self.begin(radius)
        return goal[None] if self.way is None else self.way(np.asarray(start), goal, radius)

    @property
    def usual_approach(self) -> float:
        """Distance above and below the reference point in which the surface is expected, length."""
        return min(0.5 * self.reach, 10.0 * self.step)


def check_answer(pending: Sequence[ProbePlan], touch: Touch, change: AtlasChange) -> ProbePlan:
    """Which of the pending plans a touch and what the atlas made of it answer.

    Raises
    ------
    ValueError
        No plan is open, the arguments are no Touch and no AtlasChange, the touch answers another
        plan, or came from inside of the surface, or the change is that of another touch.
    """
    if not pending:
        raise ValueError("no plan is open: call ask before tell")
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe returns it")
    if not isinstance(change, AtlasChange):
        raise ValueError(
            f"got {type(change).__name__}; give the AtlasChange that Atlas.add returned for it"
        )
    plan = next((plan for plan in pending if plan.number == touch.number), None)
    if plan is None:
        numbers = ", ".join(str(plan.number) for plan in pending)
        is_open = f"plan {numbers} is open" if len(pending) == 1 else f"plans {numbers} are open"
        raise ValueError(f"the touch answers plan {touch.number}, but {is_open}")
    if touch.approach @ plan.normal < 0.0:
        raise ValueError(
            f"the approach of touch {touch.number} points into the surface that its plan expects; "
            "give the direction from the surface to where the probe came from"
        )
    if change.touch not in (None, touch.number):
        raise ValueError(f"the change is that of touch {change.touch}, not of {touch.number}")
    return plan
