"""The power diagram of the patches on their surface: boundary curves and corners of the cells.

Patch i has the power |x - p_i|^2 - w_i at a point x: p_i is its site, and its weight w_i is the
squared core radius. Two powers are equal on a plane, the radical plane. The boundary of two sheet
neighbours is the part of the section of the surface with that plane where no third patch has less
power. At a corner a third patch has the same power. The dual is the patch graph. Aurenhammer, Power
diagrams: properties, algorithms and applications, SIAM Journal on Computing 16, 1987.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.row_tuples import Triple, triple_of
from touchatlas.atlas.graph.sheets import SheetNeighbours, radical_parameter
from touchatlas.atlas.patches.intersect import intersect, lift, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import cross

# Places of the samples of a boundary, between the ends -1 and 1 of the chord in which two cores
# intersect. With twice as many, boundaries take twice the time.
_ALONG = np.linspace(-1.0, 1.0, 9)
# Power up to which a cell extends beyond its core, as a fraction of the weight. A hole between
# three cores is a corner up to here and a gap beyond. With a margin, the feet of a point on two
# patches cannot each lie in the cell of the other. Doubled, holes as wide as a fifth of a core pass
# for closed.
CELL_MARGIN = 0.05
# Largest distance from a patch of a point that counts as lying on it, in patch radii: rounding,
# a thousandfold. Doubled, nothing changes.
MEETS = 1e-6


@dataclass(frozen=True, eq=False)
class Boundary:
    """The curve where the cells of two patches meet.

    Parameters
    ----------
    patches : pair of int
        Patch ids, ascending.
    points : (b, 3) float, length, world
        Along the curve, midway between the two patches. There are none where the curve is shorter
        than its sampling and only its corners are known.
    gap_rms : float, length
        Root mean square distance between the two patches along the curve. It measures the error
        of the atlas from the patches alone.
    normal_gap : float, rad
        Largest angle between their normals along the curve.
    """

    patches: tuple[int, int]
    points: np.ndarray
    gap_rms: float
    normal_gap: float


def boundary_curves(table: PatchTable, first: np.ndarray, second: np.ndarray):
    """Sampled boundary curves of e pairs of patches, before third patches cut them off.

    Parameters
    ----------
    table : PatchTable
    first, second : (e,) int

    Returns
    -------
    points : (e, 9, 3) float, length, world
        On the radical plane, midway between the two patches, between the ends of the chord in
        which the two cores intersect.
    gap : (e, 9) float, length
        Height of the second patch over the first, along the normal of the first.
    angle : (e, 9) float, rad
        Angle between the two normals.
    real : (e,) bool
        Whether the two cores intersect at all.
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
    """(..., m) powers |x - p|^2 - w of rows (m,) or (..., m) at points (..., 3), length^2."""
    site = table.site[rows]
    # One coordinate at a time: numpy is slow over an axis of three.
    x, y, z = (points[..., None, i] - site[..., i] for i in range(3))
    return (x * x + y * y + z * z) - table.weight[rows]


def points_of_equal_power(table: PatchTable, rows, first, second) -> np.ndarray:
    """Points (m, 3) on patches ``rows`` (m,) where these and ``first`` and ``second`` (m,) have
    equal power, world.

    Each is the intersection of the radical axis of the three with the polynomial of the row; NaN
    where there is none within the patch radius.
    """
    normals, levels = [], []
    for others in (first, second):
        offset, square, parameter = radical_parameter(table, rows, others)
        normal = offset / np.sqrt(square)[:, None]
        normals.append(normal)
        levels.append(((table.site[rows] + parameter[:, None] * offset) * normal).sum(axis=1))
    planes = np.stack(normals, axis=1), np.stack(levels, axis=1)
    found = intersect(table, np.asarray(rows)[:, None], table.origin[rows], planes)
    heights = np.einsum("mqi,mi->mq", planes[0], found.points) - planes[1]
    largest = np.abs(np.column_stack([found.distance, heights])).max(axis=1)
    inside = (largest <= MEETS * table.radius[rows]) & (found.across[:, 0] <= 1.0)
    return np.where(inside[:, None], found.points, np.nan)


def corners_about(table: PatchTable, neighbours: SheetNeighbours, rows: Iterable[int]):
    """Corners and gaps: places where three patches that are all neighbours have equal power, and no
    neighbour of any of them has less.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    rows : iterable of int
        One of the three patches is among these.

    Returns
    -------
    triples : (m, 3) int
        Ascending rows.
    points : (m, 3) float, length, world
        On the polynomial of the last of the three.
    excess : (m,) float
        Power at the point over the largest weight of the three. Up to CELL_MARGIN the point is a
        corner of three boundaries, beyond it a gap between three cores.
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


def _cliques(neighbours: SheetNeighbours, rows: Iterable[int]) -> set[Triple]:
    """Ascending triples of rows that are all neighbours of each other, with one of ``rows``."""
    return {
        triple_of((i, j, k))
        for i in rows
        for j in neighbours[i]
        for k in neighbours[j] & neighbours[i]
        if j < k
    }
