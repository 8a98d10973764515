"""Where to touch: uncovered touched points first, then gaps in the patches' outlines."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.curvature import principal_directions
from touchatlas.patch.polynomial import (
    SECOND_ORDER,
    evaluate,
    graph_derivatives,
    shape_operator,
)
from touchatlas.planner.probe_plan import Reason

# A point this far out, in core radii, leaves little overlap: farther gains nothing more.
_FAR_ENOUGH = 1.25


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
    frontier = atlas.frontier
    depth = np.where(is_spent(frontier.points, spent, atlas.tolerance), 0.0, frontier.depth)
    if not len(depth) or depth.max() <= 0.0:
        return None
    offset = frontier.points - position
    distance = np.where(
        depth >= min(_FAR_ENOUGH, 0.98 * depth.max()), (offset**2).sum(axis=1), np.inf
    )
    best = int(distance.argmin())
    return Candidate(
        frontier.points[best], int(frontier.home[best]), frontier.normals[best], Reason.EXPAND
    )


def gap_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The nearest point that no core covers: of the patches' outlines, and between three."""
    table = atlas.table
    for row in np.flatnonzero(table.ring_open.any(axis=1)):
        table.renew_ring(row)
    rows, places = np.nonzero(table.ring_open)
    points = table.ring[rows, places]
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


def is_spent(points, spent, tolerance: float) -> np.ndarray:
    """(n,) whether each point is, within a tolerance, one of the spent ones."""
    if not len(spent):
        return np.zeros(len(points), bool)
    offset = points[:, None] - np.asarray(spent)
    return ((offset * offset).sum(axis=2) <= tolerance**2).any(axis=1)


def predicted_curvature(atlas: Atlas, point, home: int) -> float:
    """Largest |normal curvature| that patch ``home`` predicts at a point (3,), or at the
    nearest point of its rim: beyond it the polynomial says nothing."""
    table = atlas.table
    x, y, z = (point - table.origin[home]) @ table.axes[home].T / table.radius[home]
    beyond = max(1.0, float(np.hypot(x, y)))
    at = np.array([[x], [y], [z]]) / beyond
    derivatives = evaluate(table.basis, table.mean[home], *at, SECOND_ORDER)
    k1, k2, _ = principal_directions(shape_operator(*graph_derivatives(*derivatives[:, 0])))
    return max(abs(k1), abs(k2)) / float(table.radius[home])
