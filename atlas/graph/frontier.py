"""The frontier: touched points that no core of their sheet covers.

Which samples the owner and its sheet neighbours leave uncovered follows from sites and weights
alone: it is worked out when it is asked for, and kept until these change. Whether another patch of
the sheet covers one of these follows from its polynomial, and is asked anew each time.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.normal_equations import on_sheet_of_each
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership


class Frontier:
    """Samples that lie in no core of their sheet.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    creases : Creases
    membership : SampleMembership
    """

    def __init__(
        self,
        table: PatchTable,
        neighbours: SheetNeighbours,
        creases: Creases,
        membership: SampleMembership,
    ) -> None:
        self._table, self._neighbours = table, neighbours
        self._creases, self._membership = creases, membership
        self._depth, self._owner = np.zeros(0), np.zeros(0, np.int32)
        self._stale: set[int] = set()

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Samples of rows, and of their neighbours, are to be judged again."""
        self._stale |= self._neighbours.around(rows)

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def samples(self) -> np.ndarray:
        """(n,) indices of the samples: neither covered nor at an edge, and not visited in vain."""
        found = self.candidates()
        return found[self.is_open(found)]

    def candidates(self) -> np.ndarray:
        """(n,) indices of the samples that their owners and its neighbours do not cover."""
        self._refresh()
        pool = self._membership.pool
        # On an edge itself no patch should have its centre: half of it would be beyond.
        return np.flatnonzero((self._depth[: len(pool)] > 1.0) & ~pool.edges & ~pool.visited)

    def is_open(self, index) -> np.ndarray:
        """(n,) whether no core of a patch that the samples ``index`` (n,) may be of covers them."""
        table, pool = self._table, self._membership.pool
        rows, which = table.index.near(pool.points[index])
        covers = power_at(table, rows[:, None], pool.points[index[which]])[:, 0] <= 0.0
        rows, which = rows[covers], which[covers]
        sample = index[which]
        alike = on_sheet_of_each(table, rows, pool.points[sample], pool.normals[sample])
        across = [
            row in self._creases.of(home)
            for row, home in zip(rows.tolist(), self._owner[sample].tolist(), strict=True)
        ]
        out = np.ones(len(index), bool)
        out[which[alike & ~np.array(across, bool)]] = False
        return out

    def owners(self, index) -> np.ndarray:
        """(n,) the patches whose touches brought samples."""
        return self._owner[index]

    def depth(self, index) -> np.ndarray:
        """(n,) least distance of samples to the site of their owner, or of a neighbour of it, over
        its core radius."""
        return self._depth[index]

    def _refresh(self) -> None:
        pool, owned = self._membership.pool, self._membership.owned
        if missing := max(0, len(pool) - len(self._depth)):
            room = max(missing, len(self._depth) // 8)
            self._depth = np.concatenate([self._depth, np.zeros(room)])
            self._owner = np.concatenate([self._owner, np.zeros(room, np.int32)])
        for row in self._stale:
            if row in self._table.index and len(index := owned[row]):
                self._owner[index] = row
                self._depth[index] = self._depth_of(row, pool.points[index])
        self._stale.clear()

    def _depth_of(self, row: int, points) -> np.ndarray:
        """(n,) how far out points (n, 3), brought by touches of a row, lie."""
        table = self._table
        rows = [row, *(self._neighbours[row] - self._creases.of(row))]
        offset = points[:, None] - table.site[rows]
        square = (offset * offset).sum(axis=2) / table.weight[rows]
        return np.asarray(np.sqrt(square.min(axis=1)))
