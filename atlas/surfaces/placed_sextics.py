"""PlacedSextics: sextics by place, which of them reach points, and what these say."""

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.surfaces.sextic_mean import Evaluated, Sides
from touchatlas.atlas.surfaces.sextic_sites import pairs_within
from touchatlas.atlas.surfaces.sextics import Sextics

# Distance from its middle at which a sextic no longer weighs, in radii.
WEIGHS = 0.9


class PlacedSextics:
    """Sextics by place.

    Parameters
    ----------
    sextics : Sextics
    radius : float, length, optional
        The largest of a surface that they are a part of; without, that of theirs.
    """

    def __init__(self, sextics: Sextics, radius: float | None = None) -> None:
        self.sextics = sextics
        self.radius = float(sextics.radii.max()) if radius is None else radius

    def evaluated(self, points, sides: Sides | None = None) -> Evaluated:
        """What the sextics say that reach points (n, 3), or the nearest one. Where sides are given,
        of each point those alone that face as one of its sides does, or all where none does."""
        which, number, weight = self.within(cKDTree(points))
        if sides is not None:
            faced = sides.faced(which, self.sextics.axes[:, 2].take(number, axis=0))
            faced |= (np.bincount(which[faced], minlength=len(points)) == 0)[which]
            which, number, weight = (x.compress(faced) for x in (which, number, weight))
        return self.with_nearest(self.told(which, number, weight, points), points)

    def told(self, which, number, weight, points) -> Evaluated:
        """What sextics ``number`` (m,) say of points ``which`` (m,)."""
        found, stretch = self.sextics.values(number, points.take(which, axis=0))
        upward = self.sextics.axes[:, 2].take(number, axis=0)
        return Evaluated(which, number, weight, upward, found, stretch)

    def within(self, points: cKDTree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The sextics that reach points, the largest first: indices of points (m,), their numbers
        (m,) and weights (m,). The integral of the weight over space is the same for each radius,
        so that smaller ones lead where they are."""
        parts = []
        for own, tree in self._levels:
            radius = self.sextics.radii[own[0]]
            which, number, away = pairs_within(points, tree, WEIGHS * radius)
            weight = np.maximum(1.0 - (away / (WEIGHS * radius)) ** 2, 0.0)
            real = weight > 0.0
            scale = (self.radius / radius) ** 3
            parts.append((which[real], own.take(number[real]), scale * weight[real] ** 3))
        which, number, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
        if len(parts) > 1:
            order = np.argsort(which, kind="stable")
            which, number, weight = (column.take(order) for column in (which, number, weight))
        return which, number, weight

    def with_nearest(self, reached: Evaluated, points) -> Evaluated:
        """The same, and what the nearest sextic says of each of points (n, 3) that none reaches."""
        alone = np.flatnonzero(np.bincount(reached.which, minlength=len(points)) == 0)
        if not len(alone):
            return reached
        number = self._middles.query(points[alone])[1]
        return reached.joined(self.told(alone, number, np.ones(len(alone)), points))

    @cached_property
    def _levels(self) -> list[tuple[np.ndarray, cKDTree]]:
        """The sextics (p,) of each radius, the largest first, and a tree of their middles."""
        radii = self.sextics.radii
        owns = [np.flatnonzero(radii == one) for one in np.unique(radii)[::-1]]
        return [(own, cKDTree(self.sextics.origins[own])) for own in owns]

    @cached_property
    def _middles(self) -> cKDTree:
        return cKDTree(self.sextics.origins)
