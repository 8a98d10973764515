"""The loop: ask, touch, add, tell. The caller passes ``touch``: a simulator or a robot."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.planner.probe_plan import ProbePlan


class AsksAndTells(Protocol):
    """A planner: it says where to touch next, and learns what became of the touch."""

    def ask(self, atlas: Atlas) -> ProbePlan | None:
        """The next plan, or None at the end."""

    def tell(self, touch: Touch, change: AtlasChange) -> None:
        """Take the result of the plan last asked for."""


@dataclass(frozen=True, eq=False)
class Step:
    """One round of the loop.

    Parameters
    ----------
    plan : ProbePlan
    touch : Touch
    change : AtlasChange
    seconds_plan, seconds_touch, seconds_fit : float
        Wall time of ``ask``, of the touch, and of ``add`` and ``tell`` together.
    """

    plan: ProbePlan
    touch: Touch
    change: AtlasChange
    seconds_plan: float
    seconds_touch: float
    seconds_fit: float


def explore(
    atlas: Atlas,
    planner: AsksAndTells,
    touch: Callable[[ProbePlan], Touch],
    max_touches: int | None = None,
    max_length: float | None = None,
) -> Iterator[Step]:
    """Touch where the planner says until it has no more plans or the budget ends.

    Parameters
    ----------
    atlas : Atlas
        Grows in place.
    planner : Planner, or another with its ``ask`` and ``tell``
    touch : function from ProbePlan to Touch
    max_touches : int, optional
    max_length : float, length, optional
        Tracked length after which no plan is asked for.

    Yields
    ------
    Step
        After each touch, before the next is planned.
    """
    tracked, number = 0.0, 0
    most = np.inf if max_touches is None else max_touches
    longest = np.inf if max_length is None else max_length
    while number < most and tracked < longest:
        start = time.perf_counter()
        plan = planner.ask(atlas)
        asked = time.perf_counter()
        if plan is None:
            return
        answer = touch(plan)
        touched = time.perf_counter()
        change = atlas.add(answer)
        planner.tell(answer, change)
        added = time.perf_counter()
        tracked, number = tracked + answer.tracked_length, number + 1
        yield Step(plan, answer, change, asked - start, touched - asked, added - touched)
