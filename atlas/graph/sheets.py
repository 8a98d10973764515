"""Sheets: which patches continue each other, so that they share samples and are blended.

Two patches are sheet neighbours when their balls overlap and, at a point between them, both have
the surface at the same place with the same orientation. Nearness alone is not enough: the two
sides of a thin wall, and two fingers beside each other, have near points on different sheets.
"""

from collections.abc import Iterable
from collections.abc import Set as AbstractSet

import numpy as np

from touchatlas.atlas.patches.growing_array import grown
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, SHEET_GAP
from touchatlas.atlas.patches.patch_table import PatchTable


class SheetNeighbours:
    """For each patch the set of its neighbours on the same sheet.

    The relation is symmetric, and no patch is its own neighbour.

    Parameters
    ----------
    sets : iterable of sets of int
        The neighbours of each row.

    Examples
    --------
    >>> neighbours = SheetNeighbours([{1}, {0, 2}, {1}])
    >>> neighbours.lines()[:, :3].tolist()
    [[1, 0, 0], [0, 2, 1], [1, 2, 2]]
    """

    def __init__(self, sets: Iterable[AbstractSet[int]] = ()) -> None:
        self._sets = [set(neighbours) for neighbours in sets]
        self._lines = np.zeros((64, 8), np.int32)
        self._stale = set(range(len(self._sets)))

    def __len__(self) -> int:
        return len(self._sets)

    def __getitem__(self, row: int) -> AbstractSet[int]:
        return self._sets[row]

    def append(self, neighbours: Iterable[int]) -> None:
        """Append a row with its neighbours."""
        row = len(self._sets)
        self._sets.append(set())
        self._stale.add(row)
        for other in neighbours:
            self.join(row, other)

    def join(self, first: int, second: int) -> None:
        """Make two rows neighbours."""
        self._sets[first].add(second)
        self._sets[second].add(first)
        self._stale.update((first, second))

    def separate(self, first: int, second: int) -> None:
        """Make two rows no longer neighbours."""
        self._sets[first].discard(second)
        self._sets[second].discard(first)
        self._stale.update((first, second))

    def isolate(self, row: int) -> None:
        """Separate a row from all its neighbours."""
        for other in list(self._sets[row]):
            self.separate(row, other)

    def around(self, rows: Iterable[int]) -> set[int]:
        """The rows and all their neighbours."""
        return set(rows).union(*(self._sets[row] for row in rows))

    def lines(self) -> np.ndarray:
        """(m, w) neighbours of every row, ascending, padded with the row itself: a line as
        long as the longest has no padding."""
        size = len(self._sets)
        self._lines = grown(self._lines, size)
        for row in self._stale:
            line = sorted(self._sets[row])
            if len(line) > self._lines.shape[1]:
                own = np.arange(len(self._lines), dtype=np.int32)[:, None]
                self._lines = np.concatenate([self._lines, np.tile(own, len(line))], axis=1)
            self._lines[row, : len(line)] = line
            self._lines[row, len(line) :] = row
        self._stale.clear()
        return self._lines[:size]

    def lines_of(self, rows) -> np.ndarray:
        """(n, w) the same of rows (n,), as wide as the longest of these lines, and one at least."""
        lines = self.lines()[rows]
        return lines[:, : max(1, int((lines != rows[:, None]).any(axis=0).sum()))]


def same_sheet(neighbours: SheetNeighbours, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(m,) whether patches ``first`` and ``second`` (m,) are sheet neighbours or the same patch."""
    lines = neighbours.lines()
    if len(lines) ** 2 <= 8 * len(first):
        square = np.eye(len(lines), dtype=bool)
        np.put_along_axis(square, lines.astype(np.int64), True, axis=1)
        return square[first, second]
    return (first == second) | (lines[first] == second[:, None]).any(axis=1)


def radical_parameter(table: PatchTable, row, others: np.ndarray):
    """Where the radical planes of a row and others intersect the lines between their sites.

    Parameters
    ----------
    table : PatchTable
    row : int, or (m,) int
    others : (m,) int

    Returns
    -------
    offset : (m, 3) float, length, world
        Vector from the site of the row to that of the other.
    square : (m,) float, length^2
        Squared length of the offset.
    parameter : (m,) float
        Parameter of the point of equal power on the line: 0 at the row's site, 1 at the other.
    """
    offset = table.site[others] - table.site[row]
    square = np.maximum((offset * offset).sum(axis=1), np.finfo(float).tiny)
    parameter = 0.5 * (1.0 + (table.weight[row] - table.weight[others]) / square)
    return offset, square, parameter


def sheet_neighbours(table: PatchTable, row: int) -> np.ndarray:
    """Rows of the patches that continue the sheet of ``row``, ascending.

    Parameters
    ----------
    table : PatchTable
    row : int
        A patch, or a candidate.

    Returns
    -------
    (m,) int
    """
    others = table.index.rows_near(table.origin[row], table.radius[row])
    others = others[others != row]
    if not len(others):
        return others
    offset, _, parameter = radical_parameter(table, row, others)
    between = table.site[row] + np.clip(parameter, 0.0, 1.0)[:, None] * offset
    mine = table.scaled_local(np.array([row]), between)
    height, upward = table.surface(np.array([row]), mine)
    mine[..., 2] -= height / upward[..., 2]
    radius, axes = table.radius[row], table.axes[row]
    foot = mine[0] * radius @ axes + table.origin[row]
    upward = upward[0] @ axes

    theirs = table.scaled_local(others, foot[:, None])
    gap, their_upward = table.surface(others, theirs)
    their_upward = (their_upward @ table.axes[others])[:, 0]
    lengths = np.sqrt((upward**2).sum(axis=1)), np.sqrt((their_upward**2).sum(axis=1))
    distance = np.abs(gap[:, 0]) * table.radius[others] / lengths[1]
    agree = (upward * their_upward).sum(axis=1) >= SHEET_COSINE * lengths[0] * lengths[1]
    inside = (theirs[:, 0, :2] ** 2).sum(axis=1) <= 1.0
    inside &= (mine[0, :, :2] ** 2).sum(axis=1) <= 1.0
    near = distance <= SHEET_GAP * np.minimum(radius, table.radius[others])
    return others[agree & inside & near]
