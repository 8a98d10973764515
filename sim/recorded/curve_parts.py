"""What tells the curves of a file apart: a column, empty lines, slices, jumps in space or time."""

import re
from itertools import groupby

import numpy as np

from touchatlas.patch.geometry.order import fills_area, out_of_order
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.patch.words import count_of
from touchatlas.sim.recorded.column_names import Columns, counts_lines
from touchatlas.sim.recorded.table_file import Table

_STEM = re.compile(r"^(.*?\D)[\s._:#/-]*\d+$")


def part_rows(table: Table, columns: Columns, points, kept, gap: float) -> tuple[list[str], str]:
    """Names of the curves of the rows that are kept, and what parts them, in words.

    Parameters
    ----------
    table, columns : Table, Columns
    points : (n, 3) float
        Of all rows; NaN where there is none.
    kept : (n,) bool
        Rows that are points.
    gap : float
        Of how many steps a jump is, of the longer ones of a curve.

    Returns
    -------
    names : list of str
        "" for points that follow no curve.
    parted : str
    """
    rows = np.flatnonzero(kept)
    blocks = _blocks(table, points, rows)
    place = columns.curve
    if place is not None and (named := _by_column(table, columns, place, rows, blocks)):
        return named
    for what, numbers in blocks.items():
        if _parts(numbers):
            return [f"{k + 1}" for k in numbers], f"curves by {what}"
    return _by_values(table, columns, points, rows) or _by_jumps(table, columns, points, rows, gap)


def _by_column(
    table: Table, columns: Columns, place: int, rows, blocks
) -> tuple[list[str], str] | None:
    """Curves by the column that names them, or by the stems of the names of points in it."""
    cells, title = _cells(table, place, rows), _title(columns, place)
    if not counts_lines(table, place):
        _compare_with_blocks(table, cells, blocks.get("empty lines"))
        return cells, f"curves by {title}"
    stems = [m[1] if (m := _STEM.match(cell)) else "" for cell in cells]
    if "" not in stems and 1 < len(set(stems)) <= len(stems) // 3:
        return stems, f"curves by {title} without the number at its end, as it names points"
    table.assumed.append(f"{title} names no curves, as it differs from point to point")
    return None


def _by_values(table: Table, columns: Columns, points, rows) -> tuple[list[str], str] | None:
    """Curves by an unknown column of names that stay as points follow, or by a level."""
    used = {*columns.xyz, *columns.vector, columns.time, columns.curve}
    used.add(columns.flag[0] if columns.flag else None)
    for i in range(len(table.columns)) if columns.names else ():
        cells = _cells(table, i, rows)
        names = i not in used and all(re.fullmatch(r"-?\d+|.*[^\W\d].*", c) for c in cells)
        if names and _runs(cells):
            return cells, f"curves by {_title(columns, i)}, as its cells stay as points follow"
    for axis, values in zip("xyz", points[rows].T, strict=True):
        if _runs(values.tolist(), least=LEAST_POINTS):
            level = np.unique(values, return_inverse=True)[1]
            return [f"{k + 1}" for k in level], f"curves by slices of equal {axis}"
    return None


def _by_jumps(table: Table, columns: Columns, points, rows, gap: float) -> tuple[list[str], str]:
    """Curves by jumps, one curve, or scattered points where they are in no order."""
    time = None if columns.time is None else table.numbers(columns.time)[rows]
    numbers = _jumps(points[rows], time, gap)
    if not out_of_order(points[rows]) and fills_area(points[rows]):
        return [""] * len(rows), "scattered points, as they lie all over an area"
    if _parts(numbers):
        return [f"{k + 1}" for k in numbers], "curves by jumps from point to point"
    if len(rows) < LEAST_POINTS or numbers.any() or out_of_order(points[rows]):
        return [""] * len(rows), "scattered points, as they follow no curve"
    return ["1"] * len(rows), "one curve"


def _cells(table: Table, place: int, rows) -> list[str]:
    return [table.columns[place][i] for i in rows]


def _title(columns: Columns, place: int) -> str:
    name = columns.names[place] if columns.names else ""
    return f"column {name}" if name else f"column {place + 1}"


def _blocks(table: Table, points, rows) -> dict[str, np.ndarray]:
    """Number of the block of each kept row, for each kind of line that parts blocks."""
    lost = np.isnan(points).all(axis=1)
    blocks = {kind: numbers[rows] for kind, numbers in table.blocks.items()}
    blocks["lines of NaN"] = np.cumsum(lost)[rows]
    return {k: np.unique(n, return_inverse=True)[1] for k, n in blocks.items() if len(n)}


def _parts(numbers) -> bool:
    """Whether blocks part curves, and not single points from each other."""
    count = int(numbers.max(initial=0)) + 1
    return count > 1 and 2 * float(np.median(np.bincount(numbers))) > LEAST_POINTS


def _runs(cells: list, least: int = 3) -> bool:
    """Whether equal cells stand together, in two runs or more, each of enough rows."""
    counts = [len(list(same)) for _, same in groupby(cells)]
    return len(counts) == len(set(cells)) > 1 and min(counts) >= least


def _jumps(points, time, gap: float) -> np.ndarray:
    """(n,) numbers of curves, the next where a step is ``gap`` times the upper quartile of steps.

    A single point off the others, to which a step leads and from which one comes back, is a bad
    contact and ends no curve.
    """
    if len(points) < 3:
        return np.zeros(len(points), int)
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    limit = gap * float(np.quantile(step, 0.75))
    far = step > limit
    over = np.sqrt(((points[2:] - points[:-2]) ** 2).sum(axis=1))
    alone = far[1:] & far[:-1] & (over <= limit)
    far[1:] &= ~alone
    far[:-1] &= ~alone
    if time is not None:
        wait = np.diff(time)
        far |= wait > gap * max(float(np.quantile(wait, 0.75)), np.finfo(float).tiny)
    return np.concatenate([[0], np.cumsum(far)])


def _compare_with_blocks(table: Table, names: list[str], blocks) -> None:
    """Warn of empty lines that part the file otherwise than the names of the curves do."""
    if blocks is None:
        return
    pairs = set(zip(blocks.tolist(), names, strict=True))
    count, named = len({b for b, _ in pairs}), len({n for _, n in pairs})
    if count > 1 and not len(pairs) == count == named:
        table.warnings.append(
            f"empty lines make {count} blocks, but the names {count_of(named, 'curve')}, and not "
            "the same; the names were taken"
        )
