"""A file of recorded points to curves, each with what is known of its plane or outer side.

The function for all who read recordings is ``read_curves``. It needs no planes through one point:
single curves, slices, rasters, single points and clouds are read alike.
"""

from pathlib import Path

import numpy as np

from touchatlas.planner.drivers.bags import is_bag
from touchatlas.sim.recorded.column_contents import columns_by_content, said_columns
from touchatlas.sim.recorded.column_names import VECTOR, Columns, columns_by_name, flags
from touchatlas.sim.recorded.curve_parts import part_rows
from touchatlas.sim.recorded.curves import Curves, ReadOptions, check_size, checked
from touchatlas.sim.recorded.other_files import cross_sections, read_other
from touchatlas.sim.recorded.recorded_arms import arms_of
from touchatlas.sim.recorded.table_file import Table, read_table
from touchatlas.sim.world.units import said_unit

_NOTHING = ("", "nan", "-nan", "nan(ind)", "-nan(ind)", "null", "none", "na", "n/a", "--", "-")


def read_curves(path, options: ReadOptions = ReadOptions()) -> Curves:
    """Curves of a file of points: of any separator, decimal sign and names of columns.

    Of points that one curve repeats exactly the first is kept, but for the end of a closed loop.
    Points that a flag calls failed, and those that are no numbers, are left out and counted.

    Raises
    ------
    ValueError
        In one sentence, with the line where there is one, and with how the file was read.

    Examples
    --------
    >>> import tempfile
    >>> text = "x,y,z,nx,ny,nz,hit\\n0,0,1,0,0,1,1\\n1,0,0,1,0,0,1\\n5,5,5,0,0,1,0\\n0,1,0,0,1,0,1"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = (Path(folder) / "points.csv").write_text(text)
    ...     file = read_curves(Path(folder) / "points.csv", ReadOptions(unit="mm"))
    >>> [(c.name, c.points.shape, c.outward.shape, c.exact) for c in file.curves], file.unit
    ([('', (3, 3), (3, 3), True)], 'mm')
    """
    path = Path(path)
    if not (path.is_file() or options.tip and is_bag(path)):
        raise ValueError(
            f"{path} is no file; give a file with a line for each point: curve, x, y, z"
        )
    if options.tip and (arms := arms_of(path, options)):
        return arms
    if other := read_other(path):
        groups, unit = other
        return checked(path, groups, unit, options, [f"read by its ending {path.suffix}"], [])
    return _read_text(path, options)


def _read_text(path: Path, options: ReadOptions) -> Curves:
    """Curves of a text file of points."""
    if sections := cross_sections(path):
        how = "read as cross-sections: planes, vertices and edges"
        return checked(path, sections, "", options, [how], [])
    table = read_table(path)
    words = [text for _, text in table.words]
    columns = _columns(path, table, options)
    points = np.stack([table.numbers(i) for i in columns.xyz], axis=1)
    kept, left_out = _usable(path, table, columns, points)
    check_size(path, points[kept])
    names, parted = part_rows(table, columns, points, kept, options.gap)
    vectors = np.full(points.shape, np.nan)
    if columns.vector:
        vectors = np.stack([table.numbers(i) for i in columns.vector], axis=1)
    unit = columns.unit or table.unit or said_unit(words)
    # No robot reaches farther; ABB and KUKA write millimetres.
    if columns.poses and not (unit or options.unit) and np.abs(points[kept]).max(initial=0) < 50.0:
        unit = "m"
        table.assumed.append("metres, as poses of robots are in; else give --unit")
    table.assumed += _how(table, columns, parted, left_out)
    rows: dict[str, list[int]] = {}
    for name, row in zip(names, np.flatnonzero(kept).tolist(), strict=True):
        rows.setdefault(name, []).append(row)
    groups = [(name, points[listed], vectors[listed]) for name, listed in rows.items()]
    return checked(path, groups, unit, options, table.assumed, table.warnings)


