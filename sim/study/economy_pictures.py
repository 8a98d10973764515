"""Pictures of what a tolerance takes: error against cost, and cost over that of ours."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.economy_costs import COSTS, ORACLE, OTHERS, OURS, pairs
from touchatlas.sim.study.figures import canvas, plain_numbers, ratio_panels
from touchatlas.sim.study.surface_judge import OPTIONS
from touchatlas.sim.study.tables import Summed, grouped, middle, number
from touchatlas.sim.study.tradeoff import pareto_front

# Colours of Okabe and Ito, which differ for all kinds of colour vision, with grey, and markers
# besides.
STYLES = {
    "tolerance": ("#0072B2", "o"),
    "oracle": ("#000000", "*"),
    "random": ("#999999", "s"),
    "farthest": ("#009E73", "D"),
    "variance": ("#CC79A7", "^"),
    "APSS": ("#56B4E9", "P"),
    "RIMLS": ("#D55E00", "X"),
    "Poisson": ("#F0E442", "h"),
}
# Of planners that packages add.
_MORE = (("#E69F00", "v"), ("#882255", "<"), ("#44AA99", ">"), ("#999933", "p"), ("#332288", "d"))
_CHARTED = {
    "touches": "touches",
    "tracked": "tracked length / diagonal",
    "length": "tracked + travel length / diagonal",
    "seconds": "compute, processor seconds",
}
_ERRORS: dict[str, Callable[[Row], float]] = {
    "mean error / diagonal": lambda row: number(row["mean_error"]),
    "95th percentile of error / diagonal": lambda row: number(row["p95_error"]),
    # Half of one of 8,000 true points stands for none, which has no logarithm.
    "share of truth not within the tolerance": lambda row: max(
        1.0 - number(row["known_share"]), 0.5 / OPTIONS.points
    ),
}


def styles(rows: list[Row]) -> dict[str, tuple[str, str]]:
    """Colour and marker of each method of some rows, ours first."""
    there = [method for (method,) in grouped(rows, "method")]
    more = [method for method in there if method not in STYLES]
    found = {method: style for method, style in STYLES.items() if method in there}
    return found | {method: _MORE[k % len(_MORE)] for k, method in enumerate(more)}


def pictures(rows: list[Row], summed: Summed) -> dict:
    """A picture of each object, and one of all."""
    named = {Path(name).stem: own for (name,), own in grouped(rows, "object").items()}
    drawn = {name: object_picture(name, own) for name, own in named.items()}
    return drawn | {"atlas": overview_picture(rows)}


def object_picture(name: str, rows: list[Row]):
    """One object's rows: each run a point, hollow where it did not meet its tolerance; a line
    through the medians of a method; the front that none but the oracle beats."""
    from matplotlib.lines import Line2D

    figure = canvas(15.0, 10.5)
    grid = figure.subplots(len(_ERRORS), len(_CHARTED), sharex="col", sharey="row")
    for place, (line, (title, error)) in enumerate(zip(grid, _ERRORS.items(), strict=True)):
        for axes, cost in zip(line, _CHARTED, strict=True):
            # Shares are within different tolerances, so no line joins them.
            _panel(axes, rows, COSTS[cost], error, joined=place < len(grid) - 1)
        line[0].set_ylabel(title)
    for axes, label in zip(grid[-1], _CHARTED.values(), strict=True):
        axes.set_xlabel(label)
    entries = [
        Line2D([], [], color=colour, marker=marker, ms=8, lw=1.2, label=method)
        for method, (colour, marker) in styles(rows).items()
    ]
    front = "Pareto front without the oracle"
    entries.append(Line2D([], [], color="black", lw=1.0, ls="--", label=front))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    words = "each point one run to one tolerance; hollow: tolerance not met"
    figure.suptitle(f"{name}: error of the whole surface against its cost ({words})")
    return figure


def _panel(axes, rows: list[Row], cost, error, joined: bool) -> None:
    """One error against one cost, on logarithmic axes."""
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.25)
    for method, (colour, marker) in styles(rows).items():
        own = [row for row in rows if row["method"] == method]
        for row in own:
            face, size = colour if row["met"] == "yes" else "none", 8 if marker != "*" else 11
            axes.plot(cost(row), error(row), marker, mfc=face, mec=colour, ms=size, mew=1.5)
        if joined and own:
            groups = sorted(grouped(own, "tolerance").items(), key=lambda one: float(one[0][0]))
            line = [(middle(map(cost, some)), middle(map(error, some))) for _, some in groups]
            axes.plot(*np.array(line).T, color=colour, lw=1.2)
    plain_numbers(axes.xaxis)
    if joined:
        real = [(cost(row), error(row)) for row in rows if row["method"] != ORACLE]
        front = np.array(pareto_front(real)).reshape(-1, 2)
        axes.plot(*front.T, color="black", lw=1.0, ls="--", zorder=1)


def overview_picture(rows: list[Row]):
    """What methods took over ours to meet a tolerance, of runs that both met."""
    drawn = styles(rows)
    methods = [m for m in drawn if m not in (OURS, *OTHERS) and pairs(rows, m, COSTS["touches"])]
    ratios = {
        f"{name}, of the method over ours": {
            method: [other / ours for ours, other in pairs(rows, method, COSTS[name])]
            for method in methods[::-1]
        }
        for name in ("touches", "length", "length to 99 %")
    }
    figure = ratio_panels(ratios, drawn)
    figure.suptitle("cost of a met tolerance over that of ours: right of the line, ours is cheaper")
    return figure
