"""Oracle: a planner that knows the truth, to compare others with."""

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, Reason, StopReason
from touchatlas.planner.attempts import Target
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.places import Places
from touchatlas.planner.sources import closer, first, from_known, hole_in_fine_surface
from touchatlas.planner.view import View, distance_to


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

    @classmethod
    def in_simulation(cls, obj, options: PlannerOptions, rng: np.random.Generator) -> "Oracle":
        """The planner of a simulated object, of whose surface it knows 2,000 points."""
        start, outward = obj.start()
        points, normals = obj.sample(2000, rng)
        return cls(start, outward, points, normals, options)

    def _target(self, view: View, places: Places) -> Target | None:
        """What is to be tried again; else the place of largest error, or a hole at the end."""
        again = closer(view, places) or from_known(view, places)
        if again is not None or view.atlas.body is None:
            return again or first(view, places)
        if self._is_met(view.atlas):
            return hole_in_fine_surface(view, places)
        error = errors(view.atlas, self._points)
        left = view.is_free(self._points) & (error > view.atlas.tolerance)
        return self._worst(np.where(left, error, 0.0), view.touched)

    def _reason(self, view: View, places: Places) -> StopReason:
        """Why there is no further target."""
        if view.atlas.body is None:
            return StopReason.NO_PATCH
        return StopReason.KNOWN if self._is_met(view.atlas) else StopReason.TRIED

    def _is_met(self, atlas: Atlas) -> bool:
        """Whether enough of the truth is within the tolerance, and all of it is known."""
        error = errors(atlas, self._points)
        share = float(np.mean(error <= atlas.tolerance))
        return share >= self.options.coverage and bool(np.isfinite(error).all())

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
