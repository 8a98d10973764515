"""Pictures of the runs: errors against cost for each object, and costs of all over ours."""

import io
from typing import Any

import numpy as np

from touchatlas.sim.study.economy.summary import COSTS, middle, number, pairs
from touchatlas.sim.study.economy.sweep import Row
from touchatlas.sim.study.economy.trial import ORACLE, OTHERS, OURS
from touchatlas.sim.study.tradeoff_chart import pareto_front

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
_CHARTED = {
    "touches": "touches",
    "tracked": "tracked length / diagonal",
    "length": "tracked + travel length / diagonal",
    "seconds": "compute, processor seconds",
}
# Half of one of 8,000 true points stands for none, which has no logarithm.
_LEAST_SHARE = 1.0 / 16_000
_DOTS = 75
_FRONT: dict[str, Any] = {"color": "black", "lw": 1.0, "ls": "--"}


def _mean_error(row: Row) -> float:
    return number(row["mean_error"])


def _p95_error(row: Row) -> float:
    return number(row["p95_error"])


def _unknown_share(row: Row) -> float:
    return max(1.0 - float(row["known_share"]), _LEAST_SHARE)


_PANELS = (
    (_mean_error, "mean error / diagonal"),
    (_p95_error, "95th percentile of error / diagonal"),
    (_unknown_share, "share of truth not within the tolerance"),
)


def object_picture(name: str, rows: list[Row]) -> dict[str, bytes]:
    """PNG and SVG of one object's rows, by suffix: each run a point, hollow where it did not meet
    its tolerance; a line through the medians of a method; the front that none but the oracle
    beats."""
    figure = _figure((15.0, 10.5))
    grid = figure.subplots(3, len(_CHARTED), sharex="col", sharey="row")
    for line, (error, title) in zip(grid, _PANELS, strict=True):
        for axes, (cost, label) in zip(line, _CHARTED.items(), strict=True):
            _panel(axes, rows, COSTS[cost], error)
            if error is _unknown_share:
                axes.set_xlabel(label)
        line[0].set_ylabel(title)
    _legend(figure, {row["method"] for row in rows})
    words = "each point one run to one tolerance; hollow: tolerance not met"
    figure.suptitle(f"{name}: error of the whole surface against its cost ({words})")
    return _bytes(figure)


def _panel(axes, rows: list[Row], cost, error) -> None:
    """One error against one cost, on logarithmic axes."""
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.25)
    for method, (colour, marker) in STYLES.items():
        own = [row for row in rows if row["method"] == method]
        if not own:
            continue
        for row in own:
            face = colour if row["met"] == "yes" else "none"
            point = cost(row), error(row)
            axes.plot(*point, marker, mfc=face, mec=colour, ms=8 if marker != "*" else 11, mew=1.5)
        if error is not _unknown_share:
            axes.plot(*_middles(own, cost, error).T, color=colour, lw=1.2)
    _plain_numbers(axes.xaxis)
    if error is _unknown_share:
        # Shares are within different tolerances, so no line joins them.
        return
    real = [(cost(row), error(row)) for row in rows if row["method"] != ORACLE]
    front = np.array(pareto_front(real)).reshape(-1, 2)
    axes.plot(*front.T, **_FRONT, zorder=1)


def _legend(figure, methods) -> None:
    """One entry a method, and the front."""
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], color=colour, marker=marker, ms=8, lw=1.2, label=method)
        for method, (colour, marker) in STYLES.items()
        if method in methods
    ]
    entries.append(Line2D([], [], **_FRONT, label="Pareto front without the oracle"))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))


def _plain_numbers(axis) -> None:
    """Ticks 1, 2, 5, 10, ... of a logarithmic axis as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _middles(own: list[Row], cost, error) -> np.ndarray:
    """(t, 2) medians over the seeds, from the tightest tolerance to the loosest."""
    found = []
    for tolerance in sorted({float(row["tolerance"]) for row in own}):
        some = [row for row in own if float(row["tolerance"]) == tolerance]
        found.append([middle(map(cost, some)), middle(map(error, some))])
    return np.array(found)


def overview_picture(rows: list[Row]) -> dict[str, bytes]:
    """PNG and SVG of what methods took over ours to meet a tolerance: a point a run that both met,
    and the median as a bar."""
    methods = [m for m in STYLES if m != OURS and pairs(rows, m, COSTS["touches"])]
    methods = [m for m in methods if m not in OTHERS][::-1]
    names = ("touches", "length", "length to 99 %")
    figure = _figure((13.0, 1.8 + 0.5 * len(methods)))
    for axes, name in zip(figure.subplots(1, len(names), sharey=True), names, strict=True):
        axes.set(xscale="log", xlabel=f"{name}, of the method over ours")
        axes.axvline(1.0, color=STYLES[OURS][0], lw=1.5)
        for height, method in enumerate(methods):
            ratios = [other / ours for ours, other in pairs(rows, method, COSTS[name])]
            known = [ratio for ratio in ratios if np.isfinite(ratio)]
            colour, marker = STYLES[method]
            axes.plot(known, [height] * len(known), marker, color=colour, alpha=0.6, ls="none")
            if known:
                axes.plot([np.median(known)] * 2, [height - 0.35, height + 0.35], "k", lw=2)
        axes.set_yticks(range(len(methods)), methods)
        _plain_numbers(axes.xaxis)
        axes.grid(alpha=0.25, axis="x", which="both")
    figure.suptitle("cost of a met tolerance over that of ours: right of the line, ours is cheaper")
    return _bytes(figure)


def _figure(size) -> Any:
    # Not through pyplot, whose choice of back end is the caller's own.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _bytes(figure) -> dict[str, bytes]:
    """The figure as PNG and SVG; equal figures give equal bytes."""
    import matplotlib

    found = {}
    with matplotlib.rc_context({"svg.hashsalt": "touchatlas"}):
        for suffix, metadata in (("png", {"Software": None}), ("svg", {"Date": None})):
            image = io.BytesIO()
            figure.savefig(image, format=suffix, dpi=_DOTS, metadata=metadata)
            found[suffix] = image.getvalue()
    return found
