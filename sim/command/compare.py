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
from touchatlas.sim.judge.comparison import compare_runs


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
    table = Table("")
    for name in comparison.names:
        # Names of runs differ at their end, which must not be cut off.
        table.add_column(escape(name), overflow="fold")
    for quantity, values in comparison.rows():
        table.add_row(escape(quantity), *(escape(value) for value in values))
    Console().print(table)
    print(f"compare.csv and compare.png are in {out}")
    return 0
