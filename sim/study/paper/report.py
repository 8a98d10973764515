"""The paper's tables as files and on the terminal: paper.json, table1.csv, figures."""

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path

from rich.box import SIMPLE
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.study.paper.figures import figures
from touchatlas.sim.study.paper.tables import paper_tables
from touchatlas.sim.study.study import check_options

_ERRORS = {"data": "data curves", "verifying": "nine others", "inside": "within D"}
_MEASURES = ("k1", "k2", *_ERRORS)
_QUARTILES = ("median", "lower", "upper")
# Between the columns of wide tables, so that a terminal of 80 columns holds them.
_NARROW = (0, 0)
_PARTS = {"algebraic": "algebraic area", "absolute": "absolute area"}


def repeat_paper(out, draws: int, seed: int, watch: Callable[[int, int], None]) -> dict:
    """Measure and draw everything, and write it to a folder.

    Parameters
    ----------
    out : path-like
        Made where it is missing; gets paper.json, table1.csv and the figures.
    draws, seed : int
    watch : callable
        Called with the number of tables done and of all.

    Returns
    -------
    dict
        See ``paper_tables``.

    Raises
    ------
    ValueError
        A file in place of the folder, no draw, a negative seed.
    """
    check_options(draws, seed)
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder} is a file; give a folder for tables and figures with --out")
    make_out_folder(folder)
    numbers = paper_tables(draws, seed, watch)
    files = {
        "paper.json": json_text(numbers).encode(),
        "table1.csv": csv_bytes(numbers["table1"]),
        **figures(numbers, seed),
    }
    for name, data in files.items():
        write_whole(folder / name, data)
    return numbers


def json_text(numbers: dict) -> str:
    """Strict JSON, which cannot express infinity."""
    return json.dumps(numbers, indent=2, allow_nan=False) + "\n"


def csv_bytes(table: dict) -> bytes:
    """Table 1 with one row a fit; blank where the paper has no figure."""
    columns = ["fit", "curves"]
    for name in _MEASURES:
        columns += [f"{name}_{part}" for part in (*_QUARTILES, "paper")]
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=columns)
    writer.writeheader()
    for row in table["rows"]:
        cells = {f"{name}_{part}": row[name][part] for name in _MEASURES for part in _QUARTILES}
        paper = {f"{name}_paper": value for name, value in row["paper"].items()}
        writer.writerow({"fit": row["fit"], "curves": row["curves"]} | cells | paper)
    return text.getvalue().encode()


def terminal_tables(numbers: dict) -> list[Table]:
    """All tables, the paper's figures beside ours."""
    return [
        _table1(numbers),
        _reaches(numbers["reaches"]),
        _gauss_map(numbers["gauss_map"]),
        *_ellipsoid(numbers["ellipsoid"]),
        _sphere(numbers["sphere"]),
    ]


def _table1(numbers: dict) -> Table:
    found, exact = numbers["table1"], numbers["table1"]["exact"]
    title = f"Table 1: a bottle's neck, arms of {found['arm_length']:.3g} mm"
    table = _table(title, "fit", "k1, k2", *_ERRORS.values())
    table.padding = _NARROW
    table.caption = (
        f"Medians over {numbers['draws']} draws of noise {numbers['noise_std']:g} mm; below them "
        "standard deviations of k1, k2 and quartiles of the mean errors |z(x, y) - z|, mm. D is "
        f"the hull of the data curves. Exact: {exact['k1']:.4f}, {exact['k2']:.4f}."
    )
    for row in found["rows"]:
        table.add_row(_label(row), _pair(row), *(_stacked(row[name]) for name in _ERRORS))
        if row["paper"]:
            paper = row["paper"]
            figures = [f"{paper['k1']:.4f}, {paper['k2']:.4f}"]
            figures += [f"{paper[name]:.4f}" for name in _ERRORS if name in paper]
            table.add_row("  the paper", *figures, style="bold", end_section=True)
    return table


def _label(row: dict) -> str:
    return row["fit"] if row["curves"] == "three" else f"{row['fit']}, other three"


def _pair(row: dict) -> str:
    """k1 and k2, and below them their deviations."""
    middles = ", ".join(_number(row[name]["median"]) for name in ("k1", "k2"))
    return middles + "\n±" + ", ".join(_number(row[name]["std"]) for name in ("k1", "k2"))


def _reaches(rows: list[dict]) -> Table:
    title = "The neck by the length of the arms, errors in mm"
    table = _table(title, "arm, mm", "fit", *_ERRORS.values())
    table.padding = _NARROW
    for row in rows:
        data, *others = (row[name] for name in _ERRORS)
        cells = (_shown(known, 3) for known in others)
        table.add_row(f"{row['arm_length']:g}", row["fit"], _number(data["median"]), *cells)
    return table


def _gauss_map(found: dict) -> Table:
    table = _table("Figure 4: Gauss map of the neck's patch, steradian", "", *_PARTS.values())
    for fit, areas in found.items():
        table.add_row(fit, *(_shown(areas[part]) for part in _PARTS))
    return table


def _ellipsoid(rows: list[dict]) -> list[Table]:
    """One table a noise."""
    tables = []
    for noise in dict.fromkeys(row["noise_std"] for row in rows):
        title = f"Figure 6: ellipsoid 8/5/3, noise {noise:g}: mean and deviation"
        headers = ["exact k1", "sections", "fit_patch", "exact k2", "sections", "fit_patch"]
        table = _table(title, "x", *headers)
        table.padding = _NARROW
        for row in rows:
            if row["noise_std"] == noise:
                table.add_row(f"{row['point'][0]:.2f}", *_against_exact(row, "k1", "k2"))
        tables.append(table)
    return tables


def _against_exact(row: dict, *names: str) -> list[str]:
    cells = []
    for name in names:
        cells.append(f"{row['exact'][name]:.3f}")
        for way in ("sections", "fit_patch"):
            known = row[way][name]
            cells.append(f"{_number(known['mean'], 3)}±{_number(known['std'], 3)}")
    return cells


def _sphere(found: dict) -> Table:
    table = _table(f"The sphere, exact {found['exact']:.4f}", "", "the paper", "ours")
    paper = found["paper"]
    pairs = zip(paper["normal_curvatures"], found["normal_curvatures"], strict=True)
    for number, (theirs, ours) in enumerate(pairs, start=1):
        table.add_row(f"normal curvature {number}", f"{theirs:.4f}", _shown(ours))
    for name in ("k1", "k2"):
        table.add_row(f"{name} of the sections", f"{paper[name]:.4f}", _shown(found[name]))
    for fit, measures in found["patches"].items():
        table.add_row(f"{fit}: error, mm", "", _shown(measures["verifying"]))
    return table


def _table(title: str, first: str, *others: str) -> Table:
    table = Table(title=title, box=SIMPLE)
    table.add_column(first)
    for header in others:
        table.add_column(header, justify="right")
    return table


def _shown(known: dict, places: int = 4) -> str:
    """A median with its quartiles."""
    lower, upper = (_number(known[part], places) for part in _QUARTILES[1:])
    return f"{_number(known['median'])} ({lower} to {upper})"


def _stacked(known: dict) -> str:
    """A median above its quartiles."""
    return _shown(known, 3).replace(" (", "\n", 1).removesuffix(")")


def _number(value: float | None, places: int = 4) -> str:
    return "?" if value is None else f"{value:.{places}f}"
