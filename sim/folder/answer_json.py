"""Answers to plans as JSON: a list of touches with the fields of ``Touch``."""

import json
from collections.abc import Mapping
from pathlib import Path
from reprlib import repr as short
from typing import Any

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan
from touchatlas.sim.folder.answer_table import ENDS, contour_of, length_of, planned, whole

_SHAPES = {
    (): "a finite number",
    (3,): "three finite numbers x, y, z",
    (2, 3): "two points of three finite numbers each",
    (-1, 3): "a list of points of three finite numbers each",
}
_ADVICE = "give a list of touches with plan, contact and contours"


def touches_of_json(path: Path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """The touches of a JSON file; see ``read_answers``.

    Raises
    ------
    ValueError
        In one sentence, with the touch and the field.
    """
    try:
        listed = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is no JSON ({error}); {_ADVICE}") from None
    if isinstance(listed, dict) and "plans" in listed:
        raise ValueError(f"{path} holds plans, and no answers to them; {_ADVICE}")
    found = []
    for k, one in enumerate(listed if isinstance(listed, list) else [listed], 1):
        try:
            found.append(_touch(_fields("the touch", one, "plan"), plans, noise))
        except ValueError as error:
            raise ValueError(f"{path}, touch {k}: {error}") from None
    return found


def _touch(one: dict[str, Any], plans: Mapping[int, ProbePlan], noise: float) -> Touch:
    """A touch of a dictionary; what it leaves out is as it was planned."""
    plan = planned(plans, whole("plan", one["plan"]))
    given = one.get("contours", [])
    if not isinstance(given, list):
        raise ValueError(f"contours is {short(given)}; a list is needed")
    contours = tuple(_contour(k, contour, plan, noise) for k, contour in enumerate(given))
    length = sum(length_of(contour.points) for contour in contours)
    lengths = {"tracked_length": length, "travel_length": 0.0}
    lengths |= {"tip_radius": 0.0, "systematic_std": 0.0}
    way = one.get("way")
    return Touch(
        plan.number,
        _array("contact", one.get("contact", plan.reference_point), (3,)),
        _array("approach", one.get("approach", plan.normal), (3,)),
        contours,
        _status(one.get("status", TouchStatus.TOUCHED.value)),
        way=None if way is None else _array("way", way, (2, 3)),
        **{name: float(_array(name, one.get(name, usual))) for name, usual in lengths.items()},
    )


def _contour(k: int, given, plan: ProbePlan, noise: float) -> Contour:
    """The contour of a place in the list; without a plane or its number it is in the plane of the
    plan of that place."""
    name = f"contours[{k}]"
    one = _fields(name, given, "points")
    normals = one.get("normals")
    return contour_of(
        name,
        _array(f"{name}.points", one["points"], (-1, 3)),
        _plane(name, one, k, plan),
        float(_array(f"{name}.noise_std", one.get("noise_std", noise))),
        _ends(f"{name}.ends", one.get("ends", [ContourEnd.LENGTH_REACHED.value] * 2)),
        None if normals is None else _array(f"{name}.normals", normals, (-1, 3)),
    )


def _plane(name: str, one: dict[str, Any], k: int, plan: ProbePlan) -> SamplingPlane:
    """The plane of a contour: its own, or that of a number of the plan."""
    if one.get("plane") is not None:
        held = _fields(f"{name}.plane", one["plane"], "point", "normal")
        parts = {part: _array(f"{name}.plane.{part}", held[part], (3,)) for part in held}
        return SamplingPlane(parts["point"], parts["normal"])
    number, last = whole(f"{name}.number", one.get("number", k)), len(plan.planes) - 1
    if not 0 <= number <= last:
        raise ValueError(
            f"{name}.number is {number}, but plan {plan.number} has the planes 0 to {last}; give "
            "one of these, or the plane itself, as plane with point and normal"
        )
    return plan.planes[number]


def _ends(name: str, given) -> tuple[ContourEnd, ContourEnd]:
    """Why tracking ended at the first and at the last point."""
    pair = isinstance(given, list) and len(given) == 2
    if not (pair and all(isinstance(word, str) and word in ENDS for word in given)):
        raise ValueError(f"{name} is {short(given)}; two words of {', '.join(ENDS)} are needed")
    return ENDS[given[0]], ENDS[given[1]]


def _status(given) -> TouchStatus:
    words = {status.value: status for status in TouchStatus}
    if not (isinstance(given, str) and given in words):
        raise ValueError(f"status is {short(given)}; one of {', '.join(words)} is needed")
    return words[given]


def _fields(name: str, given, *needed: str) -> dict[str, Any]:
    """An object of JSON that has the fields that are needed."""
    if not isinstance(given, dict):
        raise ValueError(f"{name} is {short(given)}; an object with {needed[0]} is needed")
    if missing := [field for field in needed if field not in given]:
        raise ValueError(f"{name} has no {missing[0]}; give it")
    return given


def _array(name: str, given, shape: tuple[int, ...] = ()) -> np.ndarray:
    """Finite numbers of a shape; -1 is any count but none."""
    try:
        found = np.array(given, float)
    except (ValueError, TypeError, OverflowError):
        found = np.array(np.nan)
    fits = len(found.shape) == len(shape) and found.size
    fits = fits and all(want in (-1, have) for want, have in zip(shape, found.shape, strict=True))
    if not (fits and np.isfinite(found).all()):
        raise ValueError(f"{name} is {short(given)}; {_SHAPES[shape]} is needed")
    return found
