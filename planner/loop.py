"""The loop: ask, touch, add, tell. The caller passes ``touch``: a simulator or a robot."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.learn import check_touch
from touchatlas.atlas.records.touch import Touch
from touchatlas.planner.probe_plan import ProbePlan, check_answer


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

    Raises
    ------
    ValueError
        When a touch is refused: see ``check_learnable``.

    Notes
    -----
    What ``touch`` raises, and a touch that is refused, end the loop. Atlas and planner keep all
    touches before, and the plan stays pending: called again with both, the loop goes on with it.
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
        with _pending(plan):
            check_answer((plan,), answer, AtlasChange())
            change = atlas.add(answer)
        planner.tell(answer, change)
        added = time.perf_counter()
        tracked, number = tracked + answer.tracked_length, number + 1
        yield Step(plan, answer, change, asked - start, touched - asked, added - touched)


def check_learnable(atlas: Atlas, plan: ProbePlan, touch: Touch) -> None:
    """Refuse a touch that an atlas cannot learn as the answer to a plan, before anything changes.

    Raises
    ------
    ValueError
        When it is no Touch, answers another plan, came from inside of the surface, or has another
        tip or unit than what was measured so far.
    """
    check_answer((plan,), touch, AtlasChange())
    check_touch(atlas, touch)


@contextmanager
def _pending(plan: ProbePlan) -> Iterator[None]:
    """Let a refusal of the answer to a plan say how to go on."""
    try:
        yield
    except ValueError as error:
        error.add_note(
            f"nothing of the answer to plan {plan.number} was learned, and the touches before it "
            "are kept: explore with the same atlas and planner asks for this touch again"
        )
        raise
