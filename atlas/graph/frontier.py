"""Frontier: samples that no core of their sheet covers.

Which samples the owner and its sheet neighbours do not cover follows from sites and weights alone:
it is computed when it is read, and kept until these change. Whether another patch of the sheet
covers one of them depends on that patch's polynomial, and is computed at each reading.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.growing_array import grown
from touchatlas.atlas.patches.normal_equations import on_sheet_of_each
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership


class Frontier:
    """The samples in no core of their sheet: new touches there extend the surface.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    membership : SampleMembership
    """

    def __init__(
        self,
        table: PatchTable,
        neighbours: SheetNeighbours,
        membership: SampleMembership,
    ) -> None:
        self._table, self._neighbours, self._membership = table, neighbours, membership
        self._depth, self._owner = np.zeros(0), np.zeros(0, np.int32)
        self._stale: set[int] = set()

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Rows changed: compute the depths of their samples, and of their neighbours', again."""
        self._stale |= self._neighbours.around(rows)

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def samples(self) -> np.ndarray:
        """(n,) indices of the samples that no core covers, without edge ends and visited ones."""
        found = self.candidates()
        return found[self.is_open(found)]

    def candidates(self) -> np.ndarray:
        """(n,) indices of the samples that neither the owner nor its neighbours cover."""
        self._refresh()
        pool = self._membership.pool
        # A patch centred on an edge would lie half beyond it.
        return np.flatnonzero((self._depth[: len(pool)] > 1.0) & ~pool.edges & ~pool.visited)

    def is_open(self, index) -> np.ndarray:
        """(n,) whether samples ``index`` (n,) lie in no core of any patch of their sheet."""
        table, pool = self._table, self._membership.pool
        rows, which = table.index.near(pool.points[index])
        covers = power_at(table, rows[:, None], pool.points[index[which]])[:, 0] <= 0.0
        rows, which = rows[covers], which[covers]
        sample = index[which]
        alike = on_sheet_of_each(table, rows, pool.points[sample], pool.normals[sample])
        out = np.ones(len(index), bool)
        out[which[alike]] = False
        return out

    def owners(self, index) -> np.ndarray:
        """(n,) the owners of samples ``index`` (n,)."""
        return self._owner[index]

    def depth(self, index) -> np.ndarray:
        """(n,) least ratio of distance and core radius, over the owner of each sample ``index``
        (n,) and the owner's neighbours, as of the last ``candidates``."""
        return self._depth[index]

    def _refresh(self) -> None:
        """Compute depths and owners of the samples of stale rows."""
        pool, owned = self._membership.pool, self._membership.owned
        self._depth, self._owner = (grown(a, len(pool)) for a in (self._depth, self._owner))
        rows = sorted(row for row in self._stale if row in self._table.index)
        self._stale.clear()
        index = np.concatenate([np.zeros(0, np.int32), *(owned[row] for row in rows)])
        owner = np.repeat(np.array(rows, np.int32), [len(owned[row]) for row in rows])
        self._owner[index] = owner
        self._depth[index] = self._depth_of(owner, pool.points[index])

    def _depth_of(self, owner, points) -> np.ndarray:
        """(n,) least ratio of distance and core radius of points (n, 3) of owners (n,)."""
        # Neighbours are never across an edge.
        lines = np.column_stack([self._neighbours.lines()[owner], owner])
        offset = points[:, None] - self._table.site[lines]
        square = (offset * offset).sum(axis=2) / self._table.weight[lines]
        return np.sqrt(square.min(axis=1, initial=np.inf))
