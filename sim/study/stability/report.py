"""The sweep of the families as files and a table."""

import csv
import io
from collections.abc import Callable
from pathlib import Path

from rich.box import SIMPLE
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.sim.study.stability.pictures import family_picture, overview_picture
from touchatlas.sim.study.stability.summary import summary
from touchatlas.sim.study.stability.sweep import check_families, sweep
from touchatlas.sim.study.tradeoff_chart import make_folder

# Cases of each severity: eight severities make 200 cases of a family.
DRAWS = 25
_SHARES = ("good", "flagged", "refused", "wrong", "crashed", "good but doubted", "three noises")


def stability_chart(
    folder: Path,
    families: tuple[str, ...] = (),
    draws: int = DRAWS,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict[str, str | float]]:
    """Sweep the families and write their tables and pictures.

    Parameters
    ----------
    folder : Path
        For ``FAMILY-SEED.csv``, ``FAMILY.png`` and ``.svg``, ``stability.csv``, ``.png`` and
        ``.svg``. A sweep that was interrupted goes on where it was.
    families : tuple of str
        All of them when empty.
    draws : int
        Cases of each severity.
    seed : int
    watch : callable
        Called with the number of severities done and of all.

    Returns
    -------
    list of dict
        One row a family and method, see ``summary``.
    """
    names = check_families(families)
    make_folder(folder)
    rows = sweep(folder, names, draws, seed, watch)
    for name in names:
        own = [row for row in rows if row["family"] == name]
        for suffix, data in family_picture(name, own).items():
            write_whole(folder / f"{name}.{suffix}", data)
    summed = summary(rows)
    for suffix, data in overview_picture(summed).items():
        write_whole(folder / f"stability.{suffix}", data)
    write_whole(folder / "stability.csv", _csv(summed))
    return summed


def _csv(summed: list[dict[str, str | float]]) -> bytes:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(summed[0]))
    writer.writeheader()
    for row in summed:
        numbers = {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()}
        writer.writerow(numbers)
    return text.getvalue().encode()


def stability_table(summed: list[dict[str, str | float]]) -> Table:
    """Shares of the outcomes, one row a method, and the families where our default is wrong."""
    table = Table("method", *_SHARES, title="shares of outcomes over all families", box=SIMPLE)
    for row in summed:
        if row["family"] == "all":
            table.add_row(str(row["method"]), *(f"{float(row[name]):.1%}" for name in _SHARES))
    for row in summed:
        if row["method"] == "map" and row["family"] != "all" and float(row["wrong"]) > 0.0:
            shares = (f"{float(row[name]):.1%}" for name in _SHARES)
            table.add_row(f"map: {row['family']}", *shares)
    return table
