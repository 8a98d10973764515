"""Where patches meet: points on several of them at once, by Newton's method."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable

# One step goes no farther than this share of the smallest patch radius.
_LONGEST = 0.5
_STEPS = 8
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
    longest = _LONGEST * table.radius[rows].min(axis=1, initial=np.inf)
    for _ in range(_STEPS):
        seen = patches_at(table, rows, points)
        rises, values = seen.normals, seen.distance
        if planes is not None:
            normals, levels = planes
            off = np.einsum("mqi,mi->mq", normals, points) - levels
            rises = np.concatenate([rises, normals], axis=1)
            values = np.concatenate([values, off], axis=1)
        square = rises @ rises.transpose(0, 2, 1) + _SINGULAR * np.eye(rises.shape[1])
        step = (rises.transpose(0, 2, 1) @ np.linalg.solve(square, values[..., None]))[..., 0]
        length = np.sqrt((step * step).sum(axis=1))
        share = longest / np.maximum(length, longest)
        points = points - share[:, None] * step
    return patches_at(table, rows, points)
