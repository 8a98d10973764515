"""A file of recorded contours: CSV to curves, every line checked."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Fewest points of a curve that can be fitted: a section has up to five coefficients. With twice as
# many, sparse recordings would be refused.
LEAST_POINTS = 5
_COLUMNS, _NORMAL = ("curve", "x", "y", "z"), ("nx", "ny", "nz")
_WANTED = "the columns curve, x, y, z (and nx, ny, nz if known) in its first line, comma-separated"
# Cosine of the largest angle, 2 degrees, between the normals that the lines of one curve give.
# Twice the angle would accept files that mix two planes.
_SAME_PLANE = np.cos(np.deg2rad(2.0))
# Bounds of the coordinates, in any unit: beyond them their sixth powers leave double precision.
_SMALLEST, _LARGEST = 1e-50, 1e50


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve of a file: points (n, 3) in order of travel, its plane's unit normal if known."""

    name: str
    points: np.ndarray
    normal: np.ndarray | None


def read_curves(path) -> tuple[list[Curve], bool]:
    """Curves of a CSV file in order of appearance, and whether points were repeated.

    A curve without a name holds scattered contacts. Of points that one curve repeats exactly
    the first is kept, but for the end of a closed loop.

    Raises
    ------
    ValueError
        In one sentence, with the line where there is one: missing, empty or undecodable file,
        missing columns, cells that are no finite numbers, several planes for one curve.
    """
    rows: dict[str, list[list[float]]] = {}
    for name, values in _read_rows(Path(path)):
        rows.setdefault(name, []).append(values)
    curves, repeated = [], False
    for name, listed in rows.items():
        table = np.array(listed)
        points = _without_repeats(table[:, :3])
        repeated |= len(points) < len(table)
        curves.append(Curve(name, points, _plane_normal(path, name, table[:, 3:])))
    everything = np.concatenate([curve.points for curve in curves])
    span = np.ptp(everything, axis=0).max()
    if span == 0.0:
        raise ValueError(f"{path} has one point only, all others repeat it; record curves")
    if not (span > _SMALLEST and np.abs(everything).max() < _LARGEST):
        raise ValueError(
            f"{path} has points that span {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )
    return curves, repeated


def _without_repeats(points) -> np.ndarray:
    """The points of a curve, each once; the last point is kept where it closes a loop."""
    keep = np.sort(np.unique(points, axis=0, return_index=True)[1])
    if len(keep) > LEAST_POINTS and (points[0] == points[-1]).all():
        keep = np.append(keep, len(points) - 1)
    return points[keep]


def _read_rows(path: Path) -> list[tuple[str, list[float]]]:
    if not path.is_file():
        raise ValueError(f"{path} is no file; give a CSV file with {_WANTED}")
    try:
        text = path.read_text("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not UTF-8 text; save it again as CSV in UTF-8") from None
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        lines = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise ValueError(f"{path}, line {reader.line_num}: {error}; correct the quoting") from None
    if len(lines) < 2:
        what = "has no points below its header" if lines else "is empty"
        raise ValueError(
            f"{path} {what}; give a CSV file with {_WANTED}, and a line for each point"
        )
    header = [name.strip().lower() for name in lines[0][1]]
    places = _column_places(path, header)
    return [_parse(f"{path}, line {n}", row, header, places) for n, row in lines[1:]]


def _column_places(path, header: list[str]) -> dict[str, int]:
    missing = [name for name in _COLUMNS if name not in header]
    if missing:
        raise ValueError(
            f"{path} has no column {', '.join(missing)} among {', '.join(header)}; give a CSV "
            f"file with {_WANTED}"
        )
    known = [name for name in _NORMAL if name in header]
    if known and len(known) < 3:
        raise ValueError(f"{path} has {', '.join(known)} only; give all of nx, ny, nz or none")
    for name in (*_COLUMNS, *known):
        if header.count(name) > 1:
            raise ValueError(f"{path} has the column {name} twice; rename one of them")
    return {name: header.index(name) for name in (*_COLUMNS, *known)}


def _parse(where: str, row: list[str], header: list[str], places) -> tuple[str, list[float]]:
    """Name of the curve and x, y, z, nx, ny, nz of one line; NaN for a normal not given."""
    if len(row) != len(header):
        raise ValueError(
            f"{where} has {len(row)} cells, but the header {len(header)}; write decimals with a "
            "point and separate cells by commas"
        )
    cells = {name: row[place].strip() for name, place in places.items()}
    bare = not any(cells.get(name) for name in _NORMAL)
    values = [_number(where, name, cells[name]) for name in ("x", "y", "z")]
    values += [np.nan if bare else _number(where, name, cells[name]) for name in _NORMAL]
    return cells["curve"], values


def _number(where: str, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{where}: {name} is {cell!r}; a finite number is needed")
    return value


def _plane_normal(path, name: str, given) -> np.ndarray | None:
    """Unit normal of a curve's sampling plane from its rows (n, 3), None where not given."""
    given = given[np.isfinite(given[:, 0])]
    if not len(given):
        return None
    length = np.sqrt((given**2).sum(axis=1, keepdims=True))
    unit = given / np.where(length > 0.0, length, 1.0)
    if not (np.abs(unit @ unit[0]) > _SAME_PLANE).all():
        raise ValueError(
            f"{path}: nx, ny, nz of curve {name!r} are zero or differ from line to line; give one "
            "plane a curve, or leave them out"
        )
    return unit[0]
