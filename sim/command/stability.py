"""touchatlas chart --stability: where the methods fail."""

import json
from pathlib import Path

from rich.console import Console

from touchatlas.sim.command.show import shown


def chart_stability(families, out: Path, draws: int | None, seed: int, as_json: bool) -> int:
    """Measure the families, write their tables and pictures to a folder, print the shares."""
    from touchatlas.sim.study.stability.report import stability_chart, stability_table

    with shown("measuring") as watcher:
        watch = watcher.count("severities")
        summed = stability_chart(out, tuple(families), draws, seed, watch)
    if as_json:
        # A number that is not known is no JSON.
        rows = [{k: None if v != v else v for k, v in row.items()} for row in summed]  # noqa: PLR0124
        print(json.dumps(rows, indent=2))
    else:
        Console().print(stability_table(summed))
    return 0
