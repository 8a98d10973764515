"""A file of recorded points to curves, each with what is known of its plane or outer side.

The function for all who read recordings is ``read_curves``. It needs no planes through one point:
single curves, slices, rasters, single points and clouds are read alike.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from touchatlas.patch.geometry.arrays import has_powers
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.column_contents import columns_by_content, said_columns
from touchatlas.sim.recorded.column_names import VECTOR, Columns, columns_by_name, flags
from touchatlas.sim.recorded.curve_parts import part_rows
from touchatlas.sim.recorded.other_files import cross_sections, read_other
from touchatlas.sim.recorded.table_file import Table, read_table
from touchatlas.sim.recorded.vectors import what_vectors_are
from touchatlas.sim.world.units import UNITS, said_unit

_NINES = (999.0, 9999.0, 99999.0, 999999.0, 999.999, 9999.999, 9999.99, 999.99, 99999.9)
_NOTHING = ("", "nan", "-nan", "nan(ind)", "-nan(ind)", "null", "none", "na", "n/a", "--", "-")


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve of a file, or its scattered points.

    Parameters
    ----------
    name : str
        "" where the points are scattered: single contacts, or a cloud.
    points : (n, 3) float, length
        In order of travel, unless they are scattered.
    normal : (3,) float, unit, optional
        Of its sampling plane, where the file holds it.
    outward : (n, 3) float, unit, optional
        Out of the body at each point, where the file holds it.
    exact : bool
        Whether ``outward`` are the normals of the surface, and not only its side, as a direction
        of approach is.
    """

    name: str
    points: np.ndarray
    normal: np.ndarray | None
    outward: np.ndarray | None = None
    exact: bool = False


@dataclass(frozen=True)
class ReadOptions:
    """What a user says about a file that it does not say itself.

    Parameters
    ----------
    columns : str
        As ``x=3,y=4,z=5,curve=1``: numbers of columns, from 1, or their names.
    unit : str
        Of the lengths; where it is empty the file's own is taken.
    tip_radius : float, length
        Of the ball whose centres the points are; 0 where they are contacts. Points with normals of
        the surface are moved inward by it as they are read.
    gap : float
        A curve ends where the next point is as many steps away, in space or in time, of those
        that three in four are shorter than; where nothing else parts curves.
    """

    columns: str = ""
    unit: str = ""
    tip_radius: float = 0.0
    gap: float = 6.0

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            raise ValueError(f"there is no unit {self.unit!r}; give mm, m, in, cm or um")
        if not 0.0 <= self.tip_radius < np.inf:
            raise ValueError(f"tip_radius is {self.tip_radius}; give a length >= 0")
        if not self.gap > 1.0:
            raise ValueError(f"gap is {self.gap}; give a number of steps above 1")


class Curves(NamedTuple):
    """Curves of a file in order of appearance, whether points were repeated, how it was read, in
    phrases, what is probably wrong with it, in sentences, and the unit of its lengths."""

    curves: list[Curve]
    repeated: bool
    assumed: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    unit: str = ""

    @property
    def how(self) -> str:
        """How the file was read, in one line."""
        return "; ".join(self.assumed)


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
    if not path.is_file():
        raise ValueError(
            f"{path} is no file; give a file with a line for each point: curve, x, y, z"
        )
    if other := read_other(path):
        groups, unit = other
        return _checked(path, groups, unit, options, [f"read by its ending {path.suffix}"], [])
    return _read_text(path, options)


def _read_text(path: Path, options: ReadOptions) -> Curves:
    """Curves of a text file of points."""
    if sections := cross_sections(path):
        how = "read as cross-sections: planes, vertices and edges"
        return _checked(path, sections, "", options, [how], [])
    table = read_table(path)
    words = [text for _, text in table.words]
    columns = _columns(path, table, options)
    points = np.stack([table.numbers(i) for i in columns.xyz], axis=1)
    kept, left_out = _usable(path, table, columns, points)
    _check_size(path, points[kept])
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
    return _checked(path, groups, unit, options, table.assumed, table.warnings)


def _columns(path: Path, table: Table, options: ReadOptions) -> Columns:
    """Which column is what: as the user says, by names, or by what the columns hold."""
    names = table.above[0] if table.above else []
    if options.columns:
        columns = said_columns(options.columns, table, names)
        columns.unit = options.unit
        return columns
    return columns_by_name(path, table) or columns_by_content(path, table)


def _usable(path: Path, table: Table, columns: Columns, points) -> tuple[np.ndarray, list[str]]:
    """(n,) rows that are points, and in words how many are none.

    Cells that are empty or NaN hold no point; other words where a number should be are mistakes.
    """
    lost = ~np.isfinite(points).all(axis=1)
    # Nines in all three cells are a common mark of no point.
    nines = (points == points[:, :1]).all(axis=1) & np.isin(np.abs(points[:, 0]), _NINES)
    lost |= nines
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


