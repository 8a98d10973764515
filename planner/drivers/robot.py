"""A machine that triggers as a robot: a function from a plan to a touch."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.checks import check_type
from touchatlas.planner.drivers.guarded import GuardedTrigger, late
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import Tip, TriggerOptions
from touchatlas.planner.tracking.touch_points import touch_points


def robot_of(
    trigger: GuardedTrigger, tip: Tip = Tip(), options: TriggerOptions = TriggerOptions()
) -> Callable[[ProbePlan], Touch]:
    """A robot that touches points with a machine.

    Approaches begin and end at the limits of the machine where they would lie beyond them. A place
    that is out of reach, or was not met before the limits, is unreachable; an arm ends there. The
    spread of the trigger's lateness joins the noise of the tip.

    Parameters
    ----------
    trigger : GuardedTrigger
    tip : Tip
        As ``read_tip`` has it of a probe.toml.
    options : TriggerOptions

    Raises
    ------
    ValueError
        Without a GuardedTrigger, Tip or TriggerOptions.
    """
    check_type("trigger", trigger, GuardedTrigger)
    check_type("tip", tip, Tip)
    check_type("options", options, TriggerOptions)
    own = late(tip, trigger.options.feed, trigger.period)

    def robot(plan: ProbePlan) -> Touch:
        # What is learned and planned are centres.
        place, n = plan.reference_point, plan.normal
        room = trigger.room(place, n)
        if room > 0.0:
            height = plan.approach or plan.usual_approach
            near = plan if height < room else replace(plan, approach=(1.0 - 1e-9) * room)
            within = _WithinReach(trigger)
            touch = touch_points(within, near, own, options)
            if touch.status is not TouchStatus.NO_CONTACT or not within.was_cut:
                return touch
        status, known = TouchStatus.UNREACHABLE, (own.radius, own.radius_std)
        return Touch(plan.number, place, n, (), status, 0.0, 0.0, None, *known)

    return robot


class _WithinReach:
    """A ``Trigger`` whose probing moves end at the limits of the machine: what they meet is there,
    but where they meet nothing ``was_cut`` tells that they did not come as far as they should."""

    def __init__(self, trigger: GuardedTrigger) -> None:
        self._trigger, self.was_cut = trigger, False
        self.move, self.position = trigger.move, trigger.position

    def probe(self, target: np.ndarray) -> np.ndarray | None:
        start = self.position()
        way = target - start
        length = float(np.linalg.norm(way))
        room = self._trigger.room(start, way / max(length, 1e-300))
        self.was_cut = room < length
        return self._trigger.probe(start + way * min(1.0, (1.0 - 1e-9) * room / length))
