"""Where to touch: uncovered touched points, then gaps in the patches' outlines, then where the
patches are unsure."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.curvature import principal_directions
from touchatlas.patch.geometry.polynomial import (
    SECOND_ORDER,
    evaluate,
    graph_derivatives,
    shape_operator,
)
from touchatlas.planner.probe_plan import Reason

# A point this far out, in core radii, leaves little overlap: farther gains nothing more.
_FAR_ENOUGH = 1.25
# Samples of the frontier that are checked at once: mostly the first is open, else many are not.
_FIRST, _AT_ONCE = 16, 256


@dataclass(frozen=True, eq=False)
class Candidate:
    """A place to touch.

    Parameters
    ----------
    point : (3,) float, length, world
    home : int
        The patch that knows it.
    normal : (3,) float, unit, world
        Outward, as predicted.
    reason : Reason
    """

    point: np.ndarray
    home: int
    normal: np.ndarray
    reason: Reason


def frontier_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The touched point to go on from: far from all centres, then near the probe.

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
    samples = samples[~is_spent(pool.points[samples], spent, atlas.tolerance)]
    depth, offset = frontier.depth(samples), pool.points[samples] - position
    far = np.minimum(depth, _FAR_ENOUGH)
    order = samples[np.lexsort(((offset * offset).sum(axis=1), -far))]
    for some in np.split(order, range(_FIRST, len(order), _AT_ONCE)):
        left = some[frontier.is_open(some)]
        if len(left):
            best = int(left[0])
            home = int(frontier.owners(best))
            return Candidate(pool.points[best], home, pool.normals[best], Reason.EXPAND)
    return None


def gap_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The nearest point that no core covers: of the patches' outlines, and between three."""
    table = atlas.table
    which, places = np.nonzero(atlas.open_outlines())
    rows = table.rows[which]
    points = atlas.surface_graph.outlines.points(table.rows)[which, places]
    if gaps := atlas.gaps:
        points = np.concatenate([points, list(gaps.values())])
        rows = np.concatenate([rows, [triple[2] for triple in gaps]])
    free = ~is_spent(points, spent, atlas.tolerance)
    if not free.any():
        return None
    offset = points - position
    best = int(np.where(free, (offset**2).sum(axis=1), np.inf).argmin())
    row = rows[best]
    upward = table.surface(rows[[best]], table.scaled_local(rows[[best]], points[[best]]))[1]
    normal = upward[0, 0] @ table.axes[row]
    normal /= np.sqrt(normal @ normal)
    return Candidate(points[best], int(row), normal, Reason.CLOSE_GAP)


def weak_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The nearest point, of the patches' outlines and of half-way there, whose predicted deviation
    exceeds the tolerance."""
    table, rows = atlas.table, atlas.table.rows
    outlines = atlas.surface_graph.outlines.points(rows)
    points = np.concatenate([outlines, 0.5 * (outlines + table.origin[rows, None])])
    points = points.reshape(-1, 3)
    seen = atlas.blend(points)
    weak = np.flatnonzero(seen.known & (np.nan_to_num(seen.deviation) > atlas.tolerance))
    if len(atlas.creases):
        # What of an outline lies beyond an edge is not there.
        homes = np.tile(np.repeat(rows, outlines.shape[1]), 2)
        weak = weak[~atlas.surface_graph.visibility.beyond(homes[weak], points[weak])]
    # A point half-way is on the chord, not on the surface.
    points = points[weak] - seen.distance[weak, None] * seen.normal[weak]
    free = ~is_spent(points, spent, atlas.tolerance)
    if not free.any():
        return None
    offset = points - position
    best = int(np.where(free, (offset**2).sum(axis=1), np.inf).argmin())
    at = weak[best]
    return Candidate(points[best], int(seen.patch[at]), seen.normal[at], Reason.REFINE)


def is_spent(points, spent, tolerance: float) -> np.ndarray:
    """(n,) whether each point is, within a tolerance, one of the spent ones."""
    if not len(spent):
        return np.zeros(len(points), bool)
    offset = points[:, None] - np.asarray(spent)
    return ((offset * offset).sum(axis=2) <= tolerance**2).any(axis=1)


def predicted_curvature(atlas: Atlas, point, home: int) -> float:
    """Largest |normal curvature| that patch ``home`` predicts at a point (3,), or at the
    nearest point of its rim: beyond it the polynomial says nothing. No more than at its centre,
    where it is known best: detail finer than the patch bends the rim."""
    table = atlas.table
    x, y, z = (point - table.origin[home]) @ table.axes[home].T / table.radius[home]
    beyond = max(1.0, float(np.hypot(x, y)))
    # The first column is the point, or the nearest one of the rim, the second the centre.
    x, y, z = np.array([[x, 0.0], [y, 0.0], [z, 0.0]]) / beyond
    derivatives = evaluate(table.basis, table.mean[home], x, y, z, SECOND_ORDER)
    bends = [
        np.abs(principal_directions(shape_operator(*graph_derivatives(*column)))[:2]).max()
        for column in derivatives.T
    ]
    return float(min(bends) / table.radius[home])
