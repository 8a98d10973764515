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
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "attempts": "Target",
        "cost_model": "CostModel",
        "guest": "planner_of",
        "loop": "Step explore",
        "options": "PlannerOptions",
        "planner": "Planner",
        "probe_plan": "ProbePlan Reason",
        "sources": "target_at",
        "stop": "Stop StopReason",
        "store": "load_planner save_planner",
        "tracking.machines": "Reading Scanner Trigger",
        "tracking.options": "Tip TrackingOptions TriggerOptions",
        "tracking.touch_points": "touch_points",
        "tracking.track_plan": "track_plan",
    },
)
