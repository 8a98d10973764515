"""Creases: which patches meet at a sharp edge.

The surface continues across a crease, but no polynomial does: the patches on its two sides belong
to different sheets.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.row_tuples import Pair, pair_of
from touchatlas.atlas.graph.sheets import SheetNeighbours


@dataclass(frozen=True, eq=False)
class Crease:
    """The sharp edge of two patches.

    Parameters
    ----------
    sign : int
        1 for a convex edge, -1 for a concave one.
    anchor : (3,) float, length, world
        A point on both patches near samples of both.
    """

    sign: int
    anchor: np.ndarray


class Creases:
    """The creases of a surface, by pairs of patches. Two rows of a pair are called creased.

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
        """Ascending pairs of creased rows, mapped to their crease."""
        return self._pairs

    def of(self, row: int) -> set[int]:
        """The rows that a row is creased with."""
        return self._partners.get(row, set())

    def of_all(self, rows) -> dict[int, Crease]:
        """The rows outside of some rows that any of these is creased with, mapped to one of the
        creases with each."""
        found = {j: self.between(i, j) for i in rows for j in sorted(self.of(i) - set(rows))}
        return {j: crease for j, crease in found.items() if crease is not None}

    def between(self, first: int, second: int) -> Crease | None:
        """The crease of two rows; None when they have none."""
        return self._pairs.get(pair_of(first, second))

    def sign(self, first: int, second: int) -> int:
        """1 for two rows with a convex edge, -1 with a concave one, 0 with none."""
        crease = self.between(first, second)
        return crease.sign if crease else 0

    def behind(self, row: int) -> dict[int, int]:
        """The rows across the edges of a row's sheet, mapped to the sign of the edge.

        The sheet is the row and its neighbours. Where several of them are creased with the same
        row, the sign is that of the row itself, else of the lowest neighbour.
        """
        neighbours, signs = self._neighbours[row], dict[int, int]()
        for i in (row, *sorted(neighbours)):
            for j in self.of(i) - signs.keys():
                signs[j] = self.sign(i, j)
        return {j: sign for j, sign in signs.items() if j != row and j not in neighbours}

    def enter(self, first: int, second: int, crease: Crease) -> None:
        """Set the crease of two rows."""
        self._pairs[pair_of(first, second)] = crease
        self._partners.setdefault(first, set()).add(second)
        self._partners.setdefault(second, set()).add(first)

    def drop(self, first: int, second: int) -> None:
        """Remove the crease of two rows."""
        del self._pairs[pair_of(first, second)]
        self._partners[first].discard(second)
        self._partners[second].discard(first)

    def forget(self, rows: Iterable[int]) -> None:
        """Remove all creases of rows that are removed."""
        for i in rows:
            for j in list(self.of(i)):
                self.drop(i, j)
            self._partners.pop(i, None)
