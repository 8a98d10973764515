"""Opposite sides: two faces that are near and face away from, or toward, each other."""

from itertools import permutations

import numpy as np

from touchatlas.atlas.faces.face_trees import FaceTrees

# Cosine between the normals of two opposite sides, no unit, below which the nearer of both has a
# point: 60 degrees from the opposite. Doubled (its distance from -1), faces beside an edge count.
_OPPOSITE = -0.5
# Samples of a face that tell whether another is its opposite side. Doubled, it takes twice as long.
_ASKED = 48
# Noise of a sample, in root mean squares of a face. Doubled, lower steps lie between no two sides.
_NOISE = 4.0


class OppositeSides:
    """Pairs of opposite sides, as of a thin wall or of a slot.

    The nearest sample does not tell on which of both sides a point is where the samples of a side
    are farther apart than the sides are.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance between two sides, and from the samples of a side along it, up to which it counts.
    """

    def __init__(self, trees: FaceTrees, reach: float) -> None:
        self._trees, self._reach = trees, reach
        count = len(trees.faces)
        self.pairs = [pair for pair in permutations(range(count), 2) if self._are_opposite(*pair)]

    def _are_opposite(self, own: int, other: int) -> bool:
        """Whether a face lies opposite some samples of another."""
        samples = self._trees.faces.faces[own].samples
        points = self._trees.faces.points[samples[:: max(1, len(samples) // _ASKED)]]
        points = points[self._trees.away(other, points) < self._reach]
        if not len(points):
            return False
        mine, theirs = (self._trees.values(k, points)[:, 1:4] for k in (own, other))
        return bool(((mine * theirs).sum(axis=1) < _OPPOSITE).any())

    def choose(self, points, owner, chosen) -> None:
        """Give points (n, 3) of faces ``owner`` (n,), whose distance, normal and variance (n, 5)
        were chosen, to the opposite side where that is nearer."""
        before = owner.copy()
        for own, other in self.pairs:
            rows = np.flatnonzero(before == own)
            if not len(rows):
                continue
            values = self._trees.values(other, points[rows])
            along = self._trees.away(other, points[rows]) ** 2 - values[:, 0] ** 2
            nearer = np.abs(values[:, 0]) < np.abs(chosen[rows, 0])
            nearer &= (values[:, 1:4] * chosen[rows, 1:4]).sum(axis=1) < _OPPOSITE
            nearer &= along < self._reach**2
            nearer[nearer] = ~self._is_barred((own, other), points[rows[nearer]])
            chosen[rows[nearer]], owner[rows[nearer]] = values[nearer], other

    def _is_barred(self, pair, points) -> np.ndarray:
        """(n,) whether a third face lies between points (n, 3) and the nearest sample of the second
        face of a pair, and has a nearer one: the floor of two slots does not go on in the rib
        between them."""
        faces, out = self._trees.faces, np.zeros(len(points), bool)
        if not len(points):
            return out
        nearest = self._trees.nearest(pair[1], points, 1)[:, 0]
        samples = faces.points[faces.faces[pair[1]].samples[nearest]]
        away = np.linalg.norm(samples - points, axis=1)
        for third in range(len(faces)):
            if third in pair:
                continue
            beyond = self._trees.distances(third, samples)
            apart = np.abs(beyond) > _NOISE * faces.faces[third].deviation
            apart &= beyond * self._trees.distances(third, points) < 0.0
            rows = np.flatnonzero(apart & ~out)
            out[rows] = self._trees.away(third, points[rows]) < away[rows]
        return out
