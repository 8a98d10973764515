"""touchatlas chart: the command."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console

from touchatlas.sim.command.atlas_chart import chart_atlas
from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.show import shown
from touchatlas.sim.command.stability import chart_stability
from touchatlas.sim.study.paper.tables import check_options
from touchatlas.sim.study.tradeoff import measure, overall
from touchatlas.sim.study.tradeoff_chart import known, make_folder, overall_table, write_chart


def chart(
    *names: Annotated[str, Parameter(name="NAME", show_default=False)],
    atlas: Annotated[bool, Parameter(negative="")] = False,
    stability: Annotated[bool, Parameter(negative="")] = False,
    out: Path = Path("runs/chart"),
    draws: Whole | None = None,
    seed: Whole = 0,
    json_: Json = False,
) -> int:
    """Chart accuracy against speed of one patch: our methods, the paper's, peers'.

    Parameters
    ----------
    names
        With --stability: the families to measure; all of one patch where none is named. Those of
        many patches are explorations, and take minutes. With --atlas: the objects to explore, or
        mesh files; ellipsoid and blob where none is named.
    atlas
        Chart the error of whole surfaces against touches, lengths and time instead: our planner,
        others by name, one that knows the truth, and peers' surfaces where they are installed. A
        few minutes an object. A chart that was interrupted goes on where it was.
    stability
        Chart where the methods fail instead: families of ever harder cases.
    out
        Folder for tradeoff.csv and tradeoff.png, or the tables and pictures of the families or
        objects.
    draws
        Number of scenes of each kind (surface, noise, planes), 50 if not given; with --stability
        of cases of each severity, 25 if not given, and 2 of many patches; with --atlas of seeds,
        1 if not given.
    seed
        Seed of the scenes.
    """
    if atlas and stability:
        raise ValueError("got --atlas and --stability; give one of them")
    if atlas:
        return chart_atlas(names, out, draws, seed, json_)
    if stability:
        return chart_stability(names, out, draws, seed, json_)
    if names:
        raise ValueError(
            f"got {names[0]!r} without --stability or --atlas; names are families of the one or "
            "objects of the other: give one of the two, or no name"
        )
    draws = 50 if draws is None else draws
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
