"""Pending: a plan that was asked for and not answered yet."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.plans import ending_where_known
from touchatlas.planner.probe_plan import ProbePlan, Reason


@dataclass(frozen=True, eq=False)
class Pending:
    """A plan that was asked for and not answered yet.

    Parameters
    ----------
    plan : ProbePlan
    ends_where_known : bool
        Whether its arms may end where the surface is known.
    closer : int
        How often its place was tried again, beside an edge or with finer steps and shorter arms.
    sought : (3,) float, length, world, optional
        The place beyond what is known that it seeks from a known sample.
    is_guess : bool
        Whether it is a guess behind an edge. One that met nothing is followed by another guess.
    """

    plan: ProbePlan
    ends_where_known: bool
    closer: int = 0
    sought: np.ndarray | None = None
    is_guess: bool = False

    @property
    def place(self) -> np.ndarray:
        """(3,) the place that it was chosen for, length, world."""
        return self.plan.reference_point if self.sought is None else self.sought

    @property
    def is_beyond(self) -> bool:
        """Whether it approaches a place beyond what is known."""
        expands = self.plan.reason is Reason.EXPAND
        return expands and self.sought is None and not self.is_guess

    @property
    def may_miss(self) -> bool:
        """Whether its contour from a known sample will show why, if it meets nothing: where the
        surface ends, or the rim of a hole."""
        return self.is_beyond or (self.plan.reason is Reason.VERIFY and self.sought is None)

    def bound(self, atlas: Atlas) -> "Pending":
        """The same, asking an atlas where arms end: a plan from a file has no atlas."""
        if not self.ends_where_known or self.plan.until is not None:
            return self
        return replace(self, plan=ending_where_known(self.plan, atlas))
