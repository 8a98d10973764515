"""Pending: a plan that was asked for and not answered yet."""

from dataclasses import dataclass, replace

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.plans import ending_where_known
from touchatlas.planner.probe_plan import ProbePlan


@dataclass(frozen=True, eq=False)
class Pending:
    """A plan that was asked for and not answered yet.

    Parameters
    ----------
    plan : ProbePlan
    ends_where_known : bool
        Whether its arms may end where the surface is known.
    closer : int
        How often its place was tried with finer steps and shorter arms.
    known : bool
        Whether it touches what is known beside a place where the first touch met nothing.
    """

    plan: ProbePlan
    ends_where_known: bool
    closer: int = 0
    known: bool = False

    def bound(self, atlas: Atlas) -> "Pending":
        """The same, asking an atlas where arms end: a plan from a file has no atlas."""
        if not self.ends_where_known or self.plan.until is not None:
            return self
        return replace(self, plan=ending_where_known(self.plan, atlas))