def _checked(path: Path, groups, unit: str, options: ReadOptions, assumed, warnings) -> Curves:
    """Curves of groups of points; refused, with how they were read, where they are none."""
    unit = UNITS[options.unit] if options.unit else unit
    groups = [(name, points, _unit_vectors(vectors)) for name, points, vectors in groups]
    kind = what_vectors_are(groups)
    if options.tip_radius and kind == "normals" and _all_known(groups):
        off = options.tip_radius
        groups = [(name, points - off * vectors, vectors) for name, points, vectors in groups]
        assumed = [*assumed, f"a tip of radius {off:g} was taken off along the normals"]
    everything = np.concatenate([np.zeros((0, 3)), *(points for _, points, _ in groups)])
    count = len({name for name, *_ in groups} - {""})
    many = f"{count} curve{'s' * (count != 1)}" if count else "no curve"
    assumed = [*assumed, f"{len(everything)} points of {many}, in {unit or 'a unit not named'}"]
    how = f"{path.name} was read so: {'; '.join(assumed)}"
    if not len(everything):
        raise ValueError(f"{path} has no points; {how}")
    _check_size(path, everything)
    if len(everything) > 1 and not np.ptp(everything, axis=0).any():
        raise ValueError(f"{path} has one point only, all others repeat it; record curves; {how}")
    curves: list[Curve] = []
    repeated = False
    for name, points, vectors in groups:
        keep = _without_repeats(points, bool(name))
        repeated |= len(keep) < len(points)
        given = bool(np.isfinite(vectors).any())
        plane = next(v for v in vectors if np.isfinite(v).all()) if given else None
        if kind == "planes":
            curves.append(Curve(name, points[keep], plane))
        else:
            outward = vectors[keep] if given else None
            curves.append(Curve(name, points[keep], None, outward, given and kind == "normals"))
    if any(np.isfinite(vectors).any() for *_, vectors in groups):
        assumed.append(f"the vectors are {_KINDS[kind]}")
    curves = _once(curves, warnings)
    return Curves(curves, repeated, tuple(assumed), tuple(warnings), unit)


def _check_size(path: Path, points) -> None:
    """Refuse points (n, 3) whose size double precision can't take powers of."""
    # Half of each, so that no difference overflows.
    span = 2.0 * float(np.ptp(0.5 * points, axis=0).max()) if len(points) else 0.0
    if span and not has_powers(span, np.abs(points).max()):
        raise ValueError(
            f"{path} has points that span {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )


def _all_known(groups) -> bool:
    """Whether each point has its vector."""
    return all(np.isfinite(vectors).all() for *_, vectors in groups)


_KINDS = {
    "planes": "normals of the planes in which the curves lie",
    "normals": "normals of the surface, outward",
    "sides": "directions of approach, outward: they tell the outer side",
}


def _unit_vectors(vectors) -> np.ndarray:
    """(n, 3) vectors of length one, NaN where they are zero or not given."""
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore"):
        return vectors / np.where(length > 0.0, length, np.nan)


def _without_repeats(points, closed: bool) -> np.ndarray:
    """Places of the points of a curve, each once; the last too where it closes a loop."""
    keep = np.sort(np.unique(points, axis=0, return_index=True)[1])
    if closed and len(keep) > LEAST_POINTS and (points[0] == points[-1]).all():
        keep = np.append(keep, len(points) - 1)
    return keep


def _once(curves: list[Curve], warnings: list[str]) -> list[Curve]:
    """Curves without the points that an earlier one holds, where these are most of the points.

    Two curves share the point where they cross. A contour that was written twice shares all.
    """
    everything = np.concatenate([curve.points for curve in curves])
    index = np.unique(everything, axis=0, return_inverse=True)[1].ravel()
    owner = np.full(index.max() + 1, -1)
    kept: list[Curve] = []
    start = 0
    for k, curve in enumerate(curves):
        mine = index[start : start + len(curve.points)]
        start += len(curve.points)
        others = owner[mine][owner[mine] >= 0]
        most = int(np.bincount(others).argmax()) if len(others) else -1
        again = (owner[mine] == most) & (most >= 0)
        owner[mine[owner[mine] < 0]] = k
        if curve.name and most >= 0 and curves[most].name and 2 * again.sum() > len(mine):
            warnings.append(
                f"curve {curve.name!r} repeats {again.sum()} points of curve "
                f"{curves[most].name!r}; they were counted once"
            )
            outward = None if curve.outward is None else curve.outward[~again]
            kept.append(replace(curve, points=curve.points[~again], outward=outward))
        else:
            kept.append(curve)
    return [curve for curve in kept if len(curve.points)]
