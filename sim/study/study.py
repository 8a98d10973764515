"""One mechanism for all studies: cells on workers, rows in tables, summaries, pictures."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_lock import locked
from touchatlas.sim.study.cells import DONE, Cell, Ledger, Row
from touchatlas.sim.study.figures import image_bytes
from touchatlas.sim.study.tables import Summed, csv_bytes, table_bytes
from touchatlas.sim.study.workers import WorkOptions, workers

Watch = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Study:
    """What is measured.

    Parameters
    ----------
    name : str
        Of its files.
    columns : tuple of str
        Columns of its tables.
    measure : callable
        ``given`` of a Cell to its rows. It is called in another process. A column that they lack
        is that of the cell's head.
    note : str
        The column for the words of what became of a cell that is not done.
    failed : dict of str
        Other columns of its row.
    timed : tuple of str
        Columns that differ from machine to machine. They stand in times.csv alone, so that the
        table of equal seeds is the same, byte for byte.
    """

    name: str
    columns: tuple[str, ...]
    measure: Callable[..., list[Row]]
    note: str
    failed: Row = field(default_factory=dict)
    timed: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Chart:
    """What is made of the rows of a study.

    Parameters
    ----------
    study : Study
    cells : callable
        (names, draws, seed) to its Cells. ValueError for a name that it does not know.
    summary : callable
        Rows to rows of numbers.
    pictures : callable
        Rows and their summary to a figure for each name of a file.
    table : callable
        Rows and their summary to what a terminal shows.
    draws : int
        Draws of a full study.
    keeps_summary : bool
        Whether ``NAME.csv`` is a table of the summary.
    suffixes : tuple of str
        Kinds of files of each picture.
    words : tuple of two str
        What the study does, and what it counts, for its user.
    """

    study: Study
    cells: Callable[[tuple[str, ...], int, int], list[Cell]]
    summary: Callable[[list[Row]], Summed]
    pictures: Callable[[list[Row], Summed], dict[str, Any]]
    table: Callable[[list[Row], Summed], Any]
    draws: int
    keeps_summary: bool = False
    suffixes: tuple[str, ...] = ("png", "svg")
    words: tuple[str, str] = ("measuring", "cells")


def check_options(draws: int, seed: int) -> None:
    """ValueError where there is nothing to draw."""
    for name, value, least in (("draws", draws, 1), ("seed", seed, 0)):
        if value < least:
            raise ValueError(f"{name} is {value}; it must be >= {least}")


def draw_chart(
    chart: Chart,
    folder: Path,
    names: tuple[str, ...] = (),
    draws: int | None = None,
    seed: int = 0,
    watch: Watch = lambda done, total: None,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
) -> tuple[list[Row], Summed]:
    """Measure what a study has of some names, and write its tables and pictures to a folder.

    Returns the rows and their summary. A chart that was interrupted goes on where it was.
    """
    draws = chart.draws if draws is None else draws
    check_options(draws, seed)
    cells = chart.cells(names, draws, seed)
    make_out_folder(folder)
    with locked(folder):
        rows = run(chart.study, cells, folder, watch, work, say)
        summed = chart.summary(rows)
        for name, figure in chart.pictures(rows, summed).items():
            for suffix in chart.suffixes:
                write_whole(folder / f"{name}.{suffix}", image_bytes(figure, suffix))
        if chart.keeps_summary:
            text = [
                {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in r.items()} for r in summed
            ]
            write_whole(folder / f"{chart.study.name}.csv", csv_bytes(tuple(summed[0]), text))
    return rows, summed


def run(
    study: Study,
    cells: list[Cell],
    folder: Path,
    watch: Watch,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
) -> list[Row]:
    """The rows of the cells, in their order.

    Each answer is kept in the folder's ledger as soon as it comes, and cells that it settles are
    not measured again. However the measuring ends, the tables of the folder then hold the rows
    that are known, in the order of the cells: they do not depend on the order in which answers
    came, nor on who gave them. A cell that is not done has one row, which says why. ``watch`` is
    called with the number of cells done and of all.
    """
    # What a kind of table lacks is said before anything is measured.
    for file in dict.fromkeys(cell.file for cell in cells):
        table_bytes(file, study.columns, [])
    with Ledger(folder) as ledger:
        try:
            measure_cells(ledger, study.measure, cells, watch, work, say)
        finally:
            tables = _rows(study, cells, ledger)
            for file, own in tables.items():
                write_whole(folder / file, table_bytes(file, study.columns, own))
            if study.timed:
                write_whole(folder / "times.csv", _times(study, cells, ledger))
    return [row for own in tables.values() for row in own]


def measure_cells(
    ledger: Ledger,
    measure: Callable[..., list[Row]],
    cells: list[Cell],
    watch: Watch,
    work: WorkOptions,
    say: Callable[[str], None],
) -> None:
    """Measure the cells that the ledger does not settle, and keep each answer when it comes."""
    kept, waiting = ledger.answers, {}
    for cell in cells:
        key = cell.key(measure)
        if not (key in kept and kept[key].settles(work.limits)):
            waiting[key] = cell.given
    done = len(cells) - len(waiting)
    watch(done, len(cells))
    if not waiting:
        return
    try:
        with workers(work, len(waiting), say) as those:
            for key, answer in those.answers(measure, waiting):
                ledger.add(key, answer)
                done += 1
                watch(done, len(cells))
    except KeyboardInterrupt as stop:
        stop.add_note("what was measured is kept, and the same command goes on")
        raise


def _rows(study: Study, cells: list[Cell], ledger: Ledger) -> dict[str, list[Row]]:
    """The rows of the cells by the names of their tables."""
    tables: dict[str, list[Row]] = {}
    columns = (*study.columns, *study.timed)
    for cell in cells:
        own = tables.setdefault(cell.file, [])
        answer = ledger.answers.get(cell.key(study.measure))
        if answer is not None and answer.kind == DONE:
            own += [{n: row.get(n, cell.head.get(n)) or "" for n in columns} for row in answer.rows]
        elif answer is not None:
            blank = {name: "failed" if name == "method" else "" for name in columns}
            own.append(blank | study.failed | cell.head | {study.note: answer.words})
    return tables


def _times(study: Study, cells: list[Cell], ledger: Ledger) -> bytes:
    """What differs from machine to machine: one line a cell."""
    rows = []
    for cell in cells:
        answer = ledger.answers.get(cell.key(study.measure))
        if answer is not None:
            own = answer.rows[0] if answer.rows else {}
            rows.append(
                cell.head
                | {name: own.get(name, "") for name in study.timed}
                | {"gigabytes": f"{answer.gigabytes:.3g}", "became": answer.kind}
                | {"where": answer.where}
            )
    return csv_bytes(tuple(rows[0]) if rows else (), rows)
