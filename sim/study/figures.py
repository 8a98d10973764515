"""Figures of studies: an empty one, its axes, its bytes."""

import io
import math

import numpy as np

from touchatlas.sim.study.compare import median_interval


def canvas(width: float, height: float):
    """An empty figure, inches. It is not made by pyplot, whose back end is the caller's choice."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def plain_numbers(axis) -> None:
    """Ticks 1, 2, 5, 10, ... of a logarithmic axis as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def ratio_panels(
    ratios: dict[str, dict[str, list[float]]], styles: dict[str, tuple[str, str]] | None = None
):
    """A panel of each cost, with a line of each name: every ratio a point, the median with its
    interval a bar. ``styles`` are colours and markers of names."""
    names = list(next(iter(ratios.values())))
    figure = canvas(4.0 * len(ratios), 1.8 + 0.5 * len(names))
    panels = np.atleast_1d(figure.subplots(1, len(ratios), sharey=True))
    for axes, (cost, lines) in zip(panels, ratios.items(), strict=True):
        axes.set(xscale="log", xlabel=cost)
        axes.axvline(1.0, color="black", lw=1.0)
        for height, (name, own) in enumerate(lines.items()):
            known = [ratio for ratio in own if math.isfinite(ratio) and ratio > 0.0]
            colour, marker = (styles or {}).get(name, ("#0072B2", "o"))
            axes.plot(known, [height] * len(known), marker, color=colour, alpha=0.5, ls="none")
            centre, *ends = median_interval(known)
            if math.isfinite(centre):
                axes.plot([centre] * 2, [height - 0.3, height + 0.3], lw=2.5, color="black")
            if math.isfinite(ends[0]):
                axes.plot(ends, [height] * 2, lw=2.5, color="black")
        axes.set_yticks(range(len(names)), names)
        plain_numbers(axes.xaxis)
        axes.grid(alpha=0.25, axis="x", which="both")
    return figure


def image_bytes(figure, suffix: str = "png") -> bytes:
    """A figure as PNG or SVG; equal figures give equal bytes."""
    import matplotlib

    image, metadata = io.BytesIO(), {"Software": None} if suffix == "png" else {"Date": None}
    with matplotlib.rc_context({"svg.hashsalt": "touchatlas"}):
        figure.savefig(image, format=suffix, dpi=100, metadata=metadata)
    return image.getvalue()
