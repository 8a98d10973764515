"""Choosing: a planner whose next place is chosen from outside, and the candidates for it."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner
from touchatlas.planner.attempts import Target
from touchatlas.planner.places import Places
from touchatlas.planner.sources import closer, first, from_known, target_at
from touchatlas.planner.view import View, distance_to
from touchatlas.sim.study.surface_peers import spread


@dataclass(frozen=True, eq=False)
class Candidates:
    """Places among which the next touch is chosen.

    Parameters
    ----------
    targets : tuple of Target
    points, normals : (n, 3) float, length; unit, world
    deviation : (n,) float, tolerances
        Predicted; infinite at a rim, beyond which nothing is known.
    away : (n,) float, extents
        Distance from all touches.
    travel : (n,) float, extents
        Distance from the last touch.
    """

    targets: tuple[Target, ...]
    points: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    away: np.ndarray
    travel: np.ndarray

    @property
    def features(self) -> np.ndarray:
        """(n, 4) whether each is at a rim, the logarithm of its deviation, and both distances."""
        rim = np.isinf(self.deviation)
        vague = np.log10(np.where(rim, 1.0, np.maximum(self.deviation, 1e-6)))
        return np.stack([rim, vague, self.away, self.travel], axis=1)


def candidates(view: View, places: Places, most: int) -> Candidates:
    """At most so many places that no touch was near, spread evenly; half of them at rims."""
    points, _ = places.all
    free, at_rim = np.flatnonzero(view.is_free(points)), len(places.rim)
    rims, inner = free[free < at_rim], free[free >= at_rim]
    kept = _spread(points, rims, max(most // 2, most - len(inner)))
    kept = np.concatenate([kept, _spread(points, inner, most - len(kept))]).astype(int)
    targets = tuple(target_at(places, int(k)) for k in kept)
    at, last = points[kept].reshape(-1, 3), view.touched[-1:]
    deviation = np.concatenate([np.full(at_rim, np.inf), places.deviation])[kept]
    return Candidates(
        *(targets, at, places.all[1][kept].reshape(-1, 3), deviation / view.atlas.tolerance),
        *(distance_to(view.touched, at) / view.extent, distance_to(last, at) / view.extent),
    )


def _spread(points, some, most: int) -> np.ndarray:
    """At most so many of ``some`` (k,) int, each the farthest from those before."""
    return some[spread(points[some], most)] if len(some) and most > 0 else some[:0]


class Choosing(Planner):
    """Touches what ``chosen`` says; before, what is to be tried again, and the first touch.

    Attributes
    ----------
    chosen : Target or None
        It is taken once.
    """

    chosen: Target | None = None

    def _target(self, view: View, places: Places) -> Target | None:
        again = closer(view, places) or from_known(view, places)
        if again is not None:
            return again
        if view.atlas.body is None:
            return first(view, places)
        target, self.chosen = self.chosen, None
        return target

    def candidates(self, atlas: Atlas, most: int) -> Candidates:
        """Those of an atlas that has learned; none before."""
        places = self._measure(atlas)
        return candidates(self._view(atlas), places, most)

    @property
    def known(self) -> float:
        """Share of the surface that is expected within the tolerance."""
        return self._known.coverage

    @property
    def is_known(self) -> bool:
        """Whether that is enough to end."""
        return self._is_known
