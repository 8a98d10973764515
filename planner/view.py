"""View: all that the choice of the next target depends on; and the target that is chosen."""

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.atlas import Atlas
from touchatlas.planner.attempts import Attempts
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.places import Places
from touchatlas.planner.region import region_of


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
    margin : float, length
        Distance from the region up to which the surface is wanted; see ``margin_about``.
    """

    atlas: Atlas
    options: PlannerOptions
    attempts: Attempts
    phase: Phase = Phase.GROW
    draw: float = 0.0
    margin: float = np.inf

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

    def is_wanted(self, points) -> np.ndarray:
        """(n,) whether the surface is wanted at points (n, 3)."""
        if self.margin == np.inf or self.options.elsewhere:
            return np.ones(len(points), bool)
        return np.asarray(region_of(self.options.region).distance(points) <= self.margin)

    def limited(self, places: Places) -> Places:
        """The places at which the surface is wanted. Where another tolerance holds outside of the
        region, deviations are over that one as they are over the tolerance inside."""
        if self.margin == np.inf:
            return places
        if self.options.elsewhere:
            outside = region_of(self.options.region).distance(places.points) > 0.0
            looser = self.atlas.tolerance / self.options.elsewhere
            deviation = np.where(outside, looser, 1.0) * places.deviation
            return replace(places, deviation=deviation)
        return places.some(self.is_wanted(places.points), self.is_wanted(places.rim))

    def apart(self, points) -> np.ndarray:
        """(n,) distance of points (n, 3) to the nearest touch or attempt, length; or a tenth of
        that to the nearest pending plan: its arms will show what is about it."""
        return np.minimum(distance_to(self.done, points), 0.1 * distance_to(self.pending, points))

    def is_free(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are wanted, and away from touches, attempts and pending
        plans."""
        away = self.apart(points) > self.options.levels.apart * self.extent
        return np.asarray(away & self.is_wanted(points))

    def is_untried(self, points) -> np.ndarray:
        """(n,) whether points (n, 3) are away from touches and attempts."""
        return distance_to(self.done, points) > self.options.levels.apart * self.extent

    def cost(self, points) -> np.ndarray:
        """(n,) what a touch at points (n, 3) costs: seconds of the machine; without a model of one,
        the way from the last touch and the level ``set_up`` for the touch itself, length."""
        options, extent = self.options, self.extent
        travel = np.linalg.norm(points - self.touched[-1], axis=1)
        if not options.cost.rapid:
            return np.asarray(options.levels.set_up * extent + travel)
        reach, step = options.reach * extent, options.step * extent
        return options.cost.seconds(travel, min(0.5 * reach, 10.0 * step), reach, options.curves)

    def nearest(self, points) -> int:
        """Index of the point (n, 3) that is nearest to the last touch."""
        offset = points - self.touched[-1]
        return int((offset * offset).sum(axis=1).argmin())


def margin_about(places: Places, options: PlannerOptions, extent: float) -> float:
    """Distance from the region of the options, length, up to which the surface is wanted: 0 where
    some of the surface in it is known, else that of the nearest places and a tenth of an extent
    more, so that touches approach it; infinite without a region."""
    if not options.region:
        return np.inf
    away = region_of(options.region).distance(places.all[0])
    nearest = float(away.min(initial=np.inf))
    return nearest and nearest + 0.1 * extent


def distance_to(others, points) -> np.ndarray:
    """(n,) distance of points (n, 3) to the nearest of others (m, 3), length; infinite for none."""
    if not len(others):
        return np.full(len(points), np.inf)
    out: np.ndarray = cKDTree(others).query(points)[0]
    return out
