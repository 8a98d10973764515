"""Answers to plans as files: which files hold them, and the touches that they hold."""

import codecs
from collections.abc import Mapping
from pathlib import Path

from touchatlas.atlas import Touch
from touchatlas.planner import ProbePlan
from touchatlas.sim.folder.answer_json import touches_of_json
from touchatlas.sim.folder.answer_table import header_of, touches_of_table

_TABLES = ".csv", ".tsv", ".txt"
# No header of a table is longer.
_HEAD = 4096


def is_answer(path) -> bool:
    """Whether a file holds answers to plans: JSON of touches, or a table with a column ``plan``,
    separated by commas, semicolons or tabs."""
    path = Path(path)
    if path.suffix.lower() == ".json":
        return True
    if path.suffix.lower() not in _TABLES or not path.is_file():
        return False
    with open(path, "rb") as file:
        data = file.read(_HEAD)
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    head = data.decode("utf-16" if wide else "utf-8-sig", errors="replace")
    names = header_of(head.splitlines())[1]
    return {"plan", "x", "y", "z"} <= set(names) or {"plan", "event"} <= set(names)


def read_answers(path, plans: Mapping[int, ProbePlan], noise: float) -> list[Touch]:
    """The touches of a file that answer pending plans, by their numbers.

    A table has the columns plan, plane, x, y, z, a line for each point in order of travel, and if
    wanted event: ``contact`` for the point of first contact, ``no contact`` or ``unreachable`` for
    a plan without points, and at the first or last point of a plane why tracking ended there, in
    the words of ``ContourEnd``. Where semicolons or tabs separate its cells, numbers may have a
    comma for the point. JSON is a list of touches with the fields of ``Touch``.

    Raises
    ------
    ValueError
        In one sentence, with the line.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give CSV with the columns plan, plane, x, y, z")
    is_json = path.suffix.lower() == ".json"
    found = (touches_of_json if is_json else touches_of_table)(path, plans, noise)
    if not found:
        raise ValueError(f"{path} holds no answers; give a line for each point, or JSON of touches")
    return sorted(found, key=lambda touch: touch.number)
