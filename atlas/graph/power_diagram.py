"""Where patches meet: boundary curves on radical planes, corners on radical axes.

Give patch i the power |x - p_i|^2 - c_i^2, c_i its core radius. Where two powers are equal is
a plane; the boundary of two kin patches is the part of that planar section of the surface on
which no third patch has less power, and a corner is a point of it where a third has as much:
the power diagram of the patches, restricted to the surface. Its dual is the patch graph.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import cross

_ALONG = np.linspace(-1.0, 1.0, 9)
# Cells reach past their cores by this share of the squared core radius: what three cores leave
# open between them up to here is a corner, beyond it a gap. So feet of two patches on their
# common boundary cannot both fall to the other, either.
CELL_MARGIN = 0.05
# Boundary whose normals differ by more than this is a crease.
CREASE_ANGLE = np.deg2rad(30.0)
# Of Newton's method for corners: steps, and how long the last may be, in patch radii.
_NEWTON_STEPS, _SETTLED = 3, 0.1


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
    offset = table.site[second] - table.site[first]
    square = np.maximum((offset * offset).sum(axis=1), np.finfo(float).tiny)
    share = 0.5 * (1.0 + (table.weight[first] - table.weight[second]) / square)
    half_square = table.weight[first] - share * share * square
    across = table.axes[first, 2] + table.axes[second, 2]
    across = across - ((across * offset).sum(axis=1) / square)[:, None] * offset
    across /= np.sqrt((across * across).sum(axis=1))[:, None]
    along = cross(across, offset / np.sqrt(square)[:, None])
    half = np.sqrt(np.maximum(half_square, 0.0))
    base = (table.site[first] + share[:, None] * offset)[:, None] + (half[:, None] * _ALONG)[
        ..., None
    ] * along[:, None]
    lift, normals = _lift(table, np.concatenate([first, second]), base, across)
    (low, high), (normal_first, normal_second) = lift, normals
    cosine = (normal_first * normal_second).sum(axis=-1)
    gap = (high - low) * (normal_first * across[:, None]).sum(axis=-1)
    points = base + (0.5 * (low + high))[..., None] * across[:, None]
    return points, gap, np.arccos(np.clip(cosine, -1.0, 1.0)), half_square > 0


def _lift(table: PatchTable, rows, base, across):
    """Distances (2, e, b) from base points along ``across`` to the patches of the 2 e rows,
    and their unit normals (2, e, b, 3) there, world."""
    base, across = np.concatenate([base, base]), np.concatenate([across, across])[:, None]
    slope_of = (table.axes[rows] @ across.transpose(0, 2, 1)).transpose(0, 2, 1)
    lift = np.zeros(base.shape[:2])
    scaled = table.scaled_local(rows, base)
    rise = slope_of / table.radius[rows][:, None, None]
    for _ in range(2):
        height, upward = table.surface(rows, scaled)
        slope = np.maximum((upward * slope_of).sum(axis=-1), 0.2)
        step = height * table.radius[rows][:, None] / slope
        lift = lift - step
        scaled = scaled - step[..., None] * rise
    normals = upward / np.sqrt((upward**2).sum(axis=-1))[..., None] @ table.axes[rows]
    half = len(rows) // 2
    shape = (2, half, base.shape[1])
    return lift.reshape(shape), normals.reshape(*shape, 3)


def power_at(table: PatchTable, rows, points) -> np.ndarray:
    """(..., m) power |x - p|^2 - c^2 of the rows (m,), or (..., m), at world points (..., 3)."""
    offset = points[..., None, :] - table.site[rows]
    return (offset * offset).sum(axis=-1) - table.weight[rows]


def corners_on(table: PatchTable, rows, first, second) -> np.ndarray:
    """Points (m, 3) of the surfaces of rows (m,) with equal power to row, first and second.

    The radical axis of the three, cut with the polynomial of the row by Newton's method; NaN
    where they do not meet within the patch radius.
    """
    radius, turned = table.radius[rows], table.axes[rows].transpose(0, 2, 1)

    def scaled(offset):
        return (offset[:, None] @ turned)[:, 0] / radius[:, None]

    site = scaled(table.site[rows] - table.origin[rows])
    planes, levels = [], []
    for others in (first, second):
        centre = scaled(table.site[others] - table.site[rows])
        planes.append(centre)
        excess = (table.weight[rows] - table.weight[others]) / radius**2
        levels.append(0.5 * ((centre * centre).sum(axis=1) + excess) + (centre * site).sum(axis=1))
    (a, b), (alpha, beta) = planes, levels
    axis = cross(a, b)
    point = np.zeros_like(a)
    for _ in range(_NEWTON_STEPS):
        start = np.minimum(np.maximum(point, -1.2), 1.2)
        height, normal = table.surface(rows, start[:, None])
        normal = normal[:, 0]
        level = (normal * start).sum(axis=1) - height[:, 0]
        determinant = (axis * normal).sum(axis=1)
        safe = np.where(np.abs(determinant) > 1e-9, determinant, np.nan)
        point = (
            alpha[:, None] * cross(b, normal)
            + beta[:, None] * cross(normal, a)
            + level[:, None] * axis
        ) / safe[:, None]
        point = np.where(np.isfinite(point), point, 9.0)
    # Where the axis is near tangent to the surface the steps do not settle.
    settled = ((point - start) ** 2).sum(axis=1) <= _SETTLED**2
    inside = settled & ((point[:, :2] ** 2).sum(axis=1) <= 1.0)
    point = ((point * radius[:, None])[:, None] @ table.axes[rows])[:, 0] + table.origin[rows]
    return np.where(inside[:, None], point, np.nan)


def pairs_of(rows, neighbours: list[set[int]], about=None) -> list[tuple[int, int]]:
    """All pairs (a, b), a < b, of the rows that are kin to each other; of these those with a row
    in the set ``about``, if there is one."""
    pairs = [(a, b) for a in rows for b in sorted(neighbours[a].intersection(rows)) if a < b]
    return [(a, b) for a, b in pairs if about is None or a in about or b in about]


def corners_with(
    table: PatchTable, around: dict[int, list[int]], neighbours: list[set[int]], about=None
):
    """Places where a row and two older ones of those around it have equal power and no kin of any
    of the three has less; one of the three is in the set ``about``, if there is one.

    Parameters
    ----------
    table : Table
    around : dict
        Of rows: their kin.
    neighbours : list of set of int
    about : set of int, optional

    Returns
    -------
    triples : (m, 3) int
        Ascending rows.
    points : (m, 3) float, world
    excess : (m,) float
        Power there over the largest squared core radius of the three: a corner of three
        boundaries up to CELL_MARGIN, a gap between the three cores beyond.
    """
    pairs = [
        pairs_of(
            [i for i in others if i < row],
            neighbours,
            about if about and row not in about else None,
        )
        for row, others in around.items()
    ]
    found = [(*pair, row) for row, some in zip(around, pairs, strict=True) for pair in some]
    if not found:
        return np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros(0)
    which = np.repeat(np.arange(len(pairs)), [len(some) for some in pairs])
    first, second, rows = np.array(found).T
    points = corners_on(table, rows, first, second)
    near = ~np.isnan(points[:, 0])
    first, second, rows, points = first[near], second[near], rows[near], points[near]
    own = power_at(table, rows[:, None], points)[:, 0]
    width = max(map(len, around.values()))
    rivals = [[*others, *[row] * (width - len(others))] for row, others in around.items()]
    others = np.array(rivals)[which[near]]
    rival = power_at(table, others, points)
    rival[(others == first[:, None]) | (others == second[:, None])] = np.inf
    lowest = own <= rival.min(axis=1)
    triples = np.stack([first, second, rows], axis=1)
    for k in np.flatnonzero(lowest):
        i, j, row = triples[k].tolist()
        strangers = (neighbours[i] | neighbours[j]) - neighbours[row] - {row}
        if strangers:
            lowest[k] = own[k] <= power_at(table, sorted(strangers), points[k]).min()
    excess = own / table.weight[triples].max(axis=1)
    return triples[lowest], points[lowest], excess[lowest]
