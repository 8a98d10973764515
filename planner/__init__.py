"""The planner says where to touch next, by ``ask`` and ``tell``.

Another planner is a class with these two methods, or a function that chooses a place; a package
adds it by the entry point ``touchatlas.planners``.
"""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.planner.attempts import Target
    from touchatlas.planner.cost_model import CostModel
    from touchatlas.planner.guest import planner_of
    from touchatlas.planner.loop import Step, explore
    from touchatlas.planner.options import PlannerOptions
    from touchatlas.planner.planner import Planner
    from touchatlas.planner.probe_plan import ProbePlan, Reason
    from touchatlas.planner.sources import target_at
    from touchatlas.planner.stop import Stop, StopReason
    from touchatlas.planner.store import load_planner, save_planner
    from touchatlas.planner.tracking.machines import Reading, Scanner, Trigger
    from touchatlas.planner.tracking.options import Tip, TrackingOptions, TriggerOptions
    from touchatlas.planner.tracking.touch_points import touch_points
    from touchatlas.planner.tracking.track_plan import track_plan

__all__ = [
    "CostModel",
    "Planner",
    "PlannerOptions",
    "ProbePlan",
    "Reading",
    "Reason",
    "Scanner",
    "Step",
    "Stop",
    "StopReason",
    "Target",
    "Tip",
    "TrackingOptions",
    "Trigger",
    "TriggerOptions",
    "explore",
    "load_planner",
    "planner_of",
    "save_planner",
    "target_at",
    "touch_points",
    "track_plan",
]
__getattr__ = lazy_names(
    {
        "CostModel": "touchatlas.planner.cost_model",
        "Planner": "touchatlas.planner.planner",
        "PlannerOptions": "touchatlas.planner.options",
        "ProbePlan": "touchatlas.planner.probe_plan",
        "Reason": "touchatlas.planner.probe_plan",
        "Reading": "touchatlas.planner.tracking.machines",
        "Scanner": "touchatlas.planner.tracking.machines",
        "Step": "touchatlas.planner.loop",
        "Stop": "touchatlas.planner.stop",
        "StopReason": "touchatlas.planner.stop",
        "Target": "touchatlas.planner.attempts",
        "Tip": "touchatlas.planner.tracking.options",
        "TrackingOptions": "touchatlas.planner.tracking.options",
        "Trigger": "touchatlas.planner.tracking.machines",
        "TriggerOptions": "touchatlas.planner.tracking.options",
        "explore": "touchatlas.planner.loop",
        "load_planner": "touchatlas.planner.store",
        "planner_of": "touchatlas.planner.guest",
        "save_planner": "touchatlas.planner.store",
        "target_at": "touchatlas.planner.sources",
        "touch_points": "touchatlas.planner.tracking.touch_points",
        "track_plan": "touchatlas.planner.tracking.track_plan",
    }
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
