"""Answers to plans as a table: CSV as people, programs and spreadsheets write it."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan
from touchatlas.sim.recorded.text_file import text_of

ENDS = {end.value: end for end in ContourEnd}
# Words of the column ``event`` beside those of ``ContourEnd``.
_CONTACT, _MISS, _UNREACHABLE = "contact", "no contact", "unreachable"
_EVENTS = dict.fromkeys([_CONTACT, _MISS, _UNREACHABLE, *ENDS])
# The first line of a spreadsheet that names its separator.
_NAMED = re.compile(r'\s*"?sep=(.)"?\s*', re.IGNORECASE)


@dataclass
class _Answer:
    """What a table says of one plan.

    Parameters
    ----------
    lines : dict of int to list of (3,) float
        Points of each plane, length.
    ends : dict of int to list of (int, ContourEnd)
        Places in these at which tracking ended, and why.
    contact : (3,) float, length, optional
    without : str
        The event of a plan without points, "" where none is said.
    """

    lines: dict[int, list[list[float]]] = field(default_factory=dict)
    ends: dict[int, list[tuple[int, ContourEnd]]] = field(default_factory=dict)
    contact: list[float] | None = None
    without: str = ""


def header_of(lines: Sequence[str]) -> tuple[int, list[str], str]:
    """The place of the line that names the columns, these names, and what separates them.

    >>> header_of(["sep=;", "Plan; x; y; z"])
    (1, ['plan', 'x', 'y', 'z'], ';')
    """
    named = _NAMED.fullmatch(lines[0]) if lines else None
    place = 1 if named else 0
    text = lines[place] if place < len(lines) else ""
    separator = named[1] if named else max(",;\t", key=text.count)
    return place, [cell.strip(' "').lower() for cell in text.split(separator)], separator


def touches_of_table(path: Path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """The touches of a table; see ``read_answers``.

    Raises
    ------
    ValueError
        In one sentence, with the line.
    """
    answers: dict[int, _Answer] = {}
    for where, row in _rows(path):
        number = whole(f"{where}: plan", row.get("plan", ""))
        _take(where, row, answers.setdefault(number, _Answer()))
    found = []
    for number, answer in answers.items():
        try:
            found.append(_touch(planned(plans, number), answer, noise))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    return found


def planned(plans: Mapping[int, ProbePlan], number: int) -> ProbePlan:
    """A pending plan of a number; ValueError where there is none."""
    if number not in plans:
        which = ", ".join(map(str, plans)) or "none"
        raise ValueError(f"plan {number} is not pending (pending: {which}); see touchatlas next")
    return plans[number]


def whole(name: str, given) -> int:
    """A whole number, of a cell or of JSON; ValueError where it is none."""
    try:
        value = float(str(given).replace(",", "."))
        if value.is_integer():
            return int(value)
    except ValueError:
        pass
    raise ValueError(f"{name} is {given!r}; a whole number is needed")


def contour_of(
    name: str, points, plane: SamplingPlane, noise: float, ends, normals=None
) -> Contour:
    """A contour; what is wrong with it is said with its name."""
    try:
        return Contour(points, plane, noise, ends, normals)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def length_of(points) -> float:
    """Length of a polyline (n, 3)."""
    return float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())


def _rows(path: Path) -> Iterator[tuple[str, dict[str, str]]]:
    """The lines of a table that are not empty: where each is, and its cells by their names."""
    lines = text_of(path, []).splitlines()
    place, names, separator = header_of(lines)
    if "reach" in names and "event" not in names:
        raise ValueError(
            f"{path} holds plans, and no answers to them; give what was measured, in the columns "
            "plan, plane, x, y, z"
        )
    table = csv.reader(lines[place + 1 :], delimiter=separator, skipinitialspace=True)
    try:
        for row in table:
            where = f"{path}, line {table.line_num + place + 1}"
            cells = [cell.strip() for cell in row]
            if any(cells[len(names) :]):
                raise ValueError(
                    f"{where} has {len(cells)} cells, but the first line names {len(names)}; write "
                    "decimals with a point, or separate cells by semicolons"
                )
            if any(cells):
                yield where, dict(zip(names, cells, strict=False))
    except csv.Error as error:
        raise ValueError(f"{path}: {error}; correct the quoting") from None


def _take(where: str, row: dict[str, str], answer: _Answer) -> None:
    """Take a line of a table into the answer that it belongs to."""
    event, plane = row.get("event", "").lower(), row.get("plane", "")
    if event and event not in _EVENTS:
        commas = re.sub(r"[\d.,eE+-]", "", event) == ""
        advice = "; separate cells by semicolons where decimals have commas" if commas else ""
        raise ValueError(f"{where}: the event {event!r} is none of {', '.join(_EVENTS)}{advice}")
    at_a_point = bool(plane) and any(row.get(name) for name in "xyz")
    if event == _MISS or (event == _UNREACHABLE and not at_a_point):
        answer.without = event
        return
    at = [_number(f"{where}: {name}", row.get(name, "")) for name in "xyz"]
    if event == _CONTACT:
        answer.contact = at
        return
    k = whole(f"{where}: plane", plane)
    line = answer.lines.setdefault(k, [])
    if event:
        answer.ends.setdefault(k, []).append((len(line), ENDS[event]))
    line.append(at)


def _touch(plan: ProbePlan, answer: _Answer, noise: float) -> Touch:
    """The touch that answers a plan."""
    _check(plan, answer)
    if not answer.lines:
        status = TouchStatus(answer.without)
        return Touch(plan.number, plan.reference_point, plan.normal, (), status, 0.0, 0.0)
    contours = []
    for k, listed in sorted(answer.lines.items()):
        line, ends = np.array(listed), _ends(answer.ends.get(k, ()), len(listed))
        contours.append(contour_of(f"plane {k}", line, plan.planes[k], noise, ends))
    contact = answer.contact
    if contact is None:
        every = np.concatenate([contour.points for contour in contours])
        off = every - plan.reference_point
        beside = off - (off @ plan.normal)[:, None] * plan.normal
        contact = every[(beside * beside).sum(axis=1).argmin()]
    length = sum(length_of(contour.points) for contour in contours)
    at = np.asarray(contact, float)
    return Touch(plan.number, at, plan.normal, tuple(contours), TouchStatus.TOUCHED, length, 0.0)


def _check(plan: ProbePlan, answer: _Answer) -> None:
    """Refuse an answer that says too little, or two things at once."""
    number, last = plan.number, len(plan.planes) - 1
    for k in answer.lines:
        if not 0 <= k <= last:
            raise ValueError(f"plan {number} has the planes 0 to {last}, not {k}")
    if answer.without == _MISS and (answer.lines or answer.contact):
        raise ValueError(
            f"plan {number} has the event {_MISS!r}, and points as well; leave out one of the two"
        )
    if not answer.lines and not answer.without:
        raise ValueError(
            f"plan {number} has a contact, but no points that were tracked from it; give those in "
            f"its planes 0 to {last}, or the event {_UNREACHABLE!r} where none could be tracked"
        )


def _ends(listed, count: int) -> tuple[ContourEnd, ContourEnd]:
    """Why tracking ended at the first and at the last of a count of points."""
    first = last = ContourEnd.LENGTH_REACHED
    for place, end in listed:
        first, last = (end, last) if 2 * place < count else (first, end)
    if ContourEnd.CLOSED_LOOP in (first, last):
        first = last = ContourEnd.CLOSED_LOOP
    return first, last


def _number(name: str, cell: str) -> float:
    """The finite number of a cell, with a point or a comma."""
    try:
        value = float(cell if "." in cell else cell.replace(",", "."))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{name} is {cell!r}; a finite number is needed")
    return value
