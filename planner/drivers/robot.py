"""A machine that triggers as a robot: a function from a plan to a touch."""

from collections.abc import Callable

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.planner.drivers.guarded import GuardedTrigger, OutOfReach, late
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import Tip, TriggerOptions
from touchatlas.planner.tracking.touch_points import touch_points


def robot_of(
    trigger: GuardedTrigger, tip: Tip = Tip(), options: TriggerOptions = TriggerOptions()
) -> Callable[[ProbePlan], Touch]:
    """A robot that touches points with a machine.

    A place whose approach is beyond the limits of the machine is unreachable; an arm ends where its
    next point is. The spread of the trigger's lateness joins the noise of the tip.

    Parameters
    ----------
    trigger : GuardedTrigger
    tip : Tip
        As ``read_tip`` has it of a probe.toml.
    options : TriggerOptions
    """
    own = late(tip, trigger.options.feed, trigger.period)

    def robot(plan: ProbePlan) -> Touch:
        origin = plan.begin(own.radius)
        ends = np.stack([origin, origin - plan.depth * plan.normal])
        if not trigger.reaches(ends):
            place, status = (plan.reference_point, plan.normal), TouchStatus.UNREACHABLE
            return Touch(
                plan.number, *place, (), status, 0.0, 0.0, None, own.radius, own.radius_std
            )
        return touch_points(_WithinReach(trigger), plan, own, options)

    return robot


class _WithinReach:
    """A ``Trigger`` that meets nothing where it cannot go: for arms, which claim no free way."""

    def __init__(self, trigger: GuardedTrigger) -> None:
        self._trigger = trigger
        self.move, self.position = trigger.move, trigger.position

    def probe(self, target: np.ndarray) -> np.ndarray | None:
        try:
            return self._trigger.probe(target)
        except OutOfReach:
            return None
