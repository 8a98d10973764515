"""Intersections: points that lie on several patches and planes, by Newton's method."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable

# Largest distance from a patch at which its polynomial is evaluated, in patch radii; it is fitted
# to the surface alone. Doubled, distances are taken from other branches of its zero set.
HEIGHT_LIMIT = 0.5
# Longest step, in the smallest of the patch radii. Doubled, a step may leave the place where the
# polynomials hold.
_LONGEST = 0.5
# Largest number of steps, and the length of the last step in the smallest of the patch radii: the
# error then is about its square. Doubled, nothing changes but rounding.
_STEPS, _CONVERGED = 8, 1e-7
# Steps of a lift. It starts at most a quarter of the radius from the patch, and each step about
# squares the error, relative to the radius of curvature. Doubled, it takes twice the time.
_LIFT_STEPS = 3
# Least slope of F along a line, so that no step is infinite: the sine of 12 degrees. Doubled, lifts
# to steep patches converge more slowly.
_LEAST_SLOPE = 0.2
# Term on the diagonal of the system of unit normals, for normals that are parallel within rounding.
# Doubled, nothing changes.
_SINGULAR = 1e-12


@dataclass(frozen=True, eq=False)
class Intersection:
    """Points, and k patches evaluated at each of them.

    Parameters
    ----------
    points : (m, 3) float, length, world
    distance : (m, k) float, length
        First-order distance to each patch, positive outside.
    normals : (m, k, 3) float, unit, world
    across : (m, k) float
        Distance from each patch's origin along its tangent plane, in patch radii.
    """

    points: np.ndarray
    distance: np.ndarray
    normals: np.ndarray
    across: np.ndarray


def patches_at(table: PatchTable, rows, points) -> Intersection:
    """Distances and normals of patches ``rows`` (m, k) at world points (m, 3)."""
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
    """Points that lie on k patches each, near the points where the search starts.

    Parameters
    ----------
    table : PatchTable
    rows : (m, k) int
        Patches. k and the number of planes are 3 together at most.
    points : (m, 3) float, length, world
        Start of the search.
    planes : pair of (m, q, 3) and (m, q) float, optional
        Unit normals a and levels b of planes a . x = b on which the points shall lie too.

    Returns
    -------
    Intersection
        The distances are zero within rounding where the patches intersect.

    Notes
    -----
    Newton's method with the step of least length, x - J^t (J J^t)^-1 f: Ben-Israel, A
    Newton-Raphson method for the solution of systems of equations, 1966.
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
        active = active[length > _CONVERGED * shortest_radius[active]]
        if not len(active):
            break
    return patches_at(table, rows, points)


def _newton_step(table: PatchTable, rows, points, planes) -> np.ndarray:
    """(m, 3) steps of least length from points to all of their patches and planes."""
    seen = patches_at(table, rows, points)
    jacobian, values = seen.normals, seen.distance
    if planes is not None:
        normals, levels = planes
        heights = np.einsum("mqi,mi->mq", normals, points) - levels
        jacobian = np.concatenate([jacobian, normals], axis=1)
        values = np.concatenate([values, heights], axis=1)
    transposed = jacobian.transpose(0, 2, 1)
    gram = jacobian @ transposed + _SINGULAR * np.eye(jacobian.shape[1])
    step: np.ndarray = transposed @ np.linalg.solve(gram, values[..., None])
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
        Positive where the patch lies in the direction from the point.
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
