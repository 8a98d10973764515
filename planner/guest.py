"""Planners of other packages: a source of targets by name, or a class with ``ask`` and ``tell``."""

from typing import Any

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.patch.entry_points import PLANNERS, load_added
from touchatlas.planner.attempts import Target
from touchatlas.planner.options import NAMES, PlannerOptions
from touchatlas.planner.places import Places
from touchatlas.planner.planner import Planner
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.stop import StopReason
from touchatlas.planner.view import View


def planner_of(start, outward, options: PlannerOptions = PlannerOptions(), rng=None) -> Planner:
    """The planner that the options name.

    Parameters
    ----------
    start : (3,) float, length, world
    outward : (3,) float, unit, world
    options : PlannerOptions
        Its ``name`` is one of ours or one that another package adds to ``touchatlas.planners``: a
        function from a View and Places to a Target or None, which takes the place of our choice;
        or a class that is called with these four arguments and has ``ask`` and ``tell``.
    rng : numpy.random.Generator, optional
    """
    added: Any = None if options.name in NAMES else load_added(PLANNERS, options.name)
    if isinstance(added, type):
        made = added(start, outward, options, rng)
        return made if isinstance(made, Planner) else Guest(made, start, outward, options, rng)
    return Planner(start, outward, options, rng)


class Guest(Planner):
    """Asks a planner of another package, and knows what ours knows of the surface.

    It ends where the guest has no plan, or where enough of the surface is expected within the
    tolerance, as all others do.

    Parameters
    ----------
    guest : object with ``ask(atlas)`` and ``tell(touch, change)``
    start, outward, options, rng : those of Planner
    """

    def __init__(
        self,
        guest: Any,
        start,
        outward,
        options: PlannerOptions = PlannerOptions(),
        rng: np.random.Generator | None = None,
    ) -> None:
        super().__init__(start, outward, options, rng)
        self._guest = guest

    def ask_several(self, atlas: Atlas, count: int) -> tuple[ProbePlan, ...]:
        """The pending plan, or the guest's next one: it has one at a time."""
        attempts = self._attempts
        if attempts.pending:
            return attempts.plans
        self.stop = None
        places = self._measure(atlas)
        plan = None if self._is_known else self._guest.ask(atlas)
        if plan is None:
            self._end(self._view(atlas), places)
            return ()
        target = Target(plan.reference_point, plan.normal, plan.reason)
        attempts.ask(target, plan, self._known.coverage)
        return attempts.plans

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of the pending plan."""
        super().tell(touch, change)
        self._guest.tell(touch, change)

    def _reason(self, view: View, places: Places) -> StopReason:
        """Why there is no further plan."""
        if view.atlas.body is None:
            return StopReason.NO_PATCH
        return StopReason.KNOWN if self._is_known else StopReason.TRIED
