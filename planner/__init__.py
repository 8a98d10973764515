"""The planner says where to touch next, by ``ask`` and ``tell``.

Another planner is a class with these two methods, in a file of its own beside ``planner.py``.
"""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.planner.loop import Step, explore
    from touchatlas.planner.planner import Planner, PlannerOptions
    from touchatlas.planner.probe_plan import ProbePlan, Reason
    from touchatlas.planner.stop import Stop, StopReason
    from touchatlas.planner.tolerance_planner import ToleranceOptions, TolerancePlanner

__all__ = [
    "Planner",
    "PlannerOptions",
    "ProbePlan",
    "Reason",
    "Step",
    "Stop",
    "StopReason",
    "ToleranceOptions",
    "TolerancePlanner",
    "explore",
]
__getattr__ = lazy_names(
    {
        "Planner": "touchatlas.planner.planner",
        "PlannerOptions": "touchatlas.planner.planner",
        "ProbePlan": "touchatlas.planner.probe_plan",
        "Reason": "touchatlas.planner.probe_plan",
        "Step": "touchatlas.planner.loop",
        "Stop": "touchatlas.planner.stop",
        "StopReason": "touchatlas.planner.stop",
        "ToleranceOptions": "touchatlas.planner.tolerance_planner",
        "TolerancePlanner": "touchatlas.planner.tolerance_planner",
        "explore": "touchatlas.planner.loop",
    }
)
