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
from touchatlas.sim.study.stability.sweep import ONE_PATCH, Study, sweep
from touchatlas.sim.study.stability_atlas.measure import MANY_PATCHES
from touchatlas.sim.study.tradeoff_chart import make_folder

STUDIES = (ONE_PATCH, MANY_PATCHES)
_SHARES = ("good", "flagged", "refused", "wrong", "crashed", "good but doubted", "three noises")


def studies_of(names: tuple[str, ...]) -> list[tuple[Study, tuple[str, ...]]]:
    """The studies that have families of these names, each with its own ones; for no name all
    families of one patch. ValueError for a name that is none."""
    known = {name: study for study in STUDIES for name in study.families}
    for name in names:
        if name not in known:
            raise ValueError(f"there is no family {name!r}; choose from {', '.join(known)}")
    chosen = names or tuple(ONE_PATCH.families)
    found = [(s, tuple(name for name in chosen if name in s.families)) for s in STUDIES]
    return [(study, own) for study, own in found if own]


def stability_chart(
    folder: Path,
    families: tuple[str, ...] = (),
    draws: int | None = None,
    seed: int = 0,
    watch: Callable[[int, int], None] = lambda done, total: None,
) -> list[dict[str, str | float]]:
    """Sweep the families and write their tables and pictures.

    Parameters
    ----------
    folder : Path
        For ``FAMILY-SEED.csv``, ``FAMILY.png`` and ``.svg``, and ``stability.csv``, ``.png`` and
        ``.svg``, or ``stability_atlas`` for families of many patches. A sweep that was interrupted
        goes on where it was.
    families : tuple of str
        All of one patch when empty.
    draws : int, optional
        Cases of each severity: 25 of one patch, and 2 of many, if not given.
    seed : int
    watch : callable
        Called with the number of severities done and of all of a study.

    Returns
    -------
    list of dict
        One row a family and method, see ``summary``.
    """
    chosen = studies_of(families)
    make_folder(folder)
    every = []
    for study, names in chosen:
        rows = sweep(study, folder, names, draws, seed, watch)
        for name in names:
            own = [row for row in rows if row["family"] == name]
            for suffix, data in family_picture(study, name, own).items():
                write_whole(folder / f"{name}.{suffix}", data)
        summed = summary(rows)
        for suffix, data in overview_picture(study, summed).items():
            write_whole(folder / f"{study.name}.{suffix}", data)
        write_whole(folder / f"{study.name}.csv", _csv(summed))
        every += summed
    return every


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
        if (
            row["method"] in ("map", "atlas")
            and row["family"] != "all"
            and float(row["wrong"]) > 0.0
        ):
            shares = (f"{float(row[name]):.1%}" for name in _SHARES)
            table.add_row(f"{row['method']}: {row['family']}", *shares)
    return table
