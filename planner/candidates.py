"""Where to touch: uncovered touched points first, then gaps in the patches' outlines."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.polynomial import XX, XY, YY, X, Y, evaluate, shape_operator
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
    reason : Reason
    """

    point: np.ndarray
    home: int
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
    depth = np.where(is_spent(frontier.points, spent), 0.0, frontier.depth)
    if not len(depth) or depth.max() <= 0.0:
        return None
    offset = frontier.points - position
    distance = np.where(depth >= min(_FAR_ENOUGH, 0.98 * depth.max()), (offset**2).sum(axis=1), np.inf)
    best = int(distance.argmin())
    return Candidate(frontier.points[best], int(frontier.home[best]), Reason.EXPAND)


def gap_candidate(atlas: Atlas, position, spent) -> Candidate | None:
    """The nearest point of a patch's outline that no other patch covers."""
    rows, places = np.nonzero(atlas.table.ring_open)
    points = atlas.table.ring[rows, places]
    free = ~is_spent(points, spent)
    if not free.any():
        return None
    offset = points - position
    best = int(np.where(free, (offset**2).sum(axis=1), np.inf).argmin())
    return Candidate(points[best], int(rows[best]), Reason.CLOSE_GAP)


def is_spent(points, spent) -> np.ndarray:
    """(n,) whether each point is one of the spent ones."""
    if not len(spent):
        return np.zeros(len(points), bool)
    return (points[:, None] == np.asarray(spent)).all(axis=2).any(axis=1)


def predicted_normal_and_curvature(atlas: Atlas, candidate: Candidate):
    """Outward unit normal (3,) and largest |normal curvature| that the candidate's home patch
    predicts there."""
    table, home = atlas.table, candidate.home
    scaled = (candidate.point - table.origin[home]) @ table.axes[home].T / table.radius[home]
    fx, fy, fxx, fxy, fyy = evaluate(
        table.basis, table.mean[home], scaled[:1], scaled[1:2], (X, Y, XX, XY, YY)
    )[:, 0]
    normal = np.array([-fx, -fy, 1.0]) @ table.axes[home]
    shape = shape_operator(fx, fy, fxx, fxy, fyy)
    mean, difference = 0.5 * (shape[0, 0] + shape[1, 1]), 0.5 * (shape[0, 0] - shape[1, 1])
    spread = np.sqrt(max(difference**2 + shape[0, 1] * shape[1, 0], 0.0))
    return normal / np.sqrt(normal @ normal), float(abs(mean) + spread) / table.radius[home]
