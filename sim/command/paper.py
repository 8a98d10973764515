"""touchatlas paper: the command."""

from pathlib import Path

from rich.console import Console

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.command.work_flags import Work
from touchatlas.sim.study.paper_report import json_text, repeat_paper, terminal_tables
from touchatlas.sim.study.workers import WorkOptions


def paper(
    *,
    out: Path = Path("runs/paper"),
    draws: Whole = 50,
    seed: Whole = 0,
    work: Work = WorkOptions(),
    json_: Json = False,
) -> int:
    """Repeat the paper's tables and figures on simulated objects, its numbers beside ours.

    Parameters
    ----------
    out
        Folder for paper.json, table1.csv and figures 4, 5, 6 and 8.
    draws
        Number of draws of the noise for every number.
    seed
        Seed of the noise.
    """
    with shown("repeating the paper") as watcher:
        numbers = repeat_paper(out, draws, seed, watcher.count("tables"), work, say)
    if json_:
        print(json_text(numbers), end="")
    else:
        Console().print(*terminal_tables(numbers))
    return 0
