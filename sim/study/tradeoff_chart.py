"""The study of accuracy against speed as files and a table: tradeoff.csv, tradeoff.png."""

import csv
import io
import math
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.study.tradeoff import FRACTIONS, MEASURES, overall
from touchatlas.sim.study.tradeoff_methods import PAPER

_COLUMNS = ("method", "surface", "noise", "planes", "draws", *MEASURES)
_PANELS = (
    ("mean_error", "mean height error on nine other curves (mm)"),
    ("curvature_error", "relative error of the principal curvatures"),
)
_SHOWN = (
    ("mean_error", "mean error"),
    ("max_error", "max error"),
    ("curvature_error", "k error"),
    ("time_ratio", "time"),
    ("within", "within"),
    ("curvature_within", "k within"),
    ("error_to_paper", "over (5)"),
)
_MARKERS = "osD^vP*Xh<>p"


def make_folder(path) -> None:
    """The folder of a chart; ValueError when there is a file in its place."""
    make_out_folder(path)


def write_chart(folder, rows: list[dict]) -> None:
    """tradeoff.csv and tradeoff.png from the rows of ``touchatlas.sim.study.tradeoff.measure``."""
    write_whole(Path(folder) / "tradeoff.csv", csv_bytes(rows))
    write_whole(Path(folder) / "tradeoff.png", png_bytes(rows))


def csv_bytes(rows: list[dict]) -> bytes:
    """The rows as tradeoff.csv; blank where unknown."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=_COLUMNS)
    writer.writeheader()
    writer.writerows({name: value for name, value in row.items() if known(value)} for row in rows)
    return text.getvalue().encode()


def known(value) -> bool:
    """Not the NaN that stands for no answer."""
    return not (isinstance(value, float) and math.isnan(value))


def overall_table(rows: list[dict]) -> Table:
    """Medians over all cells, one row a method."""
    kinds = {(row["surface"], row["noise"], row["planes"]) for row in rows}
    title = f"{len(kinds)} kinds of scenes, draws of each: {rows[0]['draws']}"
    caption = (
        f"errors in mm, of k relative; times in bare 57 x 15 least squares; last: mean error over "
        f"that of the paper's (5) by {PAPER} in the same scenes; within: 1.96 deviations"
    )
    table = Table(title=title, caption=caption, box=SIMPLE)
    table.add_column("method", no_wrap=True)
    for _, header in _SHOWN:
        table.add_column(header, justify="right")
    for row in overall(rows):
        table.add_row(row["method"], *(_shown(name, row[name]) for name, _ in _SHOWN))
    return table


def _shown(name: str, value: float) -> str:
    if not known(value):
        return ""
    if name in FRACTIONS:
        return f"{value:.0%}"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


def png_bytes(rows: list[dict]) -> bytes:
    """Accuracy against time: small markers are cells, large ones medians over the cells, the
    line is the front that no method beats in both."""
    # Not through pyplot, whose choice of back end is the caller's own.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 6), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (measure, label) in zip(figure.subplots(1, 2), _PANELS, strict=True):
        _panel(axes, rows, measure)
        axes.set(xlabel="time of one fit / bare 57 x 15 least squares", ylabel=label)
    handles, labels = figure.axes[-1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
    image = io.BytesIO()
    figure.savefig(image, dpi=110, metadata={"Software": None})
    return image.getvalue()


def _panel(axes, rows: list[dict], measure: str) -> None:
    """One measure against time, on logarithmic axes."""
    middles = overall(rows)
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.25)
    for number, row in enumerate(middles):
        cells = [r for r in rows if r["method"] == row["method"]]
        style = {"marker": _MARKERS[number % len(_MARKERS)], "color": f"C{number % 10}"}
        time, error = (np.array([r[name] for r in cells]) for name in ("time_ratio", measure))
        axes.scatter(time, error, s=12, alpha=0.35, linewidths=0, **style)
        axes.scatter(
            row["time_ratio"], row[measure], s=130, edgecolors="black", label=row["method"], **style
        )
    front = pareto_front([(row["time_ratio"], row[measure]) for row in middles])
    axes.plot(*np.array(front).T, color="black", lw=1.2, zorder=1)


def pareto_front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points that no other beats in both, by growing first coordinate.

    >>> pareto_front([(1.0, 5.0), (2.0, 6.0), (3.0, 1.0), (2.5, math.nan)])
    [(1.0, 5.0), (3.0, 1.0)]
    """
    front: list[tuple[float, float]] = []
    for point in sorted(p for p in points if all(map(math.isfinite, p))):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front
