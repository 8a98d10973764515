"""Which patches are of one sheet: the relation along which samples are shared and blended.

Two patches are kin when their discs overlap and, at a point between them, both put the
surface at the same place with the same orientation. Nearness alone is not enough: a thin
wall and the gap between two fingers have close points that are strangers.
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, SHEET_GAP
from touchatlas.atlas.patches.patch_table import PatchTable

if TYPE_CHECKING:
    from touchatlas.atlas.graph.creases import Creases


class SheetNeighbours(list[set[int]]):
    """For each patch the set of its kin, and the same as one array for many at once.

    A set that was handed out may be changed by who asked for it: its line of the array is
    written anew at the next need. Iteration is for reading only.

    Attributes
    ----------
    creases : Creases, optional
        Which patches of different sheets meet at an edge.

    Examples
    --------
    >>> SheetNeighbours([{1}, {0, 2}, {1}]).lines()[:, :3].tolist()
    [[1, 0, 0], [0, 2, 1], [1, 2, 2]]
    """

    def __init__(self, sets: Iterable[set[int]] = ()) -> None:
        super().__init__(sets)
        self.creases: Creases | None = None
        self._array = np.zeros((64, 8), np.int32)
        self._written = 0
        self._stale: set[int] = set()

    def __getitem__(self, row):
        self._stale.update(range(len(self))[row] if isinstance(row, slice) else (row % len(self),))
        return super().__getitem__(row)

    def __setitem__(self, row, value) -> None:
        super().__setitem__(row, value)
        self._written = 0

    def clear(self) -> None:
        """Forget all patches."""
        super().clear()
        self._written = 0

    def lines(self) -> np.ndarray:
        """(m, w) rows of the kin of every patch, ascending, filled up with its own row."""
        size = len(self)
        if size > len(self._array):
            more = np.zeros((size, self._array.shape[1]), np.int32)
            self._array = np.concatenate([self._array, more])
        stale = {row for row in self._stale if row < self._written}
        for row in (*stale, *range(self._written, size)):
            line = sorted(super().__getitem__(row))
            if len(line) > self._array.shape[1]:
                more = np.arange(len(self._array), dtype=np.int32)[:, None]
                self._array = np.concatenate([self._array, np.tile(more, len(line))], axis=1)
            self._array[row, : len(line)] = line
            self._array[row, len(line) :] = row
        self._written = size
        self._stale.clear()
        return self._array[:size]


def same_sheet(neighbours: SheetNeighbours, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(m,) whether patches (m,) are kin to, or the same as, patches (m,)."""
    lines = neighbours.lines()
    if len(lines) ** 2 <= 8 * len(first):
        square = np.eye(len(lines), dtype=bool)
        np.put_along_axis(square, lines.astype(np.int64), True, axis=1)
        return square[first, second]
    return (first == second) | (lines[first] == second[:, None]).any(axis=1)


def radical_share(table: PatchTable, row, others: np.ndarray):
    """Offsets (m, 3) to other centres, squared distances (m,), and the share (m,) of the way
    at which both cores have equal power: the radical plane."""
    offset = table.site[others] - table.site[row]
    square = np.maximum((offset * offset).sum(axis=1), np.finfo(float).tiny)
    share = 0.5 * (1.0 + (table.weight[row] - table.weight[others]) / square)
    return offset, square, share


def sheet_neighbours(table: PatchTable, row: int, cosine: float = SHEET_COSINE) -> np.ndarray:
    """Rows of the patches that continue the same sheet as ``row``, ascending: their normals
    agree up to an angle of a given cosine."""
    others = table.index.rows_near(table.origin[row], table.radius[row])
    others = others[others != row]
    if not len(others):
        return others
    offset, _, share = radical_share(table, row, others)
    between = table.site[row] + np.clip(share, 0.0, 1.0)[:, None] * offset
    mine = table.scaled_local(np.array([row]), between)
    height, upward = table.surface(np.array([row]), mine)
    mine[..., 2] -= height / upward[..., 2]
    radius, axes = table.radius[row], table.axes[row]
    meeting = mine[0] * radius @ axes + table.origin[row]
    upward = upward[0] @ axes

    theirs = table.scaled_local(others, meeting[:, None])
    gap, their_upward = table.surface(others, theirs)
    their_upward = (their_upward @ table.axes[others])[:, 0]
    lengths = np.sqrt((upward**2).sum(axis=1)), np.sqrt((their_upward**2).sum(axis=1))
    distance = np.abs(gap[:, 0]) * table.radius[others] / lengths[1]
    agree = (upward * their_upward).sum(axis=1) >= cosine * lengths[0] * lengths[1]
    inside = (theirs[:, 0, :2] ** 2).sum(axis=1) <= 1.0
    inside &= (mine[0, :, :2] ** 2).sum(axis=1) <= 1.0
    return others[
        agree & inside & (distance <= SHEET_GAP * np.minimum(radius, table.radius[others]))
    ]
