"""The loop: ask, touch, add, tell. ``touch`` is passed in, so that a robot fits."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.records.touch import Touch
from touchatlas.planner.planner import Planner
from touchatlas.planner.probe_plan import ProbePlan


@dataclass(frozen=True, eq=False)
class Step:
    """One round of the loop, with the seconds that its parts took."""

    plan: ProbePlan
    touch: Touch
    change: AtlasChange
    seconds_plan: float
    seconds_touch: float
    seconds_fit: float


def explore(
    atlas: Atlas,
    planner: Planner,
    touch: Callable[[ProbePlan], Touch],
    max_touches: int | None = None,
    max_length: float | None = None,
) -> Iterator[Step]:
    """Touch where the planner says until it has no more to ask or the budget ends.

    Parameters
    ----------
    atlas : Atlas
        Grows in place.
    planner : Planner
    touch : function from ProbePlan to Touch
        The probe: a simulator or a robot.
    max_touches : int, optional
    max_length : float, length, optional
        Tracked length after which no more is asked.

    Yields
    ------
    Step
        After each touch, before the next is planned: whoever keeps a journal writes it now.
    """
    tracked = 0.0
    number = 0
    while (max_touches is None or number < max_touches) and (
        max_length is None or tracked < max_length
    ):
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
        tracked += answer.tracked_length
        number += 1
        yield Step(plan, answer, change, asked - start, touched - asked, added - touched)