def _columns(path: Path, table: Table, options: ReadOptions) -> Columns:
    """Which column is what: as the user says, by names, or by what the columns hold."""
    names = table.above[0] if table.above else []
    if options.columns:
        columns = said_columns(options.columns, table, names)
        columns.unit = options.unit
        return columns
    return columns_by_name(path, table) or columns_by_content(path, table)


def _are_nines(cells) -> np.ndarray:
    """(n,) numbers that are a common mark of no point."""
    whole, parts = (999.0, 9999.0, 99999.0, 999999.0), (999.99, 999.999, 9999.99, 9999.999, 99999.9)
    return np.isin(np.abs(cells), whole + parts)


def _usable(path: Path, table: Table, columns: Columns, points) -> tuple[np.ndarray, list[str]]:
    """(n,) rows that are points, and in words how many are none.

    Cells that are empty or NaN hold no point; other words where a number should be are mistakes.
    """
    lost = ~np.isfinite(points).all(axis=1)
    lost |= (points == points[:, :1]).all(axis=1) & _are_nines(points[:, 0])
    wanted = {("x", "y", "z")[k]: place for k, place in enumerate(columns.xyz)}
    _refuse_words(path, table, wanted, set(_NOTHING))
    if columns.vector:
        found = np.stack([np.isfinite(table.numbers(i)) for i in columns.vector], axis=1)
        part = found.any(axis=1) & ~found.all(axis=1)
        vectors = dict(zip(VECTOR, columns.vector, strict=True))
        _refuse_words(path, table, vectors, set() if part.any() else set(_NOTHING))
    said = [f"{lost.sum()} without coordinates"] if lost.any() else []
    if columns.flag is None:
        return ~lost, said
    yes = flags(table.columns[columns.flag[0]])
    if yes is None:
        raise ValueError(f"{path}: the cells of the flag are no yes or no; leave flag out")
    failed = ~lost & (np.array(yes) != columns.flag[1])
    if failed.any():
        name = columns.names[columns.flag[0]] if columns.names else f"column {columns.flag[0] + 1}"
        said.append(f"{failed.sum()} that {name} calls failed")
    return ~lost & ~failed, said


def _refuse_words(path: Path, table: Table, places: dict[str, int], nothing: set[str]) -> None:
    """Refuse cells that are neither numbers nor empty, in the first line that has one."""
    for name, place in places.items():
        for row in np.flatnonzero(~np.isfinite(table.numbers(place))):
            cell = table.columns[place][row]
            if cell.lower() not in nothing:
                raise ValueError(
                    f"{path}, line {table.lines[row]}: {name} is {cell!r}; a finite number is "
                    "needed: correct or delete the line"
                )


def _how(table: Table, columns: Columns, parted: str, left_out: list[str]) -> list[str]:
    """How a table was read: what each column is, and which lines are no points."""

    def title(place: int) -> str:
        return (columns.names[place] if columns.names else "") or f"column {place + 1}"

    parts = [f"x, y, z are {', '.join(title(i) for i in columns.xyz)}"]
    if columns.vector:
        parts.append(f"vectors are {', '.join(title(i) for i in columns.vector)}")
    if columns.time is not None:
        parts.append(f"time is {title(columns.time)}")
    parts.append(parted)
    used = {*columns.xyz, *columns.vector, columns.curve, columns.time}
    used.add(columns.flag[0] if columns.flag else None)
    free = [title(i) for i in range(len(table.columns)) if i not in used]
    if other := [name for name in free if name not in parted]:
        more = f" and {len(other) - 8} more" if len(other) > 8 else ""
        parts.append(f"ignored: {', '.join(other[:8])}{more}")
    if left_out:
        parts.append(f"lines left out: {', '.join(left_out)}")
    below = [number for number, _ in table.words if number > table.lines[0]]
    if below:
        lines = ", ".join(map(str, below[:3])) + (" ..." if len(below) > 3 else "")
        parts.append(f"lines of words or comment skipped: {len(below)} ({lines})")
    return parts
