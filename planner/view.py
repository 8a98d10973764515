"""View: all that the choice of the next target depends on; and the target that is chosen."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.options import PlannerOptions


class Phase(Enum):
    """How far an exploration is."""

    FIRST = "no surface is known"
    GROW = "too little of the surface is known"
    COMPARE = "the same, and a baseline chooses"
    FINISH = "the surface is known but for what is left"
    END = "nothing more of the surface is sought"


@dataclass(frozen=True, eq=False)
class View:
    """All that the choice of the next target depends on.

    Parameters
    ----------
    atlas : Atlas
    options : PlannerOptions
    attempts : Attempts
        What was touched and tried.
    phase : Phase
    draw : float
        A number from 0 to 1 drawn at random, for the baseline "random".
    """

    atlas: Atlas
    options: PlannerOptions
    attempts: Attempts
    phase: Phase = Phase.GROW
    draw: float = 0.0

    @cached_property
    def extent(self) -> float:
        """Diagonal of the bounding box of all samples, length."""
        return self.atlas.pool.extent

    @cached_property
    def touched(self) -> np.ndarray:
        """(n, 3) places of the pending plans and contacts of the touches, the last one last; the
        start before any, length, world."""
        contacts = self.attempts.touched or [self.attempts.start]
        return np.concatenate([self.pending, contacts])

    @cached_property
    def done(self) -> np.ndarray:
        """(m, 3) contacts, and places of all attempts, length, world."""
        return np.reshape([*self.attempts.touched, *self.attempts.tried], (-1, 3))

    @cached_property
    def pending(self) -> np.ndarray:
        """(k, 3) places of the plans that are not answered yet, length, world."""
        return np.reshape([one.target.place for one in self.attempts.pending.values()], (-1, 3))

    def apart(self, points) -> np.ndarray:
        """(n,) distance of points (n, 3) to the nearest touch or attempt, length; or a tenth of
        that to the nearest pending plan: its arms will show what is about it."""
        return np.minimum(distance_to(self.done, points), 0.1 * distance_to(self.pending, points))

    def is_free(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches, attempts and pending plans."""
        return self.apart(points) > self.options.levels.apart * self.extent

    def is_untried(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches and attempts."""
        return distance_to(self.done, points) > self.options.levels.apart * self.extent

    def nearest(self, points) -> int:
        """Index of the point (n, 3) that is nearest to the last touch."""
        offset = points - self.touched[-1]
        return int((offset * offset).sum(axis=1).argmin())


def distance_to(others, points) -> np.ndarray:
    """(n,) distance of points (n, 3) to the nearest of others (m, 3), length; infinite for none."""
    if not len(others):
        return np.full(len(points), np.inf)
    out: np.ndarray = cKDTree(others).query(points)[0]
    return out
