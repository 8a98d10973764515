"""touchatlas compare: the command."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.outcome import say
from touchatlas.sim.judge.comparison import Comparison, compare_runs


def compare(
    *runs: Annotated[Path, Parameter(name="RUN", show_default=False)],
    out: Path = Path("runs/compare"),
    json_: Json = False,
) -> int:
    """Compare runs: a table of their numbers and of the options in which they differ, and a chart.

    Parameters
    ----------
    runs
        The folders of two or more runs.
    out
        Folder for compare.csv and compare.png.
    """
    comparison = compare_runs(runs)
    comparison.write(out)
    for sentence in comparison.mismatches:
        say(sentence)
    if json_:
        print(json.dumps(comparison.table, indent=2))
        return 0
    _print_table(comparison)
    print(f"compare.csv and compare.png are in {out}")
    return 0


def _print_table(comparison: Comparison) -> None:
    """A column for each run, under its name where there is room for the names, else under a number
    that stands before the name above."""
    console, rows = Console(), comparison.rows()
    names = list(comparison.names)
    # A column has a margin of two letters and a line.
    cells = [max(len(name), 8) + 3 for name in names]
    if max(len(quantity) for quantity, _ in rows) + 4 + sum(cells) > console.width:
        for number, name in enumerate(names, 1):
            console.print(f"{number}  {name}", markup=False, highlight=False, soft_wrap=True)
        names = [str(number) for number in range(1, len(names) + 1)]
    # Names of quantities stay whole, and their units may stand below.
    widest = max(len(word) for quantity, _ in rows for word in quantity.split())
    room = (console.width - widest - 3) // len(names) - 2
    table = Table(padding=(0, 0, 0, 1))
    table.add_column("", min_width=widest)
    for name in names:
        table.add_column(escape(name), overflow="fold", max_width=max(room, 4))
    for quantity, values in rows:
        table.add_row(escape(quantity), *(escape(value) for value in values))
    console.print(table)
