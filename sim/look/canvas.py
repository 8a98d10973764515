"""Figures, and their PNG. They are not made by pyplot, whose choice of back end is the caller's."""

import io
import warnings
from typing import Literal


def canvas(width: float, height: float, layout: Literal["constrained"] | None = None):
    """An empty figure, inches.

    Parameters
    ----------
    width, height : float
    layout : "constrained", optional
        Finds the margins, which takes as long as the drawing itself.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def png_of(figure) -> bytes:
    """A figure as PNG; equal figures give equal bytes."""
    image = io.BytesIO()
    with warnings.catch_warnings():
        # A letter that the font lacks is drawn as a box, which is good enough.
        warnings.filterwarnings("ignore", "Glyph .* missing")
        # figure.savefig would draw it twice.
        figure.canvas.print_png(image, metadata={"Software": None})
    return image.getvalue()
