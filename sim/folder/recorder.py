"""The probe of a run: it repeats the touches of the journal, then goes on with new ones."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.planner import ProbePlan
from touchatlas.sim.folder.journal import Entry, Journal
from touchatlas.sim.machine.probes import SimulatedProbe


@dataclass
class Recorder:
    """Answers plans: with the touches of an earlier process first, then with those of the probe.

    Planner and atlas learn the same touches in the same order as in the run that was stopped, and
    the probe goes on from the state that it had. So what follows is the same, bit for bit.

    Parameters
    ----------
    probe : SimulatedProbe
    journal : Journal
        Each new touch is committed before it is returned.
    kept : list of Entry
        What the journal held at the beginning.
    remedy : str
        What to try where these touches answer other plans.
    check : function of a plan and a touch
        Raises for a touch that cannot be learned, which is not kept.
    seconds : float, s
        Time taken by the journal, not yet reported.
    """

    probe: SimulatedProbe
    journal: Journal
    kept: list[Entry]
    remedy: str
    check: Callable[[ProbePlan, Touch], None]
    seconds: float = 0.0

    def __call__(self, plan: ProbePlan) -> Touch:
        """The touch that answers a plan.

        Raises
        ------
        ValueError
            When the plan is not the one that the journal's touch answered, or another object, seed
            or noise than that of the probe gave the touch.
        """
        if plan.number < len(self.kept):
            entry = self.kept[plan.number]
            self._check(plan, entry)
            if plan.number == 0:
                self._check_probe(plan, entry.touch)
            if plan.number == len(self.kept) - 1:
                self.probe.restore(entry.probe)
            return entry.touch
        touch = self.probe(plan)
        self.check(plan, touch)
        start = time.perf_counter()
        self.journal.append(plan, touch, self.probe.state())
        self.seconds += time.perf_counter() - start
        return touch

    def take_seconds(self) -> float:
        """Seconds that the journal took since the last call."""
        seconds, self.seconds = self.seconds, 0.0
        return seconds

    def _check_probe(self, plan: ProbePlan, held: Touch) -> None:
        # The probe is new, and its first touch is the one that it made then.
        touch = self.probe(plan)
        size = np.abs(held.contact).max() + plan.reach
        found, kept = ([t.contact, *(c.points for c in t.contours)] for t in (touch, held))
        same = [len(p) for p in found[1:]] == [len(p) for p in kept[1:]]
        if not same or any(
            # Rounding by which versions of the libraries may differ, over the largest coordinate.
            np.abs(a - b).max() > 1e-7 * size
            for a, b in zip(found, kept, strict=True)
        ):
            raise ValueError(
                "the object, seed or noise of run.toml does not give the first touch of the "
                "journal; undo what was changed in run.toml, or explore again"
            )

    def _check(self, plan: ProbePlan, entry: Entry) -> None:
        # What the probe was given of the plan, as far as the touch shows it.
        planned = np.array([plan.normal, *(plane.normal for plane in plan.planes)])
        held = np.array([entry.touch.approach, *(c.plane.normal for c in entry.touch.contours)])
        same = (planned[: len(held)] == held).all() if len(held) in (1, len(planned)) else False
        if plan.reason.value != entry.reason or not same:
            raise ValueError(
                f"touch {entry.touch.number} of the journal answers another plan than is made now; "
                f"{self.remedy}"
            )
