"""Partition of unity: many patches, one signed distance with its normal and deviation.

At a query point every patch of one sheet that reaches it has a say, weighted by how near
its centre is and how sure it is. Which sheet: the nearest one of those whose foot point
lies in the cell of its own patch. So a patch has no say where its kin know better, and
strangers (the far side of a thin wall) are never averaged with.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.boundary import CELL_MARGIN, power_at
from touchatlas.atlas.residual import joint_variance, residual_at
from touchatlas.atlas.table import Table
from touchatlas.patch.polynomial import (
    SECOND_ORDER,
    VALUE,
    derivative_coefficients,
    gaussian_curvature,
    graph_derivatives,
    monomials,
)

# The surface is known a little beyond what closes the graph, so that the cubes around a corner
# with just the power CELL_MARGIN are known too.
_COVER_MARGIN = 3.0 * CELL_MARGIN


@dataclass(frozen=True, eq=False)
class Blend:
    """The blended surface as seen from n query points.

    Parameters
    ----------
    distance : (n,) float, length
        Signed, first order, positive outside; NaN where unknown.
    known : (n,) bool
        Whether any patch covers the surface near the point.
    normal : (n, 3) float, unit, world
    deviation : (n,) float, length
        Predicted standard deviation of the surface along the normal.
    gaussian_curvature : (n,) float, 1/length^2
        Of the polynomials alone.
    patch : (n,) int
        The patch in whose cell the foot point lies; -1 where unknown.
    """

    distance: np.ndarray
    known: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    gaussian_curvature: np.ndarray
    patch: np.ndarray


def blend(table: Table, kin: list[set[int]], points, reach: float = np.inf) -> Blend:
    """Blend of all patches at world points (n, 3).

    Parameters
    ----------
    table : Table
    kin : list of set of int
    points : (n, 3) float, length, world
    reach : float, length
        Patches farther than this from a point are not considered there.
    """
    points = np.asarray(points, dtype=float)
    count = len(points)
    parts = []
    if table.size and count:
        tree = cKDTree(points)
        near = tree.query_ball_point(table.origin, table.radius)
        for row in range(table.size):
            if near[row]:
                part = _say(table, kin, row, points, np.array(near[row]), reach)
                if len(part[0]):
                    parts.append(part)
    if not parts:
        nothing = np.full(count, np.nan)
        return Blend(
            nothing,
            np.zeros(count, bool),
            np.full((count, 3), np.nan),
            nothing,
            nothing,
            np.full(count, -1),
        )
    where, who, numbers, normals, own = (np.concatenate(p) for p in zip(*parts, strict=True))
    order = np.lexsort((np.where(own, np.abs(numbers[:, 0]), np.inf), where))
    return _average(
        kin, count, where[order], who[order], numbers[order], normals[order], own[order]
    )


def _say(table: Table, kin, row, points, near, reach):
    """What one patch says at the points it reaches.

    Point indices (m,), row (m,), columns distance, weight, variance, K (m, 4), unit normals
    (m, 3), and whether the foot point is in the patch's own cell (m,).
    """
    basis, radius = table.basis, table.radius[row]
    scaled = table.scaled_local(np.array([row]), points[near])[0]
    terms = monomials(basis, scaled[:, 0], scaled[:, 1], scaled[:, 2])
    rows = derivative_coefficients(basis, table.mean[row], [VALUE, *SECOND_ORDER])
    phi, *derivatives = rows @ terms
    gradient = np.stack([-derivatives[0], -derivatives[1], 1.0 - derivatives[5]], axis=1)
    rough = table.rough.get(row)
    if rough is not None:
        detail, slope, shared = residual_at(rough.residual, scaled[None])
        phi, gradient = phi + detail[0], gradient - slope[0]
    stretch = np.sqrt((gradient * gradient).sum(axis=1))
    distance = radius * (scaled[:, 2] - phi) / stretch
    inside = (scaled[:, 0] ** 2 + scaled[:, 1] ** 2 <= 1.0) & (
        np.abs(distance) <= min(reach, 0.5 * radius)
    )
    near, scaled, terms, distance = near[inside], scaled[inside], terms[:, inside], distance[inside]
    gradient, stretch = gradient[inside], stretch[inside]
    normals = gradient / stretch[:, None] @ table.axes[row]
    feet = points[near] - distance[:, None] * normals
    own = power_at(table, [row], feet)[:, 0]
    limit = CELL_MARGIN * table.power[row]
    lowest = own <= _COVER_MARGIN * table.power[row]
    if kin[row]:
        lowest &= own <= power_at(table, sorted(kin[row]), feet).min(axis=1) + limit
    terms = terms[: basis.size]
    if rough is None:
        variance = np.maximum((terms * (table.covariance[row] @ terms)).sum(axis=0), 0.0)
    else:
        variance = joint_variance(
            *(rough.residual, table.covariance[[row]], terms[:, None], shared[:, inside])
        )[0]
    variance = (radius / stretch) ** 2 * variance + np.finfo(float).tiny
    closeness = np.maximum(1.0 - (scaled * scaled).sum(axis=1), 0.0)
    graph = graph_derivatives(*(d[inside] for d in derivatives))
    curvature = gaussian_curvature(*graph) / radius**2
    numbers = np.stack([distance, closeness**3 / variance, variance, curvature], axis=1)
    return near, np.full(len(near), row), numbers, normals, lowest


def _average(kin, count, where, who, numbers, normals, own) -> Blend:
    """Weighted means over the patches kin to the leader of each point; sorted by point, the
    leader first."""
    starts = np.flatnonzero(np.r_[True, where[1:] != where[:-1]])
    sizes = np.diff(np.r_[starts, len(where)])
    leader = np.repeat(who[starts], sizes)
    led = own[starts]
    size = len(kin)
    keys = np.array(sorted(i * size + j for i in range(size) for j in (*kin[i], i)))
    key = leader * size + who
    found = keys[np.minimum(np.searchsorted(keys, key), len(keys) - 1)] == key
    weight = np.where(found, numbers[:, 1], 0.0)
    total = np.add.reduceat(weight, starts)
    led &= total > 0.0
    safe = np.where(total > 0.0, total, 1.0)
    columns = np.concatenate([numbers[:, [0, 2, 3]], normals], axis=1)
    means = np.add.reduceat(columns * weight[:, None], starts, axis=0) / safe[:, None]
    at = where[starts][led]
    out = np.full((count, 6), np.nan)
    out[at] = means[led]
    normal = out[:, 3:] / np.sqrt((out[:, 3:] ** 2).sum(axis=1))[:, None]
    known = np.zeros(count, bool)
    known[at] = True
    patch = np.full(count, -1)
    patch[at] = who[starts][led]
    return Blend(out[:, 0], known, normal, np.sqrt(out[:, 1]), out[:, 2], patch)
