"""Where patches meet: points on several patches and planes at once, by Newton's method."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable

# One step goes no farther than this fraction of the smallest patch radius: doubled, it may lead
# out of where polynomials hold.
_LONGEST = 0.5
# Steps at most; a point whose last step was shorter than this fraction of the smallest radius is
# done: the next would be of the square of that.
_STEPS, _SETTLED = 8, 1e-7
# A lift starts on a tangent plane, at most a quarter of the radius from the patch: each step about
# squares that, relative to the radius of curvature.
_LIFT_STEPS = 3
# Slopes of a patch along a line are not taken for less, so that a step is never endless.
_LEAST_SLOPE = 0.2
# Of normals that are parallel within rounding: their system is singular.
_SINGULAR = 1e-12


@dataclass(frozen=True, eq=False)
class Intersection:
    """Points (m, 3) that are looked at by k patches each.

    Parameters
    ----------
    points : (m, 3) float, length, world
    distance : (m, k) float, length
        First order, signed, to each patch.
    normals : (m, k, 3) float, unit, world
    across : (m, k) float
        Distance from each patch's origin over its tangent plane, in patch radii.
    """

    points: np.ndarray
    distance: np.ndarray
    normals: np.ndarray
    across: np.ndarray


def patches_at(table: PatchTable, rows, points) -> Intersection:
    """What patches ``rows`` (m, k) say at world points (m, 3)."""
    count, kinds = rows.shape
    flat = rows.ravel()
    scaled = table.scaled_local(flat, np.repeat(points, kinds, axis=0)[:, None])
    height, upward = table.surface(flat, scaled)
    length = np.maximum(np.sqrt((upward * upward).sum(axis=-1)), np.finfo(float).tiny)
    distance = height * table.radius[flat][:, None] / length
    normals = (upward / length[..., None]) @ table.axes[flat]
    across = np.sqrt((scaled[:, 0, :2] ** 2).sum(axis=1))
    shape = (count, kinds)
    return Intersection(
        points, distance.reshape(shape), normals.reshape(*shape, 3), across.reshape(shape)
    )


def intersect(table: PatchTable, rows, points, planes=None) -> Intersection:
    """Points on all of k patches each, nearest by first order to where they start.

    Parameters
    ----------
    table : Table
    rows : (m, k) int
        k is 1 to 3, with the planes at most 3.
    points : (m, 3) float, length, world
        Where to start.
    planes : pair of (m, q, 3) and (m, q) float, optional
        Normals a and levels b of planes a . x = b on which the points are to lie as well.

    Returns
    -------
    Meeting
        Distances that are not about zero tell of patches that do not meet.

    Notes
    -----
    Newton's method with the step of least length: x - J^t (J J^t)^-1 f.
    """
    points = np.array(points, dtype=float)
    shortest_radius = table.radius[rows].min(axis=1, initial=np.inf)
    active = np.arange(len(points))
    for _ in range(_STEPS):
        some = None if planes is None else (planes[0][active], planes[1][active])
        step = _newton_step(table, rows[active], points[active], some)
        length = np.sqrt((step * step).sum(axis=1))
        longest = _LONGEST * shortest_radius[active]
        points[active] -= (longest / np.maximum(length, longest))[:, None] * step
        active = active[length > _SETTLED * shortest_radius[active]]
        if not len(active):
            break
    return patches_at(table, rows, points)


def _newton_step(table: PatchTable, rows, points, planes) -> np.ndarray:
    """(m, 3) steps of least length from points to all of their patches and planes."""
    seen = patches_at(table, rows, points)
    rises, values = seen.normals, seen.distance
    if planes is not None:
        normals, levels = planes
        off = np.einsum("mqi,mi->mq", normals, points) - levels
        rises = np.concatenate([rises, normals], axis=1)
        values = np.concatenate([values, off], axis=1)
    square = rises @ rises.transpose(0, 2, 1) + _SINGULAR * np.eye(rises.shape[1])
    step: np.ndarray = rises.transpose(0, 2, 1) @ np.linalg.solve(square, values[..., None])
    return step[..., 0]


def lift(table: PatchTable, rows, points, directions) -> np.ndarray:
    """Distances along directions from points to patches, by Newton's method on each line.

    Parameters
    ----------
    table : PatchTable
    rows : (m,) int
    points : (m, k, 3) float, length, world
    directions : (m, 3) float, unit, world
        Outward, within about 80 degrees of the patches' normals.

    Returns
    -------
    (m, k) float, length
    """
    axes, radius = table.axes[rows], table.radius[rows]
    along = (axes @ directions[..., None])[:, None, :, 0]
    scaled, out = table.scaled_local(rows, points), np.zeros(points.shape[:2])
    for _ in range(_LIFT_STEPS):
        height, upward = table.surface(rows, scaled)
        step = height / np.maximum((upward * along).sum(axis=-1), _LEAST_SLOPE)
        scaled = scaled - step[..., None] * along
        out = out - step * radius[:, None]
    return out
