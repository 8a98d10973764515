"""Which column is what where no names stand above them, by what the columns hold.

Coordinates are the first three columns that are left when counters of lines, times, names of
curves, flags, quaternions and unit vectors are taken off.
"""

import re

import numpy as np

from touchatlas.sim.recorded.column_names import COORDINATES, VECTOR, Columns, counts_lines, flags
from touchatlas.sim.recorded.table_file import Table


def columns_by_content(path, table: Table) -> Columns:
    """Which column is what, by its numbers.

    Raises
    ------
    ValueError
        In one sentence: fewer than three columns of numbers.
    """
    numbers = {i: table.numbers(i) for i in range(len(table.columns))}
    # One bad cell does not make a column one of words.
    left = [
        i for i, n in numbers.items() if np.isnan(n).sum() <= 0.5 * len(n) or _all_nan(table, i)
    ]
    words = [i for i in numbers if i not in left]
    if len(left) < 3:
        raise ValueError(
            f"{path} names no columns, and {len(left)} of its {len(numbers)} hold numbers; three "
            "coordinates are needed: give a line for each point, curve, x, y, z"
        )
    matrix = np.stack([numbers[i] for i in left], axis=1)
    if len(left) == 12 and _rotations(matrix[:, [0, 1, 2, 4, 5, 6, 8, 9, 10]]):
        return Columns((left[3], left[7], left[11]), poses=True)
    texts = (i for i in words if len(set(table.columns[i])) > 1 and not counts_lines(table, i))
    columns = Columns((), curve=next(texts, None))
    for i in range(3, len(left) - 3):
        if _units(matrix[:, i : i + 4]) and np.abs(matrix[:, i : i + 4]).max() <= 1.0 + 1e-3:
            # The position stands before the quaternion.
            columns.xyz, columns.poses = tuple(left[i - 3 : i]), True
            rest = left[: i - 3]
            columns.time = next((j for j in rest if _rises(numbers[j])), None)
            return columns
    while len(left) > 3 and (_counts(numbers[left[0]]) or _rises(numbers[left[0]])):
        if columns.time is None and not _counts(numbers[left[0]]):
            columns.time = left[0]
        left = left[1:]
    if len(left) > 3 and columns.curve is None:
        few = [len(np.unique(numbers[i])) for i in left]
        if few[0] < min(few[1:4]) and _whole(numbers[left[0]]):
            columns.curve, left = left[0], left[1:]
        elif len(left) in (4, 7) and 1 < few[-1] < few[0] and _whole(numbers[left[-1]]):
            columns.curve, left = left[-1], left[:-1]
    columns.xyz = tuple(left[:3])
    if len(table.columns) == 9 and len(left) == 9:
        table.warnings.append(
            "nine columns are as LinuxCNC's PROBEOPEN writes them; such a file says neither its "
            "unit nor its work system, and a G38.3 that met nothing looks like a hit: see to these"
        )
    named = columns.curve
    if named is not None and named not in words and _are_flags(table.columns[named]):
        columns.flag, columns.curve = (named, True), None
    after = left[3:6]
    if len(after) == 3 and _units(np.stack([numbers[i] for i in after], axis=1)):
        columns.vector = tuple(after)
    return columns


def _are_flags(cells: list[str]) -> bool:
    """Whether what seems to name curves goes to and fro between yes and no, as flags do."""
    turns = sum(a != b for a, b in zip(cells[1:], cells, strict=False))
    return flags(cells) is not None and turns > 3


def said_columns(text: str, table: Table, names: list[str]) -> Columns:
    """The columns that a user names, as in ``x=3,y=4,z=5,curve=1``, by number or by name.

    Raises
    ------
    ValueError
        In one sentence: what is not understood.
    """
    places: dict[str, int] = {}
    known = ("curve", *COORDINATES, *VECTOR, "flag", "time")
    for part in text.split(","):
        name, _, where = (word.strip() for word in part.partition("="))
        if name not in known or not where:
            raise ValueError(
                f"--columns has {part!r}; give {', '.join(known)} as NAME=NUMBER or "
                "NAME=HEADING, such as x=3,y=4,z=5,curve=1"
            )
        if where in names:
            places[name] = names.index(where)
        elif re.fullmatch(r"\d+", where) and 1 <= int(where) <= len(table.columns):
            places[name] = int(where) - 1
        else:
            raise ValueError(
                f"--columns has {part!r}, but the file has {len(table.columns)} columns"
                f"{': ' + ', '.join(filter(None, names)) if names else ''}; count from 1"
            )
    if not {*COORDINATES} <= places.keys() or 0 < len({*VECTOR} & places.keys()) < 3:
        raise ValueError(
            f"--columns is {text!r}; it must name x, y and z, and all of nx, ny, nz or none"
        )
    vector = tuple(places[name] for name in VECTOR) if "nx" in places else ()
    flag = (places["flag"], True) if "flag" in places else None
    return Columns(
        tuple(places[axis] for axis in COORDINATES),
        vector,
        places.get("curve"),
        flag,
        places.get("time"),
        names=names,
    )


def _all_nan(table: Table, place: int) -> bool:
    return all(cell.lower() in ("nan", "") for cell in table.columns[place])


def _whole(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool((known == np.round(known)).all())


def _counts(values: np.ndarray) -> bool:
    """Whether numbers count up, in ones, also from the start again."""
    step = np.diff(values)
    return len(step) > 1 and _whole(values) and np.mean(step == 1.0) > 0.9


def _rises(values: np.ndarray) -> bool:
    """Whether numbers never fall, as times do, and are not all the same."""
    step = np.diff(values)
    return len(step) > 1 and bool((step >= 0.0).all()) and values[-1] > values[0]


def _units(vectors: np.ndarray) -> bool:
    """Whether nearly all rows are of length one, to three digits."""
    return float(np.mean(np.abs((vectors**2).sum(axis=1) - 1.0) < 0.01)) > 0.9


def _rotations(rows: np.ndarray) -> bool:
    """Whether rows of nine are rotations."""
    matrix = rows.reshape(-1, 3, 3)
    square = matrix @ matrix.transpose(0, 2, 1) - np.eye(3)
    return float(np.mean(np.abs(square).max(axis=(1, 2)) < 0.01)) > 0.9
