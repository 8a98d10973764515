"""touchatlas chart: the command."""

import json
import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console

from touchatlas.sim.command.numbers import Json
from touchatlas.sim.command.option_flags import Whole
from touchatlas.sim.command.outcome import say
from touchatlas.sim.command.show import shown
from touchatlas.sim.command.work_flags import Work
from touchatlas.sim.study.workers import WorkOptions


def chart(
    *names: Annotated[str, Parameter(name="NAME", show_default=False)],
    atlas: Annotated[bool, Parameter(negative="")] = False,
    stability: Annotated[bool, Parameter(negative="")] = False,
    out: Path = Path("runs/chart"),
    draws: Whole | None = None,
    seed: Whole = 0,
    work: Work = WorkOptions(),
    json_: Json = False,
) -> int:
    """Chart accuracy against speed of one patch: our methods, the paper's, peers'.

    A chart that was interrupted goes on where it was.

    Parameters
    ----------
    names
        With --stability: the families to measure; all of one patch where none is named. Those of
        many patches are explorations, and take minutes. With --atlas: the objects to explore, or
        mesh files; ellipsoid and blob where none is named.
    atlas
        Chart the error of whole surfaces against touches, lengths and time instead: our planner,
        others by name, one that knows the truth, and peers' surfaces where they are installed. A
        few minutes an object.
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
    if names and not (atlas or stability):
        raise ValueError(
            f"got {names[0]!r} without --stability or --atlas; names are families of the one or "
            "objects of the other: give one of the two, or no name"
        )
    charts = _charts(names, atlas, stability)
    from touchatlas.sim.study.study import draw_chart

    rows: list = []
    summed: list = []
    with shown(charts[0][0].words[0]) as watcher:
        for one, own in charts:
            watch = watcher.count(one.words[1])
            more, numbers = draw_chart(one, out, own, draws, seed, watch, work, say)
            rows, summed = rows + more, summed + numbers
    if json_:
        print(json.dumps([{k: _known(v) for k, v in row.items()} for row in summed], indent=2))
    else:
        Console().print(charts[0][0].table(rows, summed))
    return 0


def _charts(names: tuple[str, ...], atlas: bool, stability: bool):
    """The charts that are wanted, each with its own names."""
    if stability:
        from touchatlas.sim.study.stability import charts_of

        return charts_of(names)
    if atlas:
        from touchatlas.sim.study.economy import ECONOMY

        return [(ECONOMY, names)]
    from touchatlas.sim.study.tradeoff import TRADEOFF

    return [(TRADEOFF, ())]


def _known(value):
    """A value as JSON has it, which has no NaN."""
    return None if isinstance(value, float) and math.isnan(value) else value
