"""A text file with columns of time, position and force as a recording."""

import re
from pathlib import Path

import numpy as np

from touchatlas.patch.words import count_of
from touchatlas.planner.drivers.recording import Recording
from touchatlas.sim.recorded.column_names import columns_by_name, triples_of
from touchatlas.sim.recorded.table_file import Table, read_table
from touchatlas.sim.world.units import UNITS, said_unit

_FORCE = re.compile(r"(?<![a-z])(f|force|forces|ft|wrench|kraft|forza|fuerza|力)(?![a-z])")
_TORQUE = re.compile(r"torque|moment|drehmoment")
# Seconds in a unit of time, by the end of its name.
_SECONDS = {"s": 1.0, "sec": 1.0, "secs": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_WANTED = "name the columns time, x, y, z, fx, fy, fz in the first line"


def has_forces(path) -> bool:
    """Whether a text file has columns of forces beside coordinates.

    ValueError where it is no table of points.
    """
    return _forces_of(read_table(Path(path))) is not None


def read_force_file(path, unit: str = "") -> Recording:
    """Time, position and force of a text file whose first line names its columns.

    Parameters
    ----------
    path : path-like
    unit : str
        Of the lengths, where the file does not say it.

    Raises
    ------
    ValueError
        In one sentence: a column is missing, a cell is no number, or times that do not rise.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give one with the columns time, x, y, z, fx, fy, fz")
    table = read_table(path)
    columns, forces = columns_by_name(path, table), _forces_of(table)
    if columns is None or columns.time is None or forces is None:
        missing = [
            name
            for name, found in (
                ("coordinates", columns),
                ("time", None if columns is None else columns.time),
                ("forces", forces),
            )
            if found is None
        ]
        raise ValueError(f"{path} has no column of {' or '.join(missing)}; {_WANTED}")
    places = (columns.time, *columns.xyz, *forces)
    rows = np.stack([table.numbers(i) for i in places], axis=1)
    if (bad := ~np.isfinite(rows).all(axis=1)).any():
        raise ValueError(
            f"{path}, line {table.lines[bad.argmax()]}: a cell of time, position or force is no "
            "number; delete the line"
        )
    seconds = rows[:, 0] * _seconds(columns.names[columns.time])
    rising = np.append(True, np.diff(seconds) > 0.0)
    if (np.diff(seconds) < 0.0).any():
        line = table.lines[int((np.diff(seconds) < 0.0).argmax()) + 1]
        raise ValueError(f"{path}, line {line}: the time is earlier than in the line before")
    if rising.sum() < 2:
        raise ValueError(
            f"{path} has one time only, {seconds[0]:g} s; record with a clock that tells readings "
            "apart"
        )
    named = [columns.names[i] for i in places]
    said = [f"time, position and force are {', '.join(named)}"]
    if not rising.all():
        lines = count_of((~rising).sum(), "line has", "lines have")
        said.append(f"{lines} the time of the line before, and not used")
    own = columns.unit or table.unit or said_unit([text for _, text in table.words])
    own = UNITS[unit] if unit else own
    kept = rows[rising]
    return Recording(seconds[rising] - seconds[0], kept[:, 1:4], kept[:, 4:], own, tuple(said))


def _forces_of(table: Table) -> tuple[int, ...] | None:
    """Places of the three columns of the force."""
    for row in table.above:
        for triple in triples_of(row):
            if _FORCE.search(triple.words) and not _TORQUE.search(triple.words):
                return triple.places
    return None


def _seconds(name: str) -> float:
    """Seconds in the unit of a column of times.

    >>> _seconds("time [ms]"), _seconds("t_ns"), _seconds("time")
    (0.001, 1e-09, 1.0)
    """

    words = re.findall(r"[a-z]+", name.lower())
    return _SECONDS.get(words[-1], 1.0) if len(words) > 1 else 1.0
