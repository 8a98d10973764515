"""Outlines: the rim of each patch's core on its polynomial, and where no cell covers it.

An outline follows from the polynomial, the site and the weight of its patch. Whether a point of it
is open follows from the cells of the sheet neighbours. Both are computed when they are read, and
kept until the patch or its surroundings change.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.growing_array import grown
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.polynomial import evaluate_batch, monomials

# Number of points of an outline, 15 degrees apart: the chord between two is within 1 % of the core
# radius of the rim. Doubled, outlines take twice the time.
COUNT = 24
# Steps of the secant method for the height of the rim, and limits of the slope of the gap that it
# closes. In 24 atlases of three bodies rims were 0.017 radii off at most. Doubled, outlines take
# twice the time, and only steep rims change.
_STEPS, _SLOPES = 4, (-5.0, -0.5)
_ANGLES = 2.0 * np.pi / COUNT * np.arange(COUNT)


class Outlines:
    """Outlines of the patches of a table.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours) -> None:
        self._table, self._neighbours = table, neighbours
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
        """(m, 24) whether points of the outlines of rows (m,) are in no cell of a neighbour."""
        self._refresh()
        return self._open[rows]

    def _refresh(self) -> None:
        """Compute the outlines of stale rows."""
        rows = np.array(sorted(row for row in self._stale if row in self._table.index), int)
        self._stale.clear()
        self._points, self._open = (grown(a, self._table.size) for a in (self._points, self._open))
        if len(rows):
            points = core_points(self._table, rows)
            self._points[rows] = points
            self._open[rows] = self._uncovered(rows, points)

    def _uncovered(self, rows, points) -> np.ndarray:
        """(m, 24) whether points (m, 24, 3) of the outlines of rows (m,) are open."""
        table, lines = self._table, self._neighbours.lines_of(rows)
        power = power_at(table, lines[:, None], points) - CELL_MARGIN * table.weight[lines][:, None]
        # Lines are padded with the row itself.
        power[np.broadcast_to((lines == rows[:, None])[:, None], power.shape)] = np.inf
        return np.asarray((power > 0.0).all(axis=2))


def core_points(table: PatchTable, rows, radii=1.0, angles=_ANGLES) -> np.ndarray:
    """(m, n, 3) points of patches ``rows`` (m,) in their cores, world; on the rims by default.

    The core is the ball about the patch's site whose squared radius is the weight. The height of
    a point is found by the secant method. A steep polynomial is clipped to the ball.

    Parameters
    ----------
    table : PatchTable
    rows : (m,) int
    radii : float or (n,) float
        Distance from the site, in core radii.
    angles : (n,) float, rad
        Direction from the site, from the patch's first axis to its second.
    """
    radius = table.radius[rows]
    core = (np.sqrt(table.weight[rows]) / radius)[:, None] * np.broadcast_to(radii, angles.shape)
    cosine, sine = np.cos(angles), np.sin(angles)
    x0, y0, z0 = table.scaled_local(rows, table.site[rows][:, None])[:, 0].T[:, :, None]
    rise, step, gap = np.zeros((3, *core.shape))
    for _ in range(_STEPS):
        across = np.sqrt(np.maximum(core**2 - rise**2, 0.25 * core**2))
        terms = monomials(table.basis, x0 + across * cosine, y0 + across * sine, z0 + rise)
        value = evaluate_batch(table.basis, table.mean[rows], terms)[0]
        last, gap = gap, np.clip(value - z0, -core, core) - rise
        # Where the patch is steep, a rise shortens the way across, which lowers the height: the
        # gap falls by 1 at least for each unit of rise.
        moved = step != 0.0
        slope = np.clip(np.divide(gap - last, step, out=-np.ones_like(gap), where=moved), *_SLOPES)
        step = -gap / slope
        rise = rise + step
    across = np.sqrt(np.maximum(core**2 - rise**2, 0.25 * core**2))
    x, y = x0 + across * cosine, y0 + across * sine
    scaled = np.stack([x, y, z0 + rise], axis=-1)
    return scaled * radius[:, None, None] @ table.axes[rows] + table.origin[rows][:, None]
