"""The power diagram of the patches on their surface: boundary curves and corners of the cells.

Patch i has the power |x - p_i|^2 - w_i at a point x, p_i its site and w_i its weight, the squared
core radius. Where two powers are equal is a plane, the radical plane; the boundary of two sheet
neighbours is the part of that plane section of the surface on which no third patch has less power,
and a corner is a point of it where a third has as much. Aurenhammer, Power diagrams: properties,
algorithms and applications, SIAM Journal on Computing 16, 1987. The dual is the patch graph.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.sheets import SheetNeighbours, radical_parameter
from touchatlas.atlas.patches.intersect import intersect, lift, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import cross

# Where a boundary is sampled, between the ends of the chord in which two cores meet.
_ALONG = np.linspace(-1.0, 1.0, 9)
# Cells reach past their cores by this fraction of the weight: what three cores leave open between
# them up to here is a corner, beyond it a gap. So feet of two patches on their common boundary
# cannot both fall to the other. Doubled, holes as wide as a fifth of a core would pass for closed.
CELL_MARGIN = 0.05
# Two faces make a crease when their normals differ by more than this, rad: less, and a polynomial
# of degree four holds both. Doubled, the faces of a hexagonal bar would be one sheet.
CREASE_ANGLE = np.deg2rad(30.0)
# Patches meet that are no farther from a point than this fraction of their radii: rounding, a
# thousandfold. Doubled, nothing changes.
MEETS = 1e-6
# A corner is looked for within this many patch radii of the patch's origin: beyond one, no cell is.
_WITHIN = 1.0


@dataclass(frozen=True, eq=False)
class Boundary:
    """The planar curve where two patches meet.

    Parameters
    ----------
    patches : pair of int
        Patch ids, ascending.
    points : (b, 3) float, length, world
        Along the curve, midway between the two patches; may be empty when the curve is
        shorter than its sampling and only its corners are known.
    gap_rms : float, length
        Between the two patches along the curve: the atlas's own measure of its error.
    normal_gap : float, rad
        Largest angle between their normals along the curve.
    crease : bool
        Whether that angle is too large for one smooth sheet.
    """

    patches: tuple[int, int]
    points: np.ndarray
    gap_rms: float
    normal_gap: float
    crease: bool


def boundary_curves(table: PatchTable, first: np.ndarray, second: np.ndarray):
    """Sampled boundary curves of the pairs (first, second), before third patches cut them.

    Returns
    -------
    points : (e, 9, 3) float, world
        Midway between the two patches, on the radical plane, between the ends of the chord in
        which the two cores meet.
    gap : (e, 9) float, length
        Second patch above first along the first's normal.
    angle : (e, 9) float, rad
        Between the two normals.
    real : (e,) bool
        Whether the two cores meet at all.
    """
    offset, square, parameter = radical_parameter(table, first, second)
    half_square = table.weight[first] - parameter * parameter * square
    across = table.axes[first, 2] + table.axes[second, 2]
    across = across - ((across * offset).sum(axis=1) / square)[:, None] * offset
    across /= np.sqrt((across * across).sum(axis=1))[:, None]
    along = cross(across, offset / np.sqrt(square)[:, None])
    half = np.sqrt(np.maximum(half_square, 0.0))
    middle = table.site[first] + parameter[:, None] * offset
    base = middle[:, None] + (half[:, None] * _ALONG)[..., None] * along[:, None]
    low, high = (lift(table, rows, base, across) for rows in (first, second))
    normals = [
        _normals_at(table, rows, base + height[..., None] * across[:, None])
        for rows, height in ((first, low), (second, high))
    ]
    cosine = (normals[0] * normals[1]).sum(axis=-1)
    gap = (high - low) * (normals[0] * across[:, None]).sum(axis=-1)
    points = base + (0.5 * (low + high))[..., None] * across[:, None]
    return points, gap, np.arccos(np.clip(cosine, -1.0, 1.0)), half_square > 0


def _normals_at(table: PatchTable, rows, points) -> np.ndarray:
    """(e, b, 3) unit normals of patches (e,) at points (e, b, 3), world."""
    count = points.shape[1]
    seen = patches_at(table, np.repeat(rows, count)[:, None], points.reshape(-1, 3))
    return seen.normals.reshape(points.shape)


def power_at(table: PatchTable, rows, points) -> np.ndarray:
    """(..., m) power |x - p|^2 - w of the rows (m,), or (..., m), at world points (..., 3)."""
    offset = points[..., None, :] - table.site[rows]
    return (offset * offset).sum(axis=-1) - table.weight[rows]


def points_of_equal_power(table: PatchTable, rows, first, second) -> np.ndarray:
    """Points (m, 3) of the surfaces of rows (m,) with equal power to row, first and second.

    The radical axis of the three, cut with the polynomial of the row; NaN where they do not meet
    within the patch radius.
    """
    normals, levels = [], []
    for others in (first, second):
        offset, square, parameter = radical_parameter(table, rows, others)
        normal = offset / np.sqrt(square)[:, None]
        normals.append(normal)
        levels.append(((table.site[rows] + parameter[:, None] * offset) * normal).sum(axis=1))
    planes = np.stack(normals, axis=1), np.stack(levels, axis=1)
    found = intersect(table, np.asarray(rows)[:, None], table.origin[rows], planes)
    off = np.einsum("mqi,mi->mq", planes[0], found.points) - planes[1]
    radius = table.radius[rows]
    meets = np.abs(np.column_stack([found.distance, off])).max(axis=1) <= MEETS * radius
    inside = meets & (found.across[:, 0] <= _WITHIN)
    return np.where(inside[:, None], found.points, np.nan)


def corners_about(table: PatchTable, neighbours: SheetNeighbours, rows: Iterable[int]):
    """Places where some row and two of its neighbours, which are neighbours too, have equal power
    and no neighbour of any of the three has less.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    rows : iterable of int

    Returns
    -------
    triples : (m, 3) int
        Ascending rows.
    points : (m, 3) float, world
        On the polynomial of the last of the three.
    excess : (m,) float
        Power there over the largest weight of the three: a corner of three boundaries up to
        CELL_MARGIN, a gap between the three cores beyond.
    """
    triples = np.array(sorted(_cliques(neighbours, rows)), int).reshape(-1, 3)
    points = points_of_equal_power(table, triples[:, 2], triples[:, 0], triples[:, 1])
    near = ~np.isnan(points[:, 0])
    triples, points = triples[near], points[near]
    own = power_at(table, triples[:, 2:], points)[:, 0]
    lowest = np.ones(len(triples), bool)
    for column in range(3):
        rivals = neighbours.lines()[triples[:, column]]
        power = power_at(table, rivals, points)
        power[(rivals[:, :, None] == triples[:, None]).any(axis=2)] = np.inf
        lowest &= own <= power.min(axis=1, initial=np.inf)
    excess = own / table.weight[triples].max(axis=1, initial=0.0)
    return triples[lowest], points[lowest], excess[lowest]


def _cliques(neighbours: SheetNeighbours, rows: Iterable[int]) -> set[tuple[int, int, int]]:
    """Ascending triples of rows that are all neighbours of each other, one of them given."""
    found = set()
    for i in rows:
        beside = sorted(neighbours[i])
        for j in beside:
            for k in neighbours[j] & neighbours[i]:
                if j < k:
                    low, middle, high = sorted((i, j, k))
                    found.add((low, middle, high))
    return found
