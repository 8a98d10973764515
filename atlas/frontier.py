"""The frontier: touched points and patch outlines that no core covers yet."""

import numpy as np

from touchatlas.atlas.table import Table


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

    def cover(self, table: Table, row: int, kin_mask: np.ndarray) -> None:
        """Drop the samples that the core of ``row`` covers; ``kin_mask`` (n patches,) tells
        whose samples are of its sheet."""
        offset = self.points - table.origin[row]
        depth = np.sqrt((offset * offset).sum(axis=1) / table.power[row])
        depth = np.where(kin_mask[self.home], np.minimum(depth, self.depth), self.depth)
        self._keep(depth > 1.0, depth)

    def extend(self, table: Table, row: int, kin: np.ndarray, points, normals) -> None:
        """Add those of the new samples of ``row`` that neither it nor its kin cover."""
        rows = np.append(kin, row)
        offset = points[:, None, :] - table.origin[rows]
        depth = np.sqrt(((offset * offset).sum(axis=-1) / table.power[rows]).min(axis=1))
        out = depth > 1.0
        self.points = np.concatenate([self.points, points[out]])
        self.normals = np.concatenate([self.normals, normals[out]])
        self.home = np.concatenate([self.home, np.full(int(out.sum()), row)])
        self.depth = np.concatenate([self.depth, depth[out]])

    def discard(self, point: np.ndarray, distance: float) -> None:
        """Drop the samples within ``distance`` of a point that was tried in vain."""
        offset = self.points - point
        self._keep((offset * offset).sum(axis=1) > distance**2, self.depth)

    def _keep(self, keep: np.ndarray, depth: np.ndarray) -> None:
        self.points, self.normals = self.points[keep], self.normals[keep]
        self.home, self.depth = self.home[keep], depth[keep]
