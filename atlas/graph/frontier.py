"""The frontier: touched points and patch outlines that no core covers yet."""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, on_sheet
from touchatlas.atlas.patches.patch_table import PatchTable

# Beyond this, in patch radii, a polynomial says nothing about whose sheet a sample is of.
_REACH = 1.2


class Frontier:
    """Touched points that lie in no core, kept compact as cores are added.

    Attributes
    ----------
    points, normals : (n, 3) float, world
        Uncovered samples, with the outward normal that their own touch gave.
    home : (n,) int
        Patch whose touch brought them.
    depth : (n,) float, > 1
        Least distance to a kin patch's centre over its core radius: how far out they lie.
    """

    def __init__(self) -> None:
        self.points = np.zeros((0, 3))
        self.normals = np.zeros((0, 3))
        self.home = np.zeros(0, int)
        self.depth = np.zeros(0)

    def __len__(self) -> int:
        return len(self.home)

    def cover(self, table: PatchTable, row: int, apart: Iterable[int] = ()) -> None:
        """Drop the samples of its sheet that the core of ``row`` covers: none of those that are
        at home at the rows ``apart``, across an edge."""
        offset = self.points - table.site[row]
        share = np.sqrt((offset * offset).sum(axis=1) / table.weight[row])
        near = np.flatnonzero(share < _REACH / table.core)
        near = near[~np.isin(self.home[near], list(apart))]
        near = near[on_sheet(table, np.array([row]), self.points[near], self.normals[near])[0]]
        depth = self.depth.copy()
        depth[near] = np.minimum(depth[near], share[near])
        self._keep(depth > 1.0, depth)

    def extend(self, table: PatchTable, row: int, neighbours: np.ndarray, points, normals) -> None:
        """Add those of the new samples of ``row`` that neither it nor its kin cover."""
        rows = np.append(neighbours, row)
        offset = points[:, None, :] - table.site[rows]
        depth = np.sqrt(((offset * offset).sum(axis=-1) / table.weight[rows]).min(axis=1))
        out = depth > 1.0
        self.points = np.concatenate([self.points, points[out]])
        self.normals = np.concatenate([self.normals, normals[out]])
        self.home = np.concatenate([self.home, np.full(int(out.sum()), row)])
        self.depth = np.concatenate([self.depth, depth[out]])

    def visit(self, point, normal, distance: float) -> None:
        """Drop the samples about a point that was touched: it needs no second visit."""
        offset = self.points - point
        there = (offset * offset).sum(axis=1) <= distance**2
        self._keep(~(there & (self.normals @ normal >= SHEET_COSINE)), self.depth)

    def move_home(self, table: PatchTable, rows: list[int], row: int) -> None:
        """The samples of rows that are no more are at home at ``row``, as far as it does not cover
        them."""
        moved = np.isin(self.home, rows)
        self.home[moved] = row
        offset = self.points[moved] - table.site[row]
        depth = self.depth.copy()
        share = np.sqrt((offset * offset).sum(axis=1) / table.weight[row])
        depth[moved] = np.minimum(depth[moved], share)
        self._keep(depth > 1.0, depth)

    def _keep(self, keep: np.ndarray, depth: np.ndarray) -> None:
        self.points, self.normals = self.points[keep], self.normals[keep]
        self.home, self.depth = self.home[keep], depth[keep]
