"""Creases: which patches meet at a sharp edge.

The surface goes on across a crease, but no polynomial does: patches on its two sides are on
different sheets.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.sheets import SheetNeighbours

Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Crease:
    """How two patches are creased.

    Parameters
    ----------
    sign : int
        1 for a convex edge, -1 for a concave one.
    anchor : (3,) float, length, world
        Point on both patches near which both were touched.
    """

    sign: int
    anchor: np.ndarray


class Creases:
    """Which patches are creased with which.

    Parameters
    ----------
    neighbours : SheetNeighbours
    """

    def __init__(self, neighbours: SheetNeighbours) -> None:
        self._neighbours = neighbours
        self._pairs: dict[Pair, Crease] = {}
        self._partners: dict[int, set[int]] = {}

    def __len__(self) -> int:
        return len(self._pairs)

    @property
    def pairs(self) -> dict[Pair, Crease]:
        """Ascending pairs of rows, and how they are creased."""
        return self._pairs

    def of(self, row: int) -> set[int]:
        """The rows that a row is creased with."""
        return self._partners.get(row, set())

    def of_all(self, rows) -> dict[int, Crease]:
        """The rows, none of some rows, that any of these is creased with, and one of the creases
        with each."""
        found = {j: self.between(i, j) for i in rows for j in sorted(self.of(i) - set(rows))}
        return {j: crease for j, crease in found.items() if crease is not None}

    def between(self, first: int, second: int) -> Crease | None:
        """How two rows are creased; None when they are not."""
        return self._pairs.get((min(first, second), max(first, second)))

    def sign(self, first: int, second: int) -> int:
        """1 where two rows make a convex edge, -1 a concave one, 0 none."""
        crease = self.between(first, second)
        return crease.sign if crease else 0

    def behind(self, row: int) -> dict[int, int]:
        """The rows across the edges of a row's sheet, and the sign of the edge with each.

        The sheet is the row and its neighbours; where both are creased with one row, the sign is
        that of the row itself.
        """
        neighbours, signs = self._neighbours[row], dict[int, int]()
        for i in (row, *sorted(neighbours)):
            for j in self.of(i) - signs.keys():
                signs[j] = self.sign(i, j)
        return {j: sign for j, sign in signs.items() if j != row and j not in neighbours}

    def enter(self, first: int, second: int, crease: Crease) -> None:
        """Make two rows creased, or move the anchor of their crease."""
        self._pairs[min(first, second), max(first, second)] = crease
        self._partners.setdefault(first, set()).add(second)
        self._partners.setdefault(second, set()).add(first)

    def drop(self, first: int, second: int) -> None:
        """Two rows are creased no more."""
        del self._pairs[min(first, second), max(first, second)]
        self._partners[first].discard(second)
        self._partners[second].discard(first)

    def forget(self, rows: Iterable[int]) -> None:
        """Rows that are no more have no crease."""
        for i in rows:
            for j in list(self.of(i)):
                self.drop(i, j)
            self._partners.pop(i, None)
