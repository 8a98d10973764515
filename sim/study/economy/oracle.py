"""Oracle: a planner that knows the truth, to compare others with."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, ProbePlan, Reason, StopReason
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target
from touchatlas.planner.place.holes import drawn_holes
from touchatlas.planner.plans import plan_at

# Places within this fraction of the extent of an earlier touch or attempt are not touched again, as
# with the other planners; and within this one, if it is a hole. Doubled, fewer places in narrow
# features are touched, and some holes remain.
_APART, _APART_HOLE = 0.02, 0.005


class Oracle(Planner):
    """Touches the true point whose error is largest, until the truth is within the tolerance; then
    what holes the surface has.

    It makes the same touches as ``Planner`` and chooses their places with the truth, so no real
    probe can use it. It is greedy: another sequence may need fewer touches.

    Parameters
    ----------
    start : (3,) float, length, world
    outward : (3,) float, unit, world
    points, normals : (n, 3) float, length; unit, world
        Points of the true surface, and its outward normals there.
    options : PlannerOptions
        ``coverage`` is the share of the points within the tolerance at which it ends.
    """

    def __init__(
        self, start, outward, points, normals, options: PlannerOptions = PlannerOptions()
    ) -> None:
        super().__init__(start, outward, options)
        self._points, self._normals = np.asarray(points, float), np.asarray(normals, float)

    def _next_plan(self, atlas: Atlas) -> ProbePlan | None:
        """A plan at the place of largest error."""
        error = errors(atlas, self._points)
        self._coverage = float(np.mean(error <= atlas.tolerance))
        touched, tried = self._attempts.touched, self._attempts.tried
        extent, done = atlas.pool.extent, np.array([*touched, *tried])
        if self._coverage >= self.options.coverage and np.isfinite(error).all():
            target = _hole(atlas, done, extent)
            end = StopReason.KNOWN
        else:
            near = _distance(done, self._points) <= _APART * extent
            target = self._worst(np.where(near | (error <= atlas.tolerance), 0.0, error))
            end = StopReason.TRIED
        if target is None:
            return self._end(atlas, end)
        return plan_at(atlas, target, extent, self.options)

    def _worst(self, error) -> Target | None:
        """The true point of largest error (n,); None where all are zero."""
        best = worst(error, self._points, np.array(self._attempts.touched))
        if best is None:
            return None
        reason = Reason.REFINE if np.isfinite(error[best]) else Reason.EXPAND
        return Target(self._points[best], self._normals[best], reason)


def _hole(atlas: Atlas, done, extent: float) -> Target | None:
    """The hole of the surface farthest from touches and attempts (m, 3); None without any."""
    found = drawn_holes(atlas, atlas.tolerance)
    centres, normals = found.centres, found.normals
    apart = _distance(done, centres) if len(centres) else np.zeros(0)
    if not apart.max(initial=0.0) > _APART_HOLE * extent:
        return None
    best = int(apart.argmax())
    return Target(centres[best], normals[best], Reason.CLOSE_GAP)


def errors(atlas: Atlas, points) -> np.ndarray:
    """(n,) distance of points (n, 3) from the atlas's surface, length; infinite where it
    is not known."""
    found = atlas.blend(points)
    return np.where(found.known, np.abs(np.nan_to_num(found.distance)), np.inf)


def worst(error, points, touched) -> int | None:
    """Index of the largest error (n,), length; of several that are infinite, that of the point
    (n, 3) farthest from what is touched (m, 3). None where all are zero.

    Examples
    --------
    >>> points = np.array([[1.0, 0, 0], [3, 0, 0], [2, 0, 0]])
    >>> worst(np.array([np.inf, 0.5, np.inf]), points, np.zeros((1, 3)))
    2
    """
    unknown = np.flatnonzero(np.isinf(error))
    if len(unknown):
        return int(unknown[_distance(touched, points[unknown]).argmax()])
    return int(np.argmax(error)) if np.max(error, initial=0.0) > 0.0 else None


def _distance(others, points) -> np.ndarray:
    """(n,) distance of points (n, 3) to the nearest of others (m, 3), length; infinite for none."""
    if not len(others):
        return np.full(len(points), np.inf)
    out: np.ndarray = cKDTree(others).query(points)[0]
    return out
