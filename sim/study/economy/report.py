"""The study of touches against error as files and a table."""

from collections.abc import Callable
from pathlib import Path

from rich.box import SIMPLE
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.sim.study.economy.pictures import object_picture, overview_picture
from touchatlas.sim.study.economy.summary import COSTS, gap_closed, summary
from touchatlas.sim.study.economy.sweep import OBJECTS, Row, sweep
from touchatlas.sim.study.tradeoff_chart import known, make_folder


def atlas_chart(
    folder: Path,
    objects: tuple[str, ...] = (),
    draws: int = 1,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[Row]:
    """Explore the objects by every method to every tolerance, and write the table and pictures.

    Parameters
    ----------
    folder : Path
        For ``atlas.csv``, ``OBJECT.png`` and ``.svg``, and ``atlas.png`` and ``.svg``. A sweep
        that was interrupted goes on where it was.
    objects : tuple of str
        Two small ones when empty.
    draws : int
        Seeds of each, from ``seed`` on.
    seed : int
    watch : callable
        Called with the number of runs done and of all.

    Returns
    -------
    list of dict
        One row a run, see ``sweep``.
    """
    make_folder(folder)
    rows = sweep(folder / "atlas.csv", objects or OBJECTS, draws, seed, watch=watch)
    draw(folder, rows)
    return rows


def draw(folder: Path, rows: list[Row]) -> None:
    """Write a picture of each object, and one of all."""
    for name in dict.fromkeys(row["object"] for row in rows):
        own = [row for row in rows if row["object"] == name]
        for suffix, data in object_picture(Path(name).stem, own).items():
            write_whole(folder / f"{Path(name).stem}.{suffix}", data)
    for suffix, data in overview_picture(rows).items():
        write_whole(folder / f"atlas.{suffix}", data)


def atlas_table(rows: list[Row]) -> Table:
    """One row a method: runs, those that met, and what ours took over what it took."""
    gaps = {name: gap_closed(rows, cost) for name, cost in COSTS.items()}
    table = Table(
        title="cost of ours over that of the method, median of the runs that both met",
        caption="length: tracked plus travel; *: until 99 % of the truth is within the tolerance, "
        "whether the planner knows it or not; gap closed: 0 as random, 1 as oracle",
        box=SIMPLE,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("method", no_wrap=True)
    for header in ("met", *COSTS):
        table.add_column(header.replace(" to 99 %", "*"), justify="right", no_wrap=True)
    for row in summary(rows):
        shown = (f"{row[name]:.2f}" if known(row[name]) else "" for name in COSTS)
        table.add_row(row["method"], f"{row['met']}/{row['runs']}", *shown)
    closed = (f"{gap:.2f}" if known(gap) else "" for gap in gaps.values())
    table.add_row("gap closed", "", *closed)
    return table
