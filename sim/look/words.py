"""What a run does and expects, in words."""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.atlas.check.faults import Fault, faults
from touchatlas.patch.words import count_of
from touchatlas.planner import PlannerOptions, ProbePlan, Reason, Step

_SOUGHT = {
    Reason.START: "the first touch",
    Reason.EXPAND: "where the surface ends",
    Reason.REFINE: "where the surface is least sure",
    Reason.VERIFY: "where a hole or a horn may be hidden",
    Reason.SEARCH: "other parts",
    Reason.DATUM: "the first place again",
}
# Touches from whose gain the number of those to come is taken.
_LATELY = 10


def sought(plan: ProbePlan) -> str:
    """What a plan is for, and where."""
    place = ", ".join(f"{x:.4g}" for x in plan.reference_point)
    return f"{_SOUGHT[plan.reason]}, near ({place})"


@dataclass
class Outlook:
    """What was known at each touch, and what is to be expected of those to come.

    Parameters
    ----------
    known : list of float
        Fraction of the surface within the tolerance when each touch was planned.
    seconds : list of float
        Of planning, touching and learning each.
    why_less : str
        Why less is known than was before; empty where it is not.
    faults : tuple of Fault
        What is wrong with the touches.
    """

    known: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    why_less: str = ""
    faults: tuple[Fault, ...] = ()
    _faces: tuple[int, int] = (0, 0)
    _extent: tuple[float, float] = (0.0, 0.0)

    def add(self, step: Step, atlas: Atlas) -> None:
        """Take one round."""
        self.why_less = self.less_because(step.plan.known) or self.why_less
        self.known.append(step.plan.known)
        if self.known[-1] > max(self.known) - 0.01:
            self.why_less = ""
        self.faults = faults(atlas)
        self.seconds.append(step.seconds_plan + step.seconds_touch + step.seconds_fit)
        body = atlas.body
        self._faces = self._faces[1], 0 if body is None else len(body.faces)
        self._extent = self._extent[1], 0.0 if body is None else body.extent

    def less_because(self, known: float) -> str:
        """Why less is known than before, with the share ``known`` now; empty where it is not less
        by a hundredth."""
        if not self.known or known > self.known[-1] - 0.01:
            return ""
        (before, now), less = self._faces, f"less than the {max(self.known):.1%} before"
        if before != now:
            return f"{less}: the body is read anew, {count_of(now, 'face')} after {before}"
        if self._extent[1] > 1.02 * self._extent[0]:
            return f"{less}: more of the surface came into sight"
        return f"{less}: errors were larger than predicted"

    def left(self) -> tuple[int, float] | None:
        """Number of touches and seconds until enough is known, as the touches lately; None where
        they have gained nothing."""
        lately = self.known[-_LATELY:]
        gain = (lately[-1] - lately[0]) / (len(lately) - 1) if len(lately) > 2 else 0.0
        if gain <= 0.0:
            return None
        count = max(int(np.ceil((PlannerOptions().coverage - lately[-1]) / gain)), 1)
        return count, count * float(np.mean(self.seconds[-_LATELY:]))

    def note(self, step: Step, tracked: float) -> str:
        """How far a run is, in one line."""
        words = [f"touch {step.plan.number + 1}", f"{step.plan.known:.1%} known"]
        words += [self.why_less] if self.why_less else []
        words += [fault.name for fault in self.faults]
        if (left := self.left()) is not None:
            count, seconds = left
            time = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"
            words.append(f"about {count} more in {time}")
        return f"{', '.join(words)}, tracked {tracked:.4g}; sought {sought(step.plan)}"
