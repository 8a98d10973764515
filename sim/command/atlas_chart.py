"""touchatlas chart --atlas: error of the whole surface against what it took."""

import json
from pathlib import Path

from rich.console import Console

from touchatlas.sim.command.show import shown


def chart_atlas(objects, out: Path, draws: int | None, seed: int, as_json: bool) -> int:
    """Explore the objects, write the table and pictures to a folder, print the ratios."""
    from touchatlas.sim.study.economy.report import atlas_chart, atlas_table
    from touchatlas.sim.study.economy.summary import summary

    draws = 1 if draws is None else draws
    with shown("exploring") as watcher:
        rows = atlas_chart(out, tuple(objects), draws, seed, watcher.count("runs"))
    if as_json:
        # A number that is not known is no JSON.
        found = [{k: None if v != v else v for k, v in row.items()} for row in summary(rows)]  # noqa: PLR0124
        print(json.dumps(found, indent=2))
    else:
        Console().print(atlas_table(rows))
    return 0
