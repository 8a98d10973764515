"""Outlines: the rim of each patch's core on its polynomial, and where no cell covers it.

An outline follows from the polynomial, the site and the weight of its patch. Whether a point of it
is open follows from the cells of the sheet neighbours and from the creases. Both are computed when
they are read, and kept until the patch or its surroundings change.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.graph.visibility import Visibility
from touchatlas.atlas.patches.growing_array import grown
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.polynomial import evaluate_batch, monomials

# Number of points of an outline, 15 degrees apart: the chord between two is within 1 % of the core
# radius of the rim. Doubled, outlines take twice the time.
COUNT = 24
# Steps of the fixed-point iteration for the height of the rim. Each multiplies the error by about
# the slope of the patch, which is below 1. Doubled, only steep rims change.
_STEPS = 4
_ANGLES = 2.0 * np.pi / COUNT * np.arange(COUNT)
_COS, _SIN = np.cos(_ANGLES), np.sin(_ANGLES)


class Outlines:
    """Outlines of the patches of a table.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    visibility : Visibility
    """

    def __init__(
        self, table: PatchTable, neighbours: SheetNeighbours, visibility: Visibility
    ) -> None:
        self._table, self._neighbours, self._visibility = table, neighbours, visibility
        self._points = np.zeros((0, COUNT, 3))
        self._open = np.zeros((0, COUNT), bool)
        self._stale: set[int] = set()

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Rows changed: compute their outlines again at the next reading."""
        self._stale.update(rows)

    def points(self, rows) -> np.ndarray:
        """(m, 24, 3) points of the outlines of rows (m,), world, counter-clockwise from outside."""
        self._refresh()
        return self._points[rows]

    def open(self, rows) -> np.ndarray:
        """(m, 24) whether points of the outlines of rows (m,) are in no cell of a neighbour and not
        beyond a crease."""
        self._refresh()
        return self._open[rows]

    def _refresh(self) -> None:
        """Compute the outlines of stale rows."""
        rows = np.array(sorted(row for row in self._stale if row in self._table.index), int)
        self._stale.clear()
        self._points, self._open = (grown(a, self._table.size) for a in (self._points, self._open))
        if len(rows):
            points = core_outlines(self._table, rows)
            self._points[rows] = points
            self._open[rows] = self._uncovered(rows, points)

    def _uncovered(self, rows, points) -> np.ndarray:
        """(m, 24) whether points (m, 24, 3) of the outlines of rows (m,) are open."""
        table, lines = self._table, self._neighbours.lines()[rows]
        power = power_at(table, lines[:, None], points) - CELL_MARGIN * table.weight[lines][:, None]
        # Lines are padded with the row itself.
        power[np.broadcast_to((lines == rows[:, None])[:, None], power.shape)] = np.inf
        is_open = np.asarray((power > 0.0).all(axis=2))
        which, places = np.nonzero(is_open)
        beyond = self._visibility.beyond(rows[which], points[which, places])
        is_open[which[beyond], places[beyond]] = False
        return is_open


def core_outlines(table: PatchTable, rows) -> np.ndarray:
    """(m, 24, 3) points of patches ``rows`` (m,) on the rims of their cores, world.

    The core is the ball about the patch's site whose squared radius is the weight. The height of
    the rim is found by fixed-point iteration. A steep polynomial is clipped to the ball.
    """
    radius = table.radius[rows]
    core = (np.sqrt(table.weight[rows]) / radius)[:, None]
    x0, y0, z0 = table.scaled_local(rows, table.site[rows][:, None])[:, 0].T[:, :, None]
    x, y, rise = x0 + core * _COS, y0 + core * _SIN, np.zeros((len(rows), COUNT))
    for _ in range(_STEPS):
        value = evaluate_batch(
            table.basis, table.mean[rows], monomials(table.basis, x, y, z0 + rise)
        )
        rise = np.clip(value[0] - z0, -core, core)
        across = np.sqrt(np.maximum(core**2 - rise**2, 0.25 * core**2))
        x, y = x0 + across * _COS, y0 + across * _SIN
    scaled = np.stack([x, y, z0 + rise], axis=-1)
    return scaled * radius[:, None, None] @ table.axes[rows] + table.origin[rows][:, None]
