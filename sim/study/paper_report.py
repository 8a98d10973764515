"""The paper's tables as files and on the terminal: paper.json, table1.csv, figures."""

import json
from collections.abc import Callable

from rich.box import SIMPLE
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.patch.words import count_of
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_lock import locked
from touchatlas.sim.study.paper import paper_tables
from touchatlas.sim.study.paper_figures import figures
from touchatlas.sim.study.study import Watch, check_options
from touchatlas.sim.study.tables import csv_bytes
from touchatlas.sim.study.workers import WorkOptions

_ERRORS = {"data": "data curves", "verifying": "nine others", "inside": "within D"}
_MEASURES = ("k1", "k2", *_ERRORS)
_QUARTILES = ("median", "lower", "upper")


def repeat_paper(
    out,
    draws: int,
    seed: int,
    watch: Watch,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
) -> dict:
    """Measure and draw everything, and write it to a folder, which is made where it is missing.

    Returns the numbers of ``paper_tables``. ValueError for a file in place of the folder, no draw,
    or a negative seed.
    """
    check_options(draws, seed)
    folder = make_out_folder(out)
    with locked(folder):
        numbers = paper_tables(folder, draws, seed, watch, work, say)
        table1 = table1_csv(numbers["table1"])
        files = {"paper.json": json_text(numbers).encode(), "table1.csv": table1}
        for name, data in (files | figures(numbers, seed)).items():
            write_whole(folder / name, data)
    return numbers


def json_text(numbers: dict) -> str:
    """Strict JSON, which cannot express infinity."""
    return json.dumps(numbers, indent=2, allow_nan=False) + "\n"


def table1_csv(table: dict) -> bytes:
    """Table 1 with one row a fit; blank where the paper has no figure."""
    columns = [f"{name}_{part}" for name in _MEASURES for part in (*_QUARTILES, "paper")]
    rows = []
    for row in table["rows"]:
        cells = {f"{name}_{part}": row[name][part] for name in _MEASURES for part in _QUARTILES}
        paper = {f"{name}_paper": value for name, value in row["paper"].items()}
        rows.append({"fit": row["fit"], "curves": row["curves"]} | cells | paper)
    return csv_bytes(("fit", "curves", *columns), rows)


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
    table = _table(title, "fit", "k1, k2", *_ERRORS.values(), narrow=True)
    table.caption = (
        f"Medians over {count_of(numbers['draws'], 'draw')} of noise {numbers['noise_std']:g} mm; "
        "below them standard deviations of k1, k2 and quartiles of the mean errors |z(x, y) - z|, "
        f"mm. D is the hull of the data curves. Exact: {exact['k1']:.4f}, {exact['k2']:.4f}."
    )
    for row in found["rows"]:
        label = row["fit"] if row["curves"] == "three" else f"{row['fit']}, other three"
        middles, stds = (
            ", ".join(_number(row[name][part]) for name in ("k1", "k2"))
            for part in ("median", "std")
        )
        errors = (_shown(row[name], 3, "\n", "") for name in _ERRORS)
        table.add_row(label, f"{middles}\n±{stds}", *errors)
        if paper := row["paper"]:
            theirs = [f"{paper['k1']:.4f}, {paper['k2']:.4f}"]
            theirs += [f"{paper[name]:.4f}" for name in _ERRORS if name in paper]
            table.add_row("  the paper", *theirs, style="bold", end_section=True)
    return table


def _reaches(rows: list[dict]) -> Table:
    title = "The neck by the length of the arms, errors in mm"
    table = _table(title, "arm, mm", "fit", *_ERRORS.values(), narrow=True)
    for row in rows:
        data, *others = (row[name] for name in _ERRORS)
        cells = (_shown(known, 3) for known in others)
        table.add_row(f"{row['arm_length']:g}", row["fit"], _number(data["median"]), *cells)
    return table


def _gauss_map(found: dict) -> Table:
    parts = {"algebraic": "algebraic area", "absolute": "absolute area"}
    table = _table("Figure 4: Gauss map of the neck's patch, steradian", "", *parts.values())
    for fit, areas in found.items():
        table.add_row(fit, *(_shown(areas[part]) for part in parts))
    return table


def _ellipsoid(rows: list[dict]) -> list[Table]:
    """One table a noise."""
    tables: dict[str, Table] = {}
    for row in rows:
        title = f"Figure 6: ellipsoid 8/5/3, noise {row['noise_std']:g}: mean and deviation"
        headers = [h for k in ("k1", "k2") for h in (f"exact {k}", "sections", "fit_patch")]
        table = tables.setdefault(title, _table(title, "x", *headers, narrow=True))
        cells = []
        for name in ("k1", "k2"):
            cells.append(f"{row['exact'][name]:.3f}")
            for known in (row[way][name] for way in ("sections", "fit_patch")):
                cells.append(f"{_number(known['mean'], 3)}±{_number(known['std'], 3)}")
        table.add_row(f"{row['point'][0]:.2f}", *cells)
    return list(tables.values())


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


def _table(title: str, first: str, *others: str, narrow: bool = False) -> Table:
    """An empty table; a narrow one fits a terminal of 80 columns."""
    table = Table(title=title, box=SIMPLE, padding=(0, 0) if narrow else (0, 1))
    table.add_column(first)
    for header in others:
        table.add_column(header, justify="right")
    return table


def _shown(known: dict, places: int = 4, opening: str = " (", closing: str = ")") -> str:
    """A median with its quartiles."""
    lower, upper = (_number(known[part], places) for part in _QUARTILES[1:])
    return f"{_number(known['median'])}{opening}{lower} to {upper}{closing}"


def _number(value: float | None, places: int = 4) -> str:
    return "?" if value is None else f"{value:.{places}f}"
