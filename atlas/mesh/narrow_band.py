"""Narrow band: the cubes of a lattice that the surface passes, and the field at their corners.

The cubes that the core of a patch passes come first. Two steps of a flood fill through crossed
faces add the cubes between them.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.blend import Field, owners
from touchatlas.atlas.field.patch_values import COVER_MARGIN, on_wrong_side
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.mesh.marching_cubes import corners_of, crossed_neighbours, key, unkey
from touchatlas.atlas.patches.intersect import lift
from touchatlas.atlas.patches.patch_table import PatchTable

# Distance between points of a core over its tangent plane, in edges: on a slope of 45 degrees they
# are one edge apart. Doubled, cubes are missed.
_SPACING = 0.7
# Steps of the flood fill. Each adds the next cubes along the surface, and two fill the space
# between cores that overlap. Doubled, cubes are evaluated where no patch covers.
_FLOODS = 2
# Points of cores that are computed in one go, for the caches. Doubled, twice the memory.
_AT_ONCE = 2048
# Largest distance of a patch from a corner at which it is evaluated, in edges: a cube's diagonal is
# 1.7. Doubled, it takes more time and changes nothing.
REACH = 2.0
# Rounding of a point of a patch, in edges. Doubled, nothing changes.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Corners:
    """The field at corners of the lattice.

    Parameters
    ----------
    keys : (g,) int
        Keys of the corners, ascending.
    values : (g,) float, length
        Signed distance; NaN where no patch knows the surface.
    owners : (g,) int
        The patch in whose cell the foot lies; -1 where unknown.
    """

    keys: np.ndarray
    values: np.ndarray
    owners: np.ndarray

    def at(self, keys) -> np.ndarray:
        """(...) indices of keys (...), all of which must be there."""
        return np.searchsorted(self.keys, keys)

    def has(self, keys) -> np.ndarray:
        """(...) whether keys (...) are there."""
        if not len(self.keys):
            return np.zeros(np.shape(keys), bool)
        return self.keys[np.minimum(self.at(keys), len(self.keys) - 1)] == keys

    def joined(self, other: "Corners") -> "Corners":
        """These corners and others, which have no key in common."""
        at, pairs = self.at(other.keys), zip(vars(self).values(), vars(other).values(), strict=True)
        return Corners(*(np.insert(column, at, new) for column, new in pairs))


def core_cubes(table: PatchTable, rows, start, edge: float) -> np.ndarray:
    """(c,) ascending keys of the cubes that the cores of some rows pass."""
    rows, core = np.asarray(rows, int), table.core * np.sqrt(1.0 + COVER_MARGIN)
    counts = np.ceil(core * table.radius[rows] / (_SPACING * edge)).astype(int)
    found = [np.zeros(0, np.int64)]
    for count in np.unique(counts).tolist():
        side = core / count * np.arange(-count, count + 1)
        flat = np.stack(np.meshgrid(side, side, [0.0]), axis=-1).reshape(-1, 3)
        flat = flat[(flat * flat).sum(axis=1) <= core * core]
        alike, step = rows[counts == count], 1 + _AT_ONCE // len(flat)
        for first in range(0, len(alike), step):
            some = alike[first : first + step]
            at = (_on_patches(table, some, flat, core) - start) / edge
            # A flat patch may lie in a plane of the lattice, between the cubes of both sides.
            sides = [np.floor(at + side).astype(np.int64) for side in (-_ROUNDING, _ROUNDING)]
            found += [np.unique(key(side)) for side in sides]
    return np.unique(np.concatenate(found))


def _on_patches(table: PatchTable, rows, scaled, core: float) -> np.ndarray:
    """(m, k, 3) world points of patches (m,) over scaled points (k, 3) of their tangent planes."""
    radius, normal = table.radius[rows, None], table.axes[rows, 2]
    flat = scaled * radius[..., None] @ table.axes[rows] + table.origin[rows, None]
    # A point of a core is no higher than the core radius.
    height = np.clip(lift(table, rows, flat, normal), -core * radius, core * radius)
    return flat + height[..., None] * normal[:, None]


def find_cubes(field: Field, first, start, edge: float):
    """Cubes that the surface may pass, from the cubes ``first`` (c,) of all cores.

    Returns
    -------
    cubes : (c,) int
        Ascending keys of the cubes with a corner at which the field is known.
    corners : Corners
        The corners of these cubes, and of those that were dropped.
    """
    cubes, fresh = first, first
    corners = Corners(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))
    for flood in range(_FLOODS + 1):
        needed = corners_of(fresh)
        fresh_keys = np.unique(needed[~corners.has(needed)])
        corners = corners.joined(field_at_corners(field, fresh_keys, start, edge))
        if flood < _FLOODS:
            inside = corners.values[corners.at(needed)]
            whole = ~np.isnan(inside).any(axis=1)
            fresh = np.unique(crossed_neighbours(fresh[whole], inside[whole] < 0.0))
            fresh = np.setdiff1d(fresh, cubes, assume_unique=True)
            cubes = np.union1d(cubes, fresh)
    values = corners.values[corners.at(corners_of(cubes))]
    return cubes[~np.isnan(values).all(axis=1)], corners


def complete(field: Field, cubes, corners: Corners, start, edge: float):
    """Cubes (c,) and their corners, all with values, without a neighbour missing.

    A cube that a patch reaches with few of its corners has no sign there before ``extend``. Where
    it then has one, the surface may go on in a neighbour that was not flooded; without it the
    surface would have a hole. A neighbour is added where a patch owns one of its corners.
    """
    for _ in range(_FLOODS):
        corners = extend(field, corners.at(corners_of(cubes)), corners, start, edge)
        inside = corners.values[corners.at(corners_of(cubes))] < 0.0
        fresh = np.setdiff1d(crossed_neighbours(cubes, inside), cubes)
        needed = np.unique(corners_of(fresh))
        missing = needed[~corners.has(needed)]
        corners = corners.joined(field_at_corners(field, missing, start, edge))
        owned = corners.owners[corners.at(corners_of(fresh))] >= 0
        fresh = fresh[owned.any(axis=1)]
        if not len(fresh):
            return cubes, corners
        cubes = np.union1d(cubes, fresh)
    return cubes, extend(field, corners.at(corners_of(cubes)), corners, start, edge)


def field_at_corners(field: Field, keys, start, edge: float) -> Corners:
    """The corners of ascending keys (g,), each with the distance to the patch that owns it."""
    points = unkey(keys) * edge + start
    values, patch = np.full(len(keys), np.nan), np.full(len(keys), -1)
    rows, which = field.table.index.near(points)
    distance, normals, own = field.distances(rows, points[which], REACH * edge, plain=True)
    starts, _, owner, is_owned = owners(rows, which, distance, own)
    patch[which[starts][is_owned]] = owner[is_owned]
    mine = rows == patch[which]
    values[which[mine]] = distance[mine]
    if field.gaps is not None:
        foot = np.full((len(keys), 3), np.nan)
        foot[which[mine]] = (points[which] - distance[:, None] * normals)[mine]
        blank = np.flatnonzero(~field.gaps.are_covered(patch, foot))
        found, distance, *_, rows = field.gaps.at(points[blank], REACH * edge)
        values[blank[found]], patch[blank[found]] = distance, rows
    return Corners(keys, values, patch)


def extend(field: Field, at, corners: Corners, start, edge: float) -> Corners:
    """The corners, with values also where no patch owns them: the distance to that patch of least
    power which owns another corner of the same cube.

    Far from its core a polynomial has other zeros, so the least distance is no sign of the owner.
    So it has far above and below: there the height over the tangent plane tells the side.

    ``at`` (c, 8) are the indices of the cubes' corners.
    """
    at = at[(corners.owners[at] < 0).any(axis=1)]
    if not len(at):
        return corners
    owner = corners.owners[at]
    cube, corner = np.nonzero(owner < 0)
    rows = owner[cube]
    which = np.repeat(at[cube, corner], rows.shape[1])[rows.ravel() >= 0]
    rows, size = rows[rows >= 0], field.table.size
    which, rows = np.divmod(np.unique(which * size + rows), size)
    points = unkey(corners.keys[which]) * edge + start
    distance, _, _ = field.distances(rows, points, plain=True)
    scaled = field.table.scaled_local(rows, points[:, None])[:, 0]
    height = scaled[:, 2] * field.table.radius[rows]
    distance = np.where(on_wrong_side(scaled, distance), height, distance)
    order = np.lexsort((rows, power_at(field.table, rows[:, None], points)[:, 0], which))
    which, first = np.unique(which[order], return_index=True)
    values, owner = corners.values.copy(), corners.owners.copy()
    values[which] = distance[order][first]
    owner[which] = rows[order][first]
    return Corners(corners.keys, values, owner)
