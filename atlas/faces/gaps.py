"""Gaps: what faces say of places that no patch knows.

Patches end before a sharp edge, because no polynomial holds across it. The faces on both sides are
known up to it, from the same samples.
"""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.labels import NONE
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_hull import DIRECTIONS, along
from touchatlas.atlas.patches.sample_membership import SampleMembership

# Distance from all samples up to which faces are believed where no patch is, over the extent.
# Doubled, one filled place in ten is wrong instead of one in twenty while little is known.
_REACH = 0.02
# Nearest patches of which one that faces as a place does is taken. Doubled, nothing changes.
_NEAREST = 8
# Least cosine between the normals of a place and of its patch: 60 degrees. Doubled, the nearest
# patch of the same side of an edge is not always taken.
_FACING = 0.5
# Least number of samples of a face besides those of another for which a patch is of both. Doubled,
# patches reach farther over edges.
_OTHERS = 6


class Gaps:
    """What faces say of places that no patch knows.

    Parameters
    ----------
    body : LawfulBody
        Of faces of any kind, some of which obey laws.
    table : PatchTable
    membership : SampleMembership
        The samples that patches are fitted to.
    """

    def __init__(self, body: LawfulBody, table: PatchTable, membership: SampleMembership) -> None:
        self._body, self._table, self._membership = body, table, membership
        # Extents of the samples of each patch, as they are asked for.
        self._extents = np.full((table.size, DIRECTIONS), np.nan)
        self._rows = table.rows
        self._sharp = np.zeros((len(body.faces), len(body.faces)), bool)
        for edge in body.faces.edges:
            if edge.kind.sharp and edge.radius == 0.0:
                self._sharp[edge.first, edge.second] = self._sharp[edge.second, edge.first] = True
        self._tree = cKDTree(table.origin[self._rows])

    @property
    def samples(self) -> np.ndarray:
        """(k, 3) the samples of the faces, length, world."""
        return self._body.samples.points

    def are_covered(self, patch, feet) -> np.ndarray:
        """(n,) whether feet (n, 3) lie in the cores of patches (n,), -1 for none, and among their
        samples: beyond an edge that no sample shows a core goes on."""
        offset = feet - self._table.site[patch]
        out = (patch >= 0) & ((offset * offset).sum(axis=1) <= self._table.weight[patch])
        rows = patch[out]
        for row in np.unique(rows[np.isnan(self._extents[rows, 0])]).tolist():
            self._extents[row] = self._extent(row)
        out[out] = (along(self._table, rows, feet[out]) <= self._extents[rows]).all(axis=1)
        return np.asarray(out)

    def at(self, points, reach: float = np.inf) -> tuple[np.ndarray, ...]:
        """What faces say of points (n, 3) where they are known, and no farther than ``reach`` from
        them, length.

        Returns
        -------
        which : (m,) int
            The points that are known.
        distance, deviation : (m,) float, length
        normal : (m, 3) float, unit, world
        curvature : (m,) float, 1/length^2
            Gaussian.
        patch : (m,) int
            The nearest patch that faces as the surface does.
        """
        body = self._body
        near = np.flatnonzero(body.away(points) <= _REACH * body.extent + min(reach, body.reach))
        found, known = body.at(points[near])
        off = np.abs(found.distance)
        known &= body.away(points[near]) <= _REACH * body.extent + off
        known[known] = body.is_explained(points[near[known]])
        which, found = near[known], found.some(known)
        feet = points[which] - found.distance[:, None] * found.normal
        curvature = body.gaussian_curvature(feet, found.face)
        patch = self._patches(feet, found.normal)
        return which, found.distance, found.deviation, found.normal, curvature, patch

    def _extent(self, row: int) -> np.ndarray:
        """(24,) extents of the samples of a patch in its tangent plane, length; minus infinity
        where they are of two faces that meet at a sharp edge, which the patch rounds off."""
        faces, fitted = self._body.faces, self._membership.fitted[row]
        of = faces.of[fitted[fitted < len(faces.of)]]
        count = np.bincount(of[of != NONE], minlength=len(faces))
        present = np.flatnonzero(count >= _OTHERS)
        if self._sharp[np.ix_(present, present)].any():
            return np.full(DIRECTIONS, -np.inf)
        samples = self._membership.pool.points[fitted]
        out: np.ndarray = along(self._table, row, samples).max(axis=0, initial=-np.inf)
        return out

    def _patches(self, points, normals) -> np.ndarray:
        """(m,) the nearest patches of points (m, 3) that face as normals (m, 3) do; where none of
        the nearest does, the one that comes closest to it."""
        count = min(_NEAREST, len(self._rows))
        _, near = self._tree.query(points, k=count)
        rows = self._rows[near.reshape(len(points), count)]
        cosine = np.einsum("nkj,nj->nk", self._table.axes[rows, 2], normals)
        faces = cosine >= _FACING
        best = np.where(faces.any(axis=1), faces.argmax(axis=1), cosine.argmax(axis=1))
        return np.asarray(rows[np.arange(len(rows)), best])
