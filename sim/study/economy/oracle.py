"""Oracle: a planner that knows the truth, to compare others with."""

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, ProbePlan, Reason, StopReason
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target, distance_to
from touchatlas.planner.place.places import places_of
from touchatlas.planner.place.rules import hole_target
from touchatlas.planner.plans import plan_at


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
        error, view = errors(atlas, self._points), self._view(atlas)
        share = float(np.mean(error <= atlas.tolerance))
        if share >= self.options.coverage and np.isfinite(error).all():
            target, end = hole_target(view, places_of(atlas)), StopReason.KNOWN
        else:
            left = view.is_free(self._points) & (error > atlas.tolerance)
            target, end = self._worst(np.where(left, error, 0.0), view.touched), StopReason.TRIED
        if target is None:
            return self._end(atlas, end)
        return plan_at(atlas, target, view.extent, self.options)

    def _worst(self, error, touched) -> Target | None:
        """The true point of largest error (n,), see ``worst``; None where all are zero."""
        best = worst(error, self._points, touched)
        if best is None:
            return None
        reason = Reason.REFINE if np.isfinite(error[best]) else Reason.EXPAND
        return Target(self._points[best], self._normals[best], reason)


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
        return int(unknown[distance_to(touched, points[unknown]).argmax()])
    return int(np.argmax(error)) if np.max(error, initial=0.0) > 0.0 else None
