"""A file of recorded contours: CSV to curves, every line checked."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from touchatlas.patch.geometry.arrays import has_powers
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.column_names import COORDINATES, NORMAL, WANTED, name_columns
from touchatlas.sim.recorded.table_file import Table, read_table


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve of a file: points (n, 3) in order of travel, its plane's unit normal if known."""

    name: str
    points: np.ndarray
    normal: np.ndarray | None


class Curves(NamedTuple):
    """Curves of a file in order of appearance, whether points were repeated, what was assumed
    about the file and what is probably wrong with it, in sentences, and the unit it names."""

    curves: list[Curve]
    repeated: bool
    assumed: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    unit: str = ""


def read_curves(path) -> Curves:
    """Curves of a CSV file: of any common separator, decimal sign and names of columns.

    A curve without a name holds scattered contacts. Of points that one curve repeats exactly
    the first is kept, but for the end of a closed loop.

    Raises
    ------
    ValueError
        In one sentence, with the line where there is one: missing or empty file, no text,
        missing columns, cells that are no finite numbers, several planes for one curve.
    """
    rows: dict[str, list[list[float]]] = {}
    listed_rows, table = _read_rows(Path(path))
    for name, values in listed_rows:
        rows.setdefault(name, []).append(values)
    curves, repeated = [], False
    for name, listed in rows.items():
        numbers = np.array(listed)
        points = _without_repeats(numbers[:, :3])
        repeated |= len(points) < len(numbers)
        curves.append(Curve(name, points, _plane_normal(path, name, numbers[:, 3:])))
    everything = np.concatenate([curve.points for curve in curves])
    span = np.ptp(everything, axis=0).max()
    if span == 0.0:
        raise ValueError(f"{path} has one point only, all others repeat it; record curves")
    if not has_powers(span, np.abs(everything).max()):
        raise ValueError(
            f"{path} has points that span {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )
    curves = _once(curves, table.warnings)
    return Curves(curves, repeated, tuple(table.assumed), tuple(table.warnings), table.unit)


def _once(curves: list[Curve], warnings: list[str]) -> list[Curve]:
    """Curves without the points that an earlier one holds, where these are most of the points.

    Two curves share the point where they cross. A contour that was written twice shares all.
    """
    kept: list[Curve] = []
    for curve in curves:
        points = curve.points
        for earlier in kept:
            both = np.concatenate([earlier.points, points])
            first = np.unique(both, axis=0, return_index=True)[1]
            new = np.sort(first[first >= len(earlier.points)]) - len(earlier.points)
            if curve.name and earlier.name and 2 * len(new) < len(points):
                warnings.append(
                    f"curve {curve.name!r} repeats {len(points) - len(new)} points of curve "
                    f"{earlier.name!r}; they were counted once"
                )
                points = points[new]
        if len(points):
            kept.append(replace(curve, points=points))
    return kept


def _without_repeats(points) -> np.ndarray:
    """The points of a curve, each once; the last point is kept where it closes a loop."""
    keep = np.sort(np.unique(points, axis=0, return_index=True)[1])
    if len(keep) > LEAST_POINTS and (points[0] == points[-1]).all():
        keep = np.append(keep, len(points) - 1)
    return points[keep]


def _read_rows(path: Path) -> tuple[list[tuple[str, list[float]]], Table]:
    """Names of curves and x, y, z, nx, ny, nz, line by line, NaN for a normal not given; and the
    table they are from."""
    if not path.is_file():
        raise ValueError(f"{path} is no file; give a CSV file with {WANTED} in its first line")
    table = read_table(path)
    if not table.rows:
        what = "has no points below its header" if table.header else "is empty"
        raise ValueError(
            f"{path} {what}; give a CSV file with {WANTED} in its first line, and a line for each "
            "point"
        )
    places = name_columns(path, table)
    width = len(table.header) if table.header else 1 + max(places.values())
    rows = [
        _parse(f"{path}, line {number}", table, block, cells, width, places)
        for number, block, cells in table.rows
    ]
    return rows, table


def _parse(where: str, table: Table, block: int, row: list[str], width: int, places):
    """Name of the curve and x, y, z, nx, ny, nz of one line."""
    if len(row) > width and not any(row[width:]):
        row = row[:width]
    if len(row) != width:
        advice = (
            "fill them in, or delete the line"
            if len(row) < width
            else "write decimals with a point, or separate cells by semicolons"
        )
        raise ValueError(f"{where} has {len(row)} cells, but the header {width}; {advice}")
    cells = {name: row[place] for name, place in places.items()}
    bare = not any(cells.get(name) for name in NORMAL)
    values = [_number(where, table, name, cells[name]) for name in COORDINATES]
    values += [np.nan if bare else _number(where, table, name, cells[name]) for name in NORMAL]
    return cells.get("curve", f"{block + 1}"), values


def _number(where: str, table: Table, name: str, cell: str) -> float:
    value = table.number(cell)
    if not np.isfinite(value):
        raise ValueError(
            f"{where}: {name} is {cell!r}; a finite number is needed: correct or delete the line"
        )
    return value


def _plane_normal(path, name: str, given) -> np.ndarray | None:
    """Unit normal of a curve's sampling plane from its rows (n, 3), None where not given."""
    given = given[np.isfinite(given[:, 0])]
    if not len(given):
        return None
    length = np.sqrt((given**2).sum(axis=1, keepdims=True))
    unit = given / np.where(length > 0.0, length, 1.0)
    # Lines of one plane differ by less than 2 degrees.
    if not (np.abs(unit @ unit[0]) > np.cos(np.deg2rad(2.0))).all():
        raise ValueError(
            f"{path}: nx, ny, nz of curve {name!r} are zero or differ from line to line; give one "
            "plane a curve, or leave them out"
        )
    return unit[0]
