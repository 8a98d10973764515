"""touchatlas chart: the command."""

import json
from pathlib import Path

from rich.console import Console

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.show import shown
from touchatlas.sim.study.paper.tables import check_options
from touchatlas.sim.study.tradeoff import measure, overall
from touchatlas.sim.study.tradeoff_chart import known, make_folder, overall_table, write_chart


def chart(
    *,
    out: Path = Path("runs/chart"),
    draws: Whole = 50,
    seed: Whole = 0,
    json_: Json = False,
) -> int:
    """Chart accuracy against speed of one patch: our methods, the paper's, peers'.

    Parameters
    ----------
    out
        Folder for tradeoff.csv and tradeoff.png.
    draws
        Number of scenes of each kind: surface, noise, planes.
    seed
        Seed of the scenes.
    """
    check_options(draws, seed)
    make_folder(out)
    with shown("charting") as watcher:
        rows = measure(draws=draws, seed=seed, watch=watcher.count("cells"))
    write_chart(out, rows)
    if json_:
        found = [{n: v if known(v) else None for n, v in row.items()} for row in overall(rows)]
        print(json.dumps(found, indent=2))
    else:
        Console().print(overall_table(rows))
    return 0
