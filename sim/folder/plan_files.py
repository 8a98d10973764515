"""Plans as tables, CSV and JSON, and the answers to them as touches."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan, Reason

# Words of the column ``event`` beside those of ``ContourEnd``.
CONTACT, MISS, UNREACHABLE = "contact", "no contact", "unreachable"
_COLUMNS = [
    *("plan", "plane", "reason", "x", "y", "z", "nx", "ny", "nz", "px", "py", "pz"),
    *("approach", "reach", "step", "max_turn"),
]
_ENDS = {end.value: end for end in ContourEnd}


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


def is_answer(path) -> bool:
    """Whether a file holds answers to plans: JSON of touches, or CSV with a column ``plan``."""
    path = Path(path)
    if path.suffix.lower() == ".json":
        return True
    if path.suffix.lower() not in (".csv", ".txt") or not path.is_file():
        return False
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        names = [name.strip().lower() for name in file.readline().split(",")]
    return {"plan", "x", "y", "z"} <= set(names)


def read_answers(path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """The touches of a file that answer pending plans, by their numbers.

    CSV has the columns plan, plane, x, y, z, a line for each point in order of travel, and if
    wanted event: ``contact`` for the point of first contact, ``no contact`` or ``unreachable`` for
    a plan without points, and at the first or last point of a plane why tracking ended there, in
    the words of ``ContourEnd``. JSON is a list of touches with the fields of ``Touch``.

    Raises
    ------
    ValueError
        In one sentence, with the line.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give CSV with the columns plan, plane, x, y, z")
    if path.suffix.lower() == ".json":
        found = _of_json(path, plans, noise)
    else:
        found = _of_csv(path, plans, noise)
    return sorted(found, key=lambda touch: touch.number)


def touch_as_dict(touch: Touch) -> dict[str, Any]:
    """A touch as ``read_answers`` reads it from JSON; numbers are exact."""
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


def _of_json(path: Path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """Touches of a JSON file."""
    try:
        listed = json.loads(path.read_text(encoding="utf-8"))
        listed = listed if isinstance(listed, list) else [listed]
        return [_touch_of(one, plans, noise) for one in listed]
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        words = f"{type(error).__name__}: {error}"
        raise ValueError(
            f"{path} holds no touches ({words}); give a list of touches with plan, contact and "
            "contours"
        ) from None


def _touch_of(one: dict[str, Any], plans: Mapping[int, ProbePlan], noise: float) -> Touch:
    """A touch of a dictionary; what it leaves out is as it was planned."""
    plan = _plan(plans, int(one["plan"]))
    contours = []
    for k, given in enumerate(one.get("contours", ())):
        plane = given.get("plane")
        own = plan.planes[given.get("number", k)] if plane is None else SamplingPlane(**plane)
        ends = [_ENDS[word] for word in given.get("ends", ["length reached"] * 2)]
        std = given.get("noise_std", noise)
        points = np.array(given["points"], float)
        contours.append(Contour(points, own, std, (ends[0], ends[1]), given.get("normals")))
    status = TouchStatus(one.get("status", "touched"))
    way = one.get("way")
    return Touch(
        plan.number,
        np.array(one.get("contact", plan.reference_point), float),
        np.array(one.get("approach", plan.normal), float),
        tuple(contours),
        status,
        float(one.get("tracked_length", sum(_length(c.points) for c in contours))),
        float(one.get("travel_length", 0.0)),
        None if way is None else np.array(way, float),
        float(one.get("tip_radius", 0.0)),
        float(one.get("systematic_std", 0.0)),
    )


def _of_csv(path: Path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """Touches of a CSV file."""
    points: dict[int, dict[int, list[list[float]]]] = {}
    events: dict[int, dict[str, list[float]]] = {}
    ends: dict[tuple[int, int], list[tuple[int, ContourEnd]]] = {}
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.DictReader(file, skipinitialspace=True)
        for line, cells in enumerate(rows, 2):
            row = {str(k).strip().lower(): (v or "").strip() for k, v in cells.items() if k}
            where = f"{path}, line {line}"
            number = _whole(where, "plan", row.get("plan", ""))
            event = row.get("event", "").lower()
            if event in (MISS, UNREACHABLE):
                events.setdefault(number, {})[event] = []
                continue
            at = [_number(where, name, row.get(name, "")) for name in "xyz"]
            if event == CONTACT:
                events.setdefault(number, {})[event] = at
                continue
            plane = _whole(where, "plane", row.get("plane", ""))
            line_of = points.setdefault(number, {}).setdefault(plane, [])
            if event:
                if event not in _ENDS:
                    words = ", ".join([CONTACT, MISS, UNREACHABLE, *_ENDS])
                    raise ValueError(f"{where}: the event {event!r} is none of {words}")
                ends.setdefault((number, plane), []).append((len(line_of), _ENDS[event]))
            line_of.append(at)
    found = []
    for number in sorted({*points, *events}):
        plan, own = _plan(plans, number), points.get(number, {})
        found.append(_answer(path, plan, own, events.get(number, {}), ends, noise))
    if not found:
        raise ValueError(f"{path} holds no answers; give a line for each point")
    return found


def _answer(path, plan: ProbePlan, points, events, ends, noise: float) -> Touch:
    """The touch of the points of one plan, by their planes."""
    if not points:
        met_nothing = MISS in events
        status = TouchStatus.NO_CONTACT if met_nothing else TouchStatus.UNREACHABLE
        return Touch(plan.number, plan.reference_point, plan.normal, (), status, 0.0, 0.0)
    contours = []
    for k, listed in sorted(points.items()):
        if not 0 <= k < len(plan.planes):
            raise ValueError(
                f"{path}: plan {plan.number} has the planes 0 to {len(plan.planes) - 1}, not {k}"
            )
        line = np.array(listed)
        first = last = ContourEnd.LENGTH_REACHED
        for place, end in ends.get((plan.number, k), ()):
            first, last = (end, last) if 2 * place < len(line) else (first, end)
        if ContourEnd.CLOSED_LOOP in (first, last):
            first = last = ContourEnd.CLOSED_LOOP
        contours.append(Contour(line, plan.planes[k], noise, (first, last)))
    contact = events.get(CONTACT)
    if contact is None:
        every = np.concatenate([contour.points for contour in contours])
        off = every - plan.reference_point
        beside = off - (off @ plan.normal)[:, None] * plan.normal
        contact = every[(beside * beside).sum(axis=1).argmin()]
    length = sum(_length(contour.points) for contour in contours)
    own = np.asarray(contact, float)
    return Touch(plan.number, own, plan.normal, tuple(contours), TouchStatus.TOUCHED, length, 0.0)


def _plan(plans: Mapping[int, ProbePlan], number: int) -> ProbePlan:
    """A pending plan of a number; ValueError where there is none."""
    if number not in plans:
        which = ", ".join(map(str, plans)) or "none"
        raise ValueError(f"plan {number} is not pending (pending: {which}); see touchatlas next")
    return plans[number]


def _whole(where: str, name: str, cell: str) -> int:
    try:
        return int(cell)
    except ValueError:
        raise ValueError(f"{where}: {name} is {cell!r}; a whole number is needed") from None


def _number(where: str, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{where}: {name} is {cell!r}; a finite number is needed")
    return value


def _length(points) -> float:
    """Length of a polyline (n, 3)."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())
