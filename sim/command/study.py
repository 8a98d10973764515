"""touchatlas study: the command."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from touchatlas.sim.command.option_flags import Work
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.study.workers import WorkOptions


def study(
    file: Annotated[Path, Parameter(name="STUDY.toml", show_default=False)],
    /,
    *,
    out: Path | None = None,
    work: Work = WorkOptions(),
) -> int:
    """Explore many objects with many options and seeds, on this machine or a cluster, and compare.

    A study that was interrupted goes on where it was, run by run.

    Parameters
    ----------
    file
        A TOML file: objects = [names, mesh files, folders, patterns]; seeds; tables [options], the
        same for all runs, and [vary], lists of values of any flag of touchatlas explore;
        [baseline], what others are compared with; [limits] of a run, in seconds and gigabytes.
    out
        Folder for runs.csv, times.csv, report.html and report.pdf; runs/STUDY by default.
    """
    with shown("reading the study") as watcher:
        from touchatlas.sim.study.study_file import read_study
        from touchatlas.sim.study.sweep import sweep

        read = read_study(file)
        out = Path("runs") / read.name if out is None else out
        watcher.begins("exploring")
        rows, tables = sweep(read, file, out, watcher.count("runs"), work, say)
    console = Console()
    for title, headers, lines in tables:
        table = Table(*headers, title=title, box=SIMPLE, pad_edge=False, collapse_padding=True)
        for line in lines:
            table.add_row(*line)
        console.print(table)
    console.print(f"{len(rows)} runs are in {out}; open {out / 'report.html'}", markup=False)
    return 0
