"""Partition of unity: one signed distance, with normal and deviation, from many patches.

The distances at a point to the patches of one sheet are averaged. Weights fall with the distance
from a patch's origin and with its variance. The sheet is that of the owner of the point: the
nearest patch among those whose cell contains the foot of the point. So the far side of a thin wall
is never averaged with the near side.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from touchatlas.atlas.field.padded_groups import runs
from touchatlas.atlas.field.patch_values import PatchValues, distances, patch_values
from touchatlas.atlas.graph.sheets import same_sheet
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import frozen_array

# Number of points in one numpy call. Doubled, a call takes twice the memory.
_AT_ONCE = 1 << 14


@dataclass(frozen=True, eq=False)
class Blend:
    """The blended surface at n query points.

    Parameters
    ----------
    distance : (n,) float, length
        First-order distance, positive outside; NaN where unknown, as are the next three.
    known : (n,) bool
        Whether a patch covers the surface near the point.
    normal : (n, 3) float, unit, world
        Outward.
    deviation : (n,) float, length
        Predicted standard deviation of the surface along the normal.
    gaussian_curvature : (n,) float, 1/length^2
    patch : (n,) int
        Owner: the patch in whose cell the foot of the point lies; -1 where unknown.
    """

    distance: np.ndarray
    known: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    gaussian_curvature: np.ndarray
    patch: np.ndarray

    def some(self, index) -> "Blend":
        """The same at some of the points."""
        return Blend(*(column[index] for column in vars(self).values()))

    def without(self, index) -> "Blend":
        """The same, unknown at the points of indices (k,)."""
        if not len(index):
            return self
        columns = {name: column.copy() for name, column in vars(self).items()}
        for name, column in columns.items():
            column[index] = {"known": False, "patch": -1}.get(name, np.nan)
        return Blend(**columns)


class Gaps(Protocol):
    """What is known where no patch knows the surface."""

    @property
    def samples(self) -> np.ndarray:
        """(k, 3) samples, length, world."""

    def are_covered(self, patch, feet) -> np.ndarray:
        """See ``touchatlas.atlas.faces.gaps``."""

    def at(self, points, reach: float = np.inf) -> tuple[np.ndarray, ...]:
        """See ``touchatlas.atlas.faces.gaps``."""


class Field:
    """The blended surface of the patches. Mesh, CAD, planner and evaluation read the surface here.

    Parameters
    ----------
    table : PatchTable
    graph : SurfaceGraph
    gaps : Gaps, optional
        What is known where no patch knows the surface.

    Notes
    -----
    The time for a point depends on the number of patches that reach it, not on that of all.
    """

    def __init__(self, table: PatchTable, graph: SurfaceGraph, gaps: Gaps | None = None) -> None:
        self.table, self.graph, self.gaps = table, graph, gaps

    def at(self, points, reach: float = np.inf, curved: bool = True) -> Blend:
        """Blend of all patches at world points (n, 3).

        Parameters
        ----------
        points : (n, 3) float, length, world
        reach : float, length
            Patches farther than this from a point are not evaluated there.
        curved : bool
            Whether to compute the curvature; else it is NaN.

        Raises
        ------
        ValueError
            If the points are not finite or not (n, 3).
        """
        points = frozen_array(points, (None, 3), "points")
        count = len(points)
        out, patch = np.full((count, 6), np.nan), np.full(count, -1)
        if self.table.size:
            for first in range(0, count, _AT_ONCE):
                some = slice(first, first + _AT_ONCE)
                out[some], patch[some] = self._means(points[some], reach, curved)
        normal = out[:, 3:] / np.sqrt((out[:, 3:] ** 2).sum(axis=1))[:, None]
        blend = Blend(out[:, 0], patch >= 0, normal, np.sqrt(out[:, 1]), out[:, 2], patch)
        self._fill_gaps(points, reach, blend)
        return blend

    def _fill_gaps(self, points, reach: float, blend: Blend) -> None:
        """Fill in what is known of points (n, 3) that no patch knows."""
        if self.gaps is None:
            return
        feet = points - blend.distance[:, None] * blend.normal
        blank = np.flatnonzero(~self.gaps.are_covered(blend.patch, feet))
        if not len(blank):
            return
        which, distance, deviation, normal, curvature, patch = self.gaps.at(points[blank], reach)
        at = blank[which]
        blend.distance[at], blend.deviation[at], blend.normal[at] = distance, deviation, normal
        blend.gaussian_curvature[at], blend.patch[at], blend.known[at] = curvature, patch, True

    def of_patches(self, rows, points, reach: float = np.inf, curved: bool = True) -> PatchValues:
        """Values of single patches ``rows`` (m,) at world points (m, 3), one patch for each."""
        return patch_values(self.table, self.graph, rows, points, reach, curved)

    def distances(self, rows, points, reach: float = np.inf, plain: bool = False):
        """Distance, normal, and whether the foot is in the patch's cell, for the same pairs: see
        ``patch_values.distances``."""
        return distances(self.table, self.graph, rows, points, reach, plain)

    def _means(self, points, reach: float, curved: bool):
        """Means (n, 6) of distance, variance, curvature and normal over the patches on the sheet
        of each point's owner, and the owners (n,); NaN and -1 without an owner."""
        graph = self.graph
        out, patch = np.full((len(points), 6), np.nan), np.full(len(points), -1)
        rows, which = self.table.index.near(points)
        if not len(rows):
            return out, patch
        found = self.of_patches(rows, points[which], reach, curved)
        starts, sizes, owner, is_owned = owners(rows, which, found.distance, found.own)
        weight = found.weight * same_sheet(graph.neighbours, np.repeat(owner, sizes), rows)
        total = np.add.reduceat(weight, starts)
        is_owned &= total > 0.0
        means = np.add.reduceat(found.numbers * weight[:, None], starts, axis=0)
        at = which[starts][is_owned]
        out[at] = means[is_owned] / total[is_owned, None]
        patch[at] = owner[is_owned]
        return out, patch


def owners(rows, which, distance, own):
    """The nearest patch of each point among those whose cell contains its foot.

    Parameters
    ----------
    rows, which : (m,) int
        Pairs of a patch and a point, sorted by point.
    distance : (m,) float, length
    own : (m,) bool
        Whether the foot of the point lies in the cell of the patch.

    Returns
    -------
    starts, sizes : (n,) int
        Index of the first pair of each point, and number of its pairs.
    owner : (n,) int
        Valid where ``is_owned``.
    is_owned : (n,) bool
        Whether there is such a patch.
    """
    starts, sizes = runs(which)
    rank = np.where(own, np.abs(distance), np.inf)
    least = np.minimum.reduceat(rank, starts) if len(starts) else rank
    first = np.flatnonzero(rank == np.repeat(least, sizes))
    place = np.repeat(np.arange(len(starts)), sizes)[first]
    owner = np.empty(len(starts), np.int64)
    # Where distances are equal, the patch with the lowest row is written last.
    owner[place[::-1]] = rows[first[::-1]]
    return starts, sizes, owner, np.isfinite(least)
