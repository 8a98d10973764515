"""The cubes of a lattice that the surface passes, and its side at their corners.

Every patch names the cubes that its core passes; two steps of a flood fill through crossed faces
add what is between them.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.blend import Field, owners
from touchatlas.atlas.field.blend_at_edges import nearest_at_edges, own_beyond_edges
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.mesh.marching_cubes import corners_of, crossed_neighbours, key, unkey
from touchatlas.atlas.patches.patch_table import PatchTable

# Points of a core, in edges apart over its tangent plane: no more than one on a slope of 45
# degrees. And how often the cubes grow beyond those that hold such a point.
_APART, _FLOODS = 0.7, 2
# Newton steps onto a patch, its least slope there, and how many points are moved at once.
_NEWTON_STEPS, _LEAST_UPRIGHT, _AT_ONCE = 3, 0.2, 2048
# Patches farther than this from a corner, in edges, are not considered there: a cube's diagonal is
# 1.7. Doubled, nothing but time.
REACH = 2.0


@dataclass(frozen=True, eq=False)
class Corners:
    """What is known at corners of the lattice.

    Parameters
    ----------
    keys : (g,) int
        Ascending.
    values : (g,) float, length
        Signed distance; NaN where no patch knows the surface.
    owners : (g,) int
        The patch in whose cell the foot lies; -1 where unknown.
    """

    keys: np.ndarray
    values: np.ndarray
    owners: np.ndarray

    def at(self, keys) -> np.ndarray:
        """Where keys (...) stand; all of them must be there."""
        return np.searchsorted(self.keys, keys)

    def has(self, keys) -> np.ndarray:
        """Whether keys (...) are there."""
        if not len(self.keys):
            return np.zeros(np.shape(keys), bool)
        return self.keys[np.minimum(self.at(keys), len(self.keys) - 1)] == keys

    def joined(self, other: "Corners") -> "Corners":
        """These and others, of other keys."""
        at, pairs = self.at(other.keys), zip(vars(self).values(), vars(other).values(), strict=True)
        return Corners(*(np.insert(column, at, new) for column, new in pairs))


def core_cubes(table: PatchTable, rows, start, edge: float) -> np.ndarray:
    """(c,) keys of the cubes that the cores of some rows pass, ascending."""
    rows, core = np.asarray(rows, int), table.core * np.sqrt(1.0 + COVER_MARGIN)
    counts = np.ceil(core * table.radius[rows] / (_APART * edge)).astype(int)
    found = [np.zeros(0, np.int64)]
    for count in np.unique(counts).tolist():
        side = core / count * np.arange(-count, count + 1)
        flat = np.stack(np.meshgrid(side, side, [0.0]), axis=-1).reshape(-1, 3)
        flat = flat[(flat * flat).sum(axis=1) <= core * core]
        alike, step = rows[counts == count], 1 + _AT_ONCE // len(flat)
        for first in range(0, len(alike), step):
            some = alike[first : first + step]
            points = _on_patches(table, some, np.tile(flat, (len(some), 1, 1)), core)
            found.append(np.unique(key(np.floor((points - start) / edge).astype(np.int64))))
    return np.unique(np.concatenate(found))


def _on_patches(table: PatchTable, rows, scaled, core: float) -> np.ndarray:
    """World points (m, k, 3) of the patches over scaled points (m, k, 3) of tangent planes."""
    for _ in range(_NEWTON_STEPS):
        height, upward = table.surface(rows, scaled)
        # A patch is no steeper than this where it claims to cover.
        scaled[..., 2] -= height / np.maximum(upward[..., 2], _LEAST_UPRIGHT)
        scaled[..., 2] = np.clip(scaled[..., 2], -core, core)
    origin, radius = table.origin[rows][:, None], table.radius[rows][:, None, None]
    return scaled * radius @ table.axes[rows] + origin


def find_cubes(field: Field, first, start, edge: float):
    """Cubes that the surface may pass, from the cubes of all cores ``first`` (c,).

    Returns
    -------
    cubes : (c,) int
        Keys of those with a corner that is known, ascending.
    corners : Corners
        Of these cubes.
    """
    cubes, fresh = first, first
    corners = Corners(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))
    for flood in range(_FLOODS + 1):
        needed = corners_of(fresh)
        corners = corners.joined(ask(field, np.unique(needed[~corners.has(needed)]), start, edge))
        if flood < _FLOODS:
            inside = corners.values[corners.at(needed)]
            whole = ~np.isnan(inside).any(axis=1)
            fresh = np.unique(crossed_neighbours(fresh[whole], inside[whole] < 0.0))
            fresh = np.setdiff1d(fresh, cubes, assume_unique=True)
            cubes = np.union1d(cubes, fresh)
    values = corners.values[corners.at(corners_of(cubes))]
    return cubes[~np.isnan(values).all(axis=1)], corners


def ask(field: Field, keys, start, edge: float) -> Corners:
    """The corners of some keys (g,), ascending, by the patches that own them."""
    graph = field.graph
    points = unkey(keys) * edge + start
    values, patch = np.full(len(keys), np.nan), np.full(len(keys), -1)
    rows, which = field.table.index.near(points)
    distance, normals, covers = field.distances(
        rows, points[which], REACH * edge, False, plain=True
    )
    feet, own = points[which] - distance[:, None] * normals, covers
    if graph.creases:
        own = graph.visibility.sees(rows, feet, covers)
    starts, sizes, owner, is_owned = owners(rows, which, distance, own)
    if graph.creases:
        feet[~covers] = np.nan
        own_beyond_edges(graph, rows, starts, sizes, distance, feet, owner, is_owned)
    patch[which[starts][is_owned]] = owner[is_owned]
    mine = rows == patch[which]
    values[which[mine]] = distance[mine]
    return Corners(keys, values, patch)


def extend(field: Field, at, corners: Corners, start, edge: float) -> Corners:
    """The corners, with values at those that no patch knows: of a patch that owns another corner of
    the same cube, the one that puts the surface nearest.

    ``at`` (c, 8) tells where among the corners those of the cubes stand.
    """
    at = at[(corners.owners[at] < 0).any(axis=1)]
    if not len(at):
        return corners
    owner = corners.owners[at]
    cube, corner = np.nonzero(owner < 0)
    who = owner[cube]
    pairs = np.repeat(at[cube, corner], who.shape[1])[who.ravel() >= 0]
    who, size = who[who >= 0], field.table.size
    pairs, who = np.divmod(np.unique(pairs * size + who), size)
    points = unkey(corners.keys[pairs]) * edge + start
    distance, _, _ = field.distances(who, points, plain=True)
    if field.graph.creases:
        keep = nearest_at_edges(field.graph.creases, who, pairs, distance)
        pairs, who, distance = pairs[keep], who[keep], distance[keep]
    order = np.lexsort((who, np.abs(distance), pairs))
    pairs, first = np.unique(pairs[order], return_index=True)
    values, owner = corners.values.copy(), corners.owners.copy()
    values[pairs] = distance[order][first]
    owner[pairs] = who[order][first]
    return Corners(corners.keys, values, owner)
