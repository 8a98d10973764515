"""touchatlas study: the command."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from touchatlas.patch.words import count_of
from touchatlas.sim.command.outcome import ExitCode, complain, say
from touchatlas.sim.command.show import shown
from touchatlas.sim.command.work_flags import Work
from touchatlas.sim.study.workers import WorkOptions


def study(
    file: Annotated[Path, Parameter(name="STUDY.toml", show_default=False)],
    /,
    *,
    out: Path | None = None,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    work: Work = WorkOptions(),
) -> int:
    """Explore many objects with many options and seeds, on this machine or a cluster, and compare.

    A study that was interrupted goes on where it was, run by run, and so does one that has more
    objects, values or seeds than before.

    Parameters
    ----------
    file
        A TOML file: objects = [names, mesh files, folders, patterns]; seeds; tables [options], the
        same for all runs, and [vary], lists of values of any flag of touchatlas explore;
        [baseline], what others are compared with; [limits] of a run, in seconds and gigabytes.
    out
        Folder for runs.csv, times.csv, report.html and report.pdf; runs/STUDY by default.
    force
        Replace another study that the folder holds; runs that both have are kept.
    """
    with shown("reading the study") as watcher:
        from touchatlas.sim.study.study_file import read_study
        from touchatlas.sim.study.sweep import sweep

        read = read_study(file)
        out = Path("runs") / read.name if out is None else out
        watcher.begins("exploring")
        rows, tables = sweep(read, file, out, watcher.count("runs"), work, say, force)
    console = Console()
    for title, headers, lines in tables:
        table = Table(*headers, title=title, box=SIMPLE, pad_edge=False, collapse_padding=True)
        for line in lines:
            table.add_row(*line)
        console.print(table)
    count = count_of(len(rows), "run is", "runs are")
    console.print(f"{count} in {out}; open {out / 'report.html'}", markup=False)
    if any(row["touches"] for row in rows):
        return 0
    words = f"no run has a result; the column ended of {out}/runs.{read.table} says why"
    return complain(words, ExitCode.FAILURE)
