"""Plans as tables, CSV and JSON, and touches as JSON."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from touchatlas.atlas import Touch
from touchatlas.patch import SamplingPlane
from touchatlas.planner import ProbePlan, Reason

_COLUMNS = [
    *("plan", "plane", "reason", "x", "y", "z", "nx", "ny", "nz", "px", "py", "pz"),
    *("approach", "reach", "step", "max_turn"),
]


def plan_rows(plans: Sequence[ProbePlan]) -> list[dict[str, Any]]:
    """One row for each plane of each plan: where to touch, and in which plane to track."""
    rows = []
    for plan in plans:
        for k, plane in enumerate(plan.planes):
            row: dict[str, Any] = {"plan": plan.number, "plane": k, "reason": plan.reason.value}
            row |= dict(zip("xyz", plan.reference_point.tolist(), strict=True))
            row |= dict(zip(("nx", "ny", "nz"), plan.normal.tolist(), strict=True))
            row |= dict(zip(("px", "py", "pz"), plane.normal.tolist(), strict=True))
            row["approach"] = plan.approach or plan.usual_approach
            rows.append(row | {"reach": plan.reach, "step": plan.step, "max_turn": plan.max_turn})
    return rows


def plans_csv(plans: Sequence[ProbePlan]) -> bytes:
    """Plans as CSV, one line for each plane; numbers are exact.

    x, y, z is the reference point, nx, ny, nz the outward normal there, px, py, pz the normal of
    the plane; approach, reach and step are lengths, max_turn is in rad.
    """
    file = io.StringIO(newline="")
    rows = plan_rows(plans)
    writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return file.getvalue().encode()


def plans_json(plans: Sequence[ProbePlan], settings: Mapping[str, Any]) -> bytes:
    """Plans as JSON, with all fields but ``until``; numbers are exact."""
    listed = [plan_as_dict(plan) for plan in plans]
    whole = {"unit": settings.get("unit", ""), "tolerance": settings["tolerance"], "plans": listed}
    return (json.dumps(whole, indent=2) + "\n").encode()


def plan_as_dict(plan: ProbePlan) -> dict[str, Any]:
    """A plan ready for JSON, without ``until``."""
    return {
        "number": plan.number,
        "reason": plan.reason.value,
        "reference_point": plan.reference_point.tolist(),
        "normal": plan.normal.tolist(),
        "planes": [
            {"point": plane.point.tolist(), "normal": plane.normal.tolist()}
            for plane in plan.planes
        ],
        "approach": plan.approach or plan.usual_approach,
        "reach": plan.reach,
        "step": plan.step,
        "max_turn": plan.max_turn,
        "step_turn": plan.step_turn,
        "known": plan.known,
    }


def plan_of_dict(held: dict[str, Any]) -> ProbePlan:
    """The plan of a dictionary that ``plan_as_dict`` made."""
    planes = tuple(SamplingPlane(**plane) for plane in held["planes"])
    return ProbePlan(**held | {"planes": planes, "reason": Reason(held["reason"])})


def touch_as_dict(touch: Touch) -> dict[str, Any]:
    """A touch as ``touchatlas learn`` reads it from JSON; numbers are exact."""
    return {
        "plan": touch.number,
        "status": touch.status.value,
        "contact": touch.contact.tolist(),
        "approach": touch.approach.tolist(),
        "tracked_length": touch.tracked_length,
        "travel_length": touch.travel_length,
        "way": None if touch.way is None else touch.way.tolist(),
        "tip_radius": touch.tip_radius,
        "systematic_std": touch.systematic_std,
        "contours": [
            {
                "points": contour.points.tolist(),
                "plane": {
                    "point": contour.plane.point.tolist(),
                    "normal": contour.plane.normal.tolist(),
                },
                "noise_std": contour.noise_std,
                "ends": [end.value for end in contour.ends],
                "normals": None if contour.normals is None else contour.normals.tolist(),
            }
            for contour in touch.contours
        ],
    }
