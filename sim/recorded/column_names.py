"""Names of columns as people write them, and the units in them."""

import re

from touchatlas.sim.recorded.table_file import Table

COORDINATES, NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
WANTED = "the columns curve, x, y, z (and nx, ny, nz if known)"
_CURVE = [
    "curve",
    "contour",
    "line",
    "scan",
    "section",
    "profile",
    "track",
    "trace",
    "path",
    "polyline",
    "segment",
    "group",
    "kurve",
    "bahn",
    "kontur",
    "linie",
    "spur",
    "profil",
    "id",
    "name",
]
_UNITS = ("nm", "um", "µm", "μm", "mm", "cm", "dm", "m", "inch", "in", "ft", "mil", "micron")
_IN_BRACKETS = re.compile(r"[\[({<]\s*([^\])}>]*?)\s*[\])}>]")
_TAIL = re.compile(rf"[\s_/.-]({'|'.join(_UNITS)})$", re.IGNORECASE)


def name_columns(path, table: Table) -> dict[str, int]:
    """The places of the columns curve, x, y, z, and nx, ny, nz where they are known.

    ``curve`` is left out where empty lines separate the curves. What was assumed is added to the
    table.

    Raises
    ------
    ValueError
        In one sentence: a column is missing or there twice, or units differ.
    """
    if table.header is None:
        return _by_count(path, table)
    parts = [_without_unit(name) for name in table.header]
    counted = [_counts_lines(table, i) and name != "curve" for i, (name, _) in enumerate(parts)]
    names = [name for name, _ in parts]
    places = {}
    for wanted in ("curve", *COORDINATES, *NORMAL):
        for known in _spellings(wanted):
            found = [i for i, name in enumerate(names) if name == known]
            if wanted == "curve":
                found = [i for i in found if not counted[i]]
            if len(found) > 1:
                raise ValueError(f"{path} has the column {wanted} twice; rename one of them")
            if found:
                places[wanted] = found[0]
                break
    _check(path, table, names, places)
    renamed = [f"{table.header[i]} as {name}" for name, i in places.items() if names[i] != name]
    if renamed:
        table.assumed.append(f"columns were read: {', '.join(renamed)}")
    if unused := [name for i, name in enumerate(table.header) if i not in places.values() and name]:
        hint = "" if "curve" in places else "; call the one that names the curves `curve`"
        table.assumed.append(f"columns were ignored: {', '.join(unused)}{hint}")
    _note_unit(path, table, _units(table, parts, places))
    if "curve" in places:
        _compare_with_blocks(table, places["curve"])
    return places


def _counts_lines(table: Table, place: int) -> bool:
    """Whether a column differs from line to line, as a number of points does and no curve."""
    return 2 * _few(table, place) > len(table.rows) > 1


def _compare_with_blocks(table: Table, place: int) -> None:
    """Warn of empty lines that part the file otherwise than the names of the curves do."""
    pairs = {(block, cells[place]) for _, block, cells in table.rows if place < len(cells)}
    blocks, names = {block for block, _ in pairs}, {name for _, name in pairs}
    if len(blocks) > 1 and not len(pairs) == len(blocks) == len(names):
        table.warnings.append(
            f"empty lines make {len(blocks)} blocks, but the names {len(names)} curves, and not "
            "the same; the names were taken"
        )


def _spellings(wanted: str) -> list[str]:
    """How a column may be called, the best name first."""
    if wanted == "curve":
        return [f"{name}{tail}" for tail in ("", "id", "no", "nr", "number") for name in _CURVE]
    axis = wanted[-1]
    shapes: tuple[str, ...]
    if wanted in NORMAL:
        shapes = ("n{}", "normal{}", "{}normal", "planenormal{}", "planen{}", "plane{}")
    else:
        shapes = ("{}", "p{}", "pos{}", "{}pos", "position{}", "point{}", "coord{}", "{}coord")
        shapes += ("{}coordinate", "coordinate{}", "{}position", "contact{}", "{}koordinate")
    return [shape.format(axis) for shape in shapes]


def _without_unit(name: str) -> tuple[str, str]:
    """A name in small letters and digits, and the unit written with it."""
    unit = ""
    if match := _IN_BRACKETS.search(name):
        unit, name = match[1], name[: match.start()] + name[match.end() :]
    elif match := _TAIL.search(name):
        unit, name = match[1], name[: match.start()]
    return re.sub(r"[^a-z0-9]", "", name.lower()), unit.lower()


def _check(path, table: Table, names, places) -> None:
    blocks = len({block for _, block, _ in table.rows})
    missing = [name for name in ("curve", *COORDINATES) if name not in places]
    if missing == ["curve"] and blocks > 1:
        table.assumed.append("empty lines separate the curves")
        missing = []
    if missing:
        raise ValueError(
            f"{path} has no column {', '.join(missing)} among {', '.join(table.header or [])}; "
            f"give a CSV file with {WANTED} in its first line{_also_called(missing)}"
        )
    known = [name for name in NORMAL if name in places]
    if known and len(known) < 3:
        raise ValueError(f"{path} has {', '.join(known)} only; give all of nx, ny, nz or none")


def _units(table: Table, parts, places) -> set[str]:
    """Units of x, y, z: with their names, or in a line of units below them, which is taken off."""
    written = {parts[places[name]][1] for name in COORDINATES}
    cells = table.rows[0][2]
    below = [cells[places[name]] if places[name] < len(cells) else "" for name in COORDINATES]
    units = {cell.strip("[](){} ").lower() for cell in below}
    if written != {""} or len(table.rows) == 1 or not units.issubset(_UNITS):
        return written
    table.rows.pop(0)
    return units


def _also_called(missing: list[str]) -> str:
    """Which other names of the curve are understood, where that is what is missing."""
    return f"; curve may also be {', '.join(_CURVE[1:])}" if missing == ["curve"] else ""


def _note_unit(path, table: Table, units: set[str]) -> None:
    if len(units) > 1:
        raise ValueError(
            f"{path} has x, y, z in different units "
            f"({', '.join(unit or 'none' for unit in sorted(units))}); write all in one"
        )
    table.unit = units.pop()
    if table.unit:
        table.assumed.append(f"lengths are in {table.unit}, as the file says")


def _by_count(path, table: Table) -> dict[str, int]:
    """The columns of a file without names, by their number."""
    count = max((len(cells) for _, _, cells in table.rows), default=0)
    blocks = len({block for _, block, _ in table.rows})
    if count in (3, 6) and blocks > 1:
        order = [*COORDINATES, *NORMAL][:count]
        table.assumed.append("empty lines separate the curves")
    elif count in (4, 7):
        order = ["curve", *COORDINATES, *NORMAL][:count]
        if count == 4 and _few(table, 3) < _few(table, 0):
            order = [*COORDINATES, "curve"]
    else:
        raise ValueError(
            f"{path} names no columns in its first line, and it has {count}; give a CSV file with "
            f"{WANTED}"
        )
    table.assumed.append(f"columns without names were read as {', '.join(order)}")
    return {name: i for i, name in enumerate(order)}


def _few(table: Table, place: int) -> int:
    """How many different cells a column has."""
    return len({cells[place] for _, _, cells in table.rows if place < len(cells)})
