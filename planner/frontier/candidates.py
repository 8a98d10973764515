"""Candidates: uncovered samples, gaps between patches, and points of large predicted deviation.

Another rule for where to touch is one more function here, from an atlas, the position of the probe
and the spent points to a Candidate; ``FrontierPlanner`` calls it.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.patch.geometry.curvature import principal_directions
from touchatlas.patch.geometry.polynomial import (
    SECOND_ORDER,
    evaluate,
    graph_derivatives,
    shape_operator,
)
from touchatlas.planner.probe_plan import Reason

# Distance from all sites above which samples rank alike, in core radii: patches there overlap
# little. Doubled, the probe travels farther for less overlap.
_FAR_ENOUGH = 1.25
# Samples of the frontier that are checked first, and then in each further step: mostly one of the
# first is open. Doubled, a check takes longer and fewer are needed.
_FIRST, _AT_ONCE = 16, 256
# Places of one patch within this fraction of its core radius are one place: half of the distance
# between two points of its outline, which move a little whenever the patch learns. Doubled, a
# place that was tried in vain hides its neighbours.
_SAME_PLACE = 0.13
# Weak places within this fraction of the median core radius are one place: where a polynomial
# cannot follow the surface, touches beside each other would go on without end. Doubled, fewer
# places become sure.
_WEAK_PLACE = 0.5


@dataclass(frozen=True, eq=False)
class Candidate:
    """A place to touch.

    Parameters
    ----------
    point : (3,) float, length, world
    home : int
        Patch that predicts the surface there.
    extent : float, length
        Places within this distance of the point are the same place.
    normal : (3,) float, unit, world
        Predicted outward normal.
    reason : Reason
    """

    point: np.ndarray
    home: int
    extent: float
    normal: np.ndarray
    reason: Reason


def frontier_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The uncovered sample that is farthest from all sites, and of several the nearest to the
    probe; None when all are covered or spent.

    Parameters
    ----------
    atlas : Atlas
    position : (3,) float, length, world
        Where the probe is.
    spent : (m, 3) float, length, world
        Points that were tried in vain.
    """
    frontier, pool = atlas.frontier, atlas.membership.pool
    samples = frontier.candidates()
    samples = samples[~is_spent(pool.points[samples], spent, atlas.scale)]
    depth, offset = frontier.depth(samples), pool.points[samples] - position
    far = np.minimum(depth, _FAR_ENOUGH)
    order = samples[np.lexsort(((offset * offset).sum(axis=1), -far))]
    for some in np.split(order, range(_FIRST, len(order), _AT_ONCE)):
        left = some[frontier.is_open(some)]
        if len(left):
            best = int(left[0])
            home = int(frontier.owners(best))
            point, normal = pool.points[best], pool.normals[best]
            return Candidate(point, home, atlas.scale, normal, Reason.EXPAND)
    return None


def gap_candidate(atlas: Atlas, position, spent, given_up=()) -> Candidate | None:
    """The point nearest to the probe that no core covers, of the open outlines and of the gaps
    between three patches; None when there is none, or all are spent, or of patches given up."""
    table = atlas.table
    which, places = np.nonzero(atlas.open_outlines())
    rows = table.rows[which]
    points = atlas.surface_graph.outlines.points(table.rows)[which, places]
    if gaps := atlas.gaps:
        points = np.concatenate([points, list(gaps.values())])
        rows = np.concatenate([rows, [triple[2] for triple in gaps]])
    left = ~np.isin(rows, given_up)
    rows, points = rows[left], points[left]
    extents = _extents(atlas, rows)
    best = _nearest_free(points, position, spent, extents)
    if best is None:
        return None
    row = int(rows[best])
    upward = table.surface([row], table.scaled_local([row], points[[best]]))[1]
    normal = upward[0, 0] @ table.axes[row]
    normal /= np.sqrt(normal @ normal)
    return Candidate(points[best], row, float(extents[best]), normal, Reason.CLOSE_GAP)


def weak_candidate(atlas: Atlas, position, spent, given_up=()) -> Candidate | None:
    """The point nearest to the probe whose predicted deviation exceeds the tolerance, of the
    outlines and of points half-way to them; None when there is none, or all are spent, or of
    patches given up."""
    table, rows = atlas.table, atlas.table.rows
    outlines = atlas.surface_graph.outlines.points(rows)
    points = np.concatenate([outlines, 0.5 * (outlines + table.origin[rows, None])])
    points = points.reshape(-1, 3)
    seen = blend_of_patches(atlas, points)
    weak = np.flatnonzero(seen.known & (np.nan_to_num(seen.deviation) > atlas.tolerance))
    weak = weak[~np.isin(seen.patch[weak], given_up)]
    # A point half-way is on the chord, so it is moved onto the surface.
    points = points[weak] - seen.distance[weak, None] * seen.normal[weak]
    homes = seen.patch[weak]
    extents = np.full(len(weak), _WEAK_PLACE * np.sqrt(np.median(table.weight[rows])))
    best = _nearest_free(points, position, spent, extents)
    if best is None:
        return None
    normal, extent = seen.normal[weak[best]], float(extents[best])
    return Candidate(points[best], int(homes[best]), extent, normal, Reason.REFINE)


def _extents(atlas: Atlas, rows) -> np.ndarray:
    """(n,) distance within which places of patches (n,) are the same place, length."""
    return np.maximum(atlas.scale, _SAME_PLACE * np.sqrt(atlas.table.weight[rows]))


def _nearest_free(points, position, spent, extents) -> int | None:
    """Index of the point (n, 3) nearest to the probe that is not spent; None when all are."""
    free = np.flatnonzero(~is_spent(points, spent, extents))
    if not len(free):
        return None
    return int(free[((points[free] - position) ** 2).sum(axis=1).argmin()])


def is_spent(points, spent, extents) -> np.ndarray:
    """(n,) whether points (n, 3) are within their extents (n,), or one, of spent points (m, 3)."""
    if not len(spent):
        return np.zeros(len(points), bool)
    offset = points[:, None] - np.asarray(spent)
    square = np.broadcast_to(np.square(extents), len(points))
    return ((offset * offset).sum(axis=2) <= square[:, None]).any(axis=1)


def predicted_curvature(atlas: Atlas, point, home: int) -> float:
    """Largest absolute normal curvature that patch ``home`` predicts at a point (3,), 1/length.

    Beyond the rim of the patch it is that of the nearest point of the rim, because the polynomial
    is not valid there. It is no more than the curvature at the centre, because detail finer than
    the patch disturbs the rim most.
    """
    table = atlas.table
    x, y, z = (point - table.origin[home]) @ table.axes[home].T / table.radius[home]
    beyond = max(1.0, float(np.hypot(x, y)))
    # The first column is the point or the nearest point of the rim, the second the centre.
    x, y, z = np.array([[x, 0.0], [y, 0.0], [z, 0.0]]) / beyond
    derivatives = evaluate(table.basis, table.mean[home], x, y, z, SECOND_ORDER)
    curvatures = [
        np.abs(principal_directions(shape_operator(*graph_derivatives(*column)))[:2]).max()
        for column in derivatives.T
    ]
    return float(min(curvatures) / table.radius[home])
