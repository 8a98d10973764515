"""The planner says where to touch next, by ``ask`` and ``tell``.

Another planner is a class with these two methods, in a file of its own beside ``planner.py``.
"""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.planner.loop import Step, explore
    from touchatlas.planner.options import PlannerOptions
    from touchatlas.planner.planner import Planner
    from touchatlas.planner.probe_plan import ProbePlan, Reason
    from touchatlas.planner.stop import Stop, StopReason
    from touchatlas.planner.store import load_planner, save_planner
    from touchatlas.planner.tracking.machines import Reading, Scanner, Trigger
    from touchatlas.planner.tracking.options import Tip, TrackingOptions, TriggerOptions
    from touchatlas.planner.tracking.track_plan import track_plan

__all__ = [
    "Planner",
    "PlannerOptions",
    "ProbePlan",
    "Reading",
    "Reason",
    "Scanner",
    "Step",
    "Stop",
    "StopReason",
    "Tip",
    "TrackingOptions",
    "Trigger",
    "TriggerOptions",
    "explore",
    "load_planner",
    "save_planner",
    "track_plan",
]
__getattr__ = lazy_names(
    {
        "Planner": "touchatlas.planner.planner",
        "PlannerOptions": "touchatlas.planner.options",
        "ProbePlan": "touchatlas.planner.probe_plan",
        "Reason": "touchatlas.planner.probe_plan",
        "Reading": "touchatlas.planner.tracking.machines",
        "Scanner": "touchatlas.planner.tracking.machines",
        "Step": "touchatlas.planner.loop",
        "Stop": "touchatlas.planner.stop",
        "StopReason": "touchatlas.planner.stop",
        "Tip": "touchatlas.planner.tracking.options",
        "TrackingOptions": "touchatlas.planner.tracking.options",
        "Trigger": "touchatlas.planner.tracking.machines",
        "TriggerOptions": "touchatlas.planner.tracking.options",
        "explore": "touchatlas.planner.loop",
        "load_planner": "touchatlas.planner.store",
        "save_planner": "touchatlas.planner.store",
        "track_plan": "touchatlas.planner.tracking.track_plan",
    }
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
