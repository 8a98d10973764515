"""Pictures of a sweep: each family as severity against method, and all families at a glance."""

import io
from typing import Any

import numpy as np

from touchatlas.sim.study.stability.outcome import Outcome
from touchatlas.sim.study.stability.summary import median_error, shares
from touchatlas.sim.study.stability.sweep import Study

# Colours of Okabe and Ito, which differ for all kinds of colour vision, and hatches besides.
COLOURS = {
    Outcome.GOOD: ("#009E73", ""),
    Outcome.FLAGGED: ("#F0E442", "////"),
    Outcome.REFUSED: ("#BBBBBB", "...."),
    Outcome.WRONG: ("#D55E00", "xxxx"),
    Outcome.CRASHED: ("#000000", ""),
}
# Range of the colours of errors, in noises.
_LEAST, _MOST = 0.1, 1e3
_DOTS = 110


def family_picture(study: Study, family: str, rows: list[dict[str, str]]) -> dict[str, bytes]:
    """PNG and SVG of one family's rows, by suffix."""
    severities = study.families[family].severities
    methods = list(dict.fromkeys(row["method"] for row in rows))
    figure = _figure((9.0, 3.9 + 0.54 * len(methods)))
    errors, outcomes = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.25))
    cells = {
        (m, s): [r for r in rows if r["method"] == m and float(r["severity"]) == s]
        for m in methods
        for s in severities
    }
    values = [[median_error(cells[m, s]) for s in severities] for m in methods]
    _heat(figure, errors, np.array(values), methods, study.error)
    _bars(outcomes, cells, methods, severities)
    outcomes.set_xticks(range(len(severities)), [f"{s:g}" for s in severities])
    outcomes.set_xlabel(study.families[family].title)
    figure.suptitle(f"{family}: {len(rows) // len(methods)} cases")
    return _bytes(figure)


def overview_picture(study: Study, summed: list[dict[str, Any]]) -> dict[str, bytes]:
    """PNG and SVG of the share of wrong cases, family against method."""
    families = list(dict.fromkeys(str(row["family"]) for row in summed))
    methods = list(dict.fromkeys(str(row["method"]) for row in summed))
    found = {(row["family"], row["method"]): row for row in summed}
    figure = _figure((8.5, 2.0 + 0.26 * len(families)))
    axes = figure.subplots(1, 2, sharey=True)
    for panel, name in zip(axes, ("wrong", "three noises"), strict=True):
        values = np.array([[float(found[f, m][name]) for m in methods] for f in families])
        bad = values if name == "wrong" else 1.0 - values
        panel.imshow(bad, cmap="cividis", vmin=0.0, vmax=1.0, aspect="auto")
        for (row, column), value in np.ndenumerate(values):
            colour = "black" if bad[row, column] > 0.5 else "white"
            words = f"{100.0 * value:.0f}"
            panel.text(column, row, words, ha="center", va="center", color=colour, size=7)
        panel.set_xticks(range(len(methods)), methods, rotation=35, ha="right")
        panel.set_title({"wrong": "wrong, %", "three noises": study.near}[name])
    axes[0].set_yticks(range(len(families)), families)
    return _bytes(figure)


def _figure(size):
    # Not through pyplot, whose choice of back end is the caller's own.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _heat(figure, axes, values, methods, title: str) -> None:
    """Values (m, s) as colours on a logarithmic scale, each with its number."""
    from matplotlib.colors import LogNorm

    norm = LogNorm(_LEAST, _MOST)
    image = axes.imshow(
        np.ma.masked_invalid(values), cmap="cividis", norm=norm, aspect="auto", origin="lower"
    )
    for (row, column), value in np.ndenumerate(values):
        words = "none" if np.isnan(value) else f"{value:.2g}" if value < 1e4 else f"{value:.0e}"
        light = not np.isnan(value) and value > np.sqrt(_LEAST * _MOST)
        colour = "black" if light or np.isnan(value) else "white"
        axes.text(column, row, words, ha="center", va="center", color=colour, size=8)
    axes.set_yticks(range(len(methods)), methods)
    figure.colorbar(image, ax=axes, label=title)


def _bars(axes, cells, methods, severities) -> None:
    """Shares of the outcomes as stacked bars, one row a method."""
    for row, method in enumerate(methods):
        for column, severity in enumerate(severities):
            found, base = shares(cells[method, severity]), row - 0.4
            for outcome, (colour, hatch) in COLOURS.items():
                height = 0.8 * found[outcome.value]
                axes.bar(
                    *(column, height, 0.9, base),
                    color=colour,
                    hatch=hatch,
                    edgecolor="white" if outcome is Outcome.WRONG else "#555555",
                    linewidth=0.3,
                    label=outcome.value if row == column == 0 else None,
                )
                base += height
    axes.set_yticks(range(len(methods)), methods)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title="share of cases")


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
