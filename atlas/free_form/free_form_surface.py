"""FreeFormSurface: overlapping sextics of a free-form face, averaged by a partition of unity."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.free_form.residual_kriging import ResidualKriging
from touchatlas.atlas.free_form.sextic_batch import SexticBatch
from touchatlas.atlas.free_form.sextic_fits import SexticFits
from touchatlas.atlas.free_form.sextic_mean import AskedSextics, SexticMean
from touchatlas.atlas.free_form.sextic_sites import FACING, pairs_within
from touchatlas.atlas.free_form.sharp_turns import SharpTurns

# Middles among which the nearest one is sought that faces as a point does: about as many as reach
# it from both sides of a wall. Doubled, nothing changes.
_ASKED = 24
# Distance from its middle at which a sextic no longer weighs, in radii. At 0.8 errors were up to
# 6 % larger. Doubled, it takes four times as long.
WEIGHS = 0.9
# Nearest samples among which one may be of another sheet, and its distance over that of the
# nearest. Doubled, both sides of thicker walls are compared.
_NEAREST, _AS_NEAR = 12, 4.0
# Largest cosine of the normals of two sheets: opposite sides of a wall or of a slot. Doubled in
# angle, strong bends are walls.
_OPPOSITE = -0.3
# Distance from a sharp turn up to which its two sides cut each other, in largest radii: turns along
# an edge may be as far apart as contours. Halved, edges of a wing nut were ragged between them.
_CUTS = 1.0
# Deviation of the other side of a sharp turn, in deviations of the own one, from which it must be
# surely beyond that to have a point, and by how many of its deviations. Either doubled, the first
# cuts dents, and with the second the surface goes on beyond edges.
_LESS_SURE, _SURELY = 3.0, 2.0


@dataclass(frozen=True, eq=False)
class FreeFormSurface:
    """Overlapping sextics, averaged at each point with weights that fall to zero with the distance
    from their middles and with the angle to their normals: the partition of unity of Y. Ohtake,
    A. Belyaev, M. Alexa, G. Turk, H.-P. Seidel, "Multi-level partition of unity implicits",
    SIGGRAPH 2003.

    Of two sides of a wall the nearer one has a point. Only sextics that face as the samples of a
    side do are averaged. Where contours run over a sharp edge, both sides cut each other.

    Parameters
    ----------
    sextics : SexticBatch
        Each fitted within its radius about its middle: of one radius, and smaller ones where those
        leave much out.
    points, normals : (n, 3) float, length; unit, world
        The samples, and outward normals that tell the sides.
    rest : ResidualKriging, optional
        What the sextics leave out.
    fits : SexticFits, optional
        What samples said of the sextics, for the next fit.
    pairs : (k, 2) int
        Samples on both sides of the places at which contours run over a sharp edge.
    """

    sextics: SexticBatch
    points: np.ndarray
    normals: np.ndarray
    rest: ResidualKriging | None = None
    fits: SexticFits | None = None
    pairs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), int))

    def values(self, points, texture: bool = True) -> np.ndarray:
        """(n, 5) distance, normal and variance at points (n, 3), with or without what the sextics
        leave out. Beyond its scale a sextic goes on as the plane that touches it in its middle; its
        deviation grows as it does.

        The variance is that of the sextic that weighs most, and that of the sextics about their
        mean (the law of total variance): its coefficients say nothing of a shape that no sextic
        has, as at an edge or a tip that no contour met, but there sextics differ.
        """
        mean = self._mean_at(points)
        found = np.column_stack([mean.values, self._variance(mean, points)])
        if texture and self.rest is not None:
            self.rest.correct(points, found)
        return found

    def at(self, points) -> np.ndarray:
        """(n, 4) distance and normal at points (n, 3), without what the sextics leave out."""
        return self._mean_at(points).values

    def sides(self, points) -> np.ndarray:
        """(n, 3) normals of the samples nearest to points (n, 3)."""
        return self.normals[self._samples.query(points)[1]]

    def leading(self, points) -> np.ndarray:
        """(m,) the sextics that weigh most at some of points (n, 3), ascending."""
        return np.unique(self._mean_at(points).number)

    def reaching(self, points) -> np.ndarray:
        """(m,) the sextics that reach some of points (n, 3), ascending."""
        return np.unique(self._asked(points).number)

    def _variance(self, mean: SexticMean, points) -> np.ndarray:
        """(n,) variance, length^2, of what sextics say together of points (n, 3)."""
        return self.sextics.variances(mean.number, points) * mean.stretch**2 + mean.spread

    def _mean_at(self, points) -> SexticMean:
        """What sextics say of points (n, 3) together: those of the nearer side of a wall, cut by
        the other side of a sharp edge."""
        asked = self._asked(points)
        first, second, rows = self._sides(points)
        mean = asked.mean(first)
        if len(rows):
            other = asked.some(rows).mean(second[rows])
            # No other sextic confirms a side that one alone shows: either side may be there.
            half = 0.5 * (other.values[:, 0] - mean.values[rows, 0])
            doubt = np.maximum(2.0 * other.alone - 1.0, 0.0) * half**2
            other = replace(other, spread=other.spread + doubt)
            nearer = np.abs(other.values[:, 0]) < np.abs(mean.values[rows, 0])
            mean = mean.replaced(rows[nearer], other, nearer)
        return self._cut(mean, asked, points, first) if len(self.pairs) else mean

    def _cut(self, mean: SexticMean, asked: AskedSextics, points, sides) -> SexticMean:
        """What is said of points (n, 3) beside sharp turns, with the normals ``sides`` (n, 3) of
        the nearest samples. The sextics of the own side of a turn have a point up to the other
        side: at a convex edge the distance is the larger one of both, at a concave edge the smaller
        one, as in the piecewise quadrics of Ohtake and others (2003). Where the other side is much
        less sure than the own one, it must be surely beyond that."""
        beside = self._turns.beside(points, sides, _CUTS * self.radius)
        rows = beside.rows
        asked, points = asked.some(rows), points[rows]
        own, other = asked.mean(beside.own, beside.other), asked.mean(beside.other, beside.own)
        at = np.where(own.faces, own.values[:, 0], mean.values[rows, 0])
        gap = beside.sign * (other.values[:, 0] - at)
        beyond, unsure = other.faces & (gap > 0.0), self._variance(other, points)
        surely = unsure <= (gap / _SURELY) ** 2
        cuts = beyond & (surely | (unsure <= _LESS_SURE**2 * self._variance(own, points)))
        # Either side may be there: half of the time the one that is not taken.
        doubt = np.where(beyond & ~surely, 0.5 * gap**2, 0.0)
        own, other = (replace(one, spread=one.spread + doubt) for one in (own, other))
        mean = mean.replaced(rows[own.faces], own, own.faces)
        return mean.replaced(rows[cuts], other, cuts)

    @cached_property
    def _turns(self) -> SharpTurns:
        return SharpTurns(self.pairs, self.points, self.normals)

    def _asked(self, points) -> AskedSextics:
        """What the sextics say that reach points (n, 3), or the nearest one."""
        parts = [self._of_level(points, *one) for one in self._levels]
        which, number, weight = (np.concatenate(column) for column in zip(*parts, strict=True))
        if len(parts) > 1:
            order = np.argsort(which, kind="stable")
            which, number, weight = which[order], number[order], weight[order]
        alone = np.flatnonzero(np.bincount(which, minlength=len(points)) == 0)
        if len(alone):
            number = np.append(number, self._tree.query(points[alone])[1])
            weight = np.append(weight, np.ones(len(alone)))
            which = np.append(which, alone)
            order = np.argsort(which, kind="stable")
            which, number, weight = which[order], number[order], weight[order]
        found, stretch = self.sextics.values(number, points[which])
        level, upward = self._level[number], self.sextics.axes[number, 2]
        return AskedSextics(which, number, weight, level, upward, found, stretch)

    def _of_level(self, points, own, tree: cKDTree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of the sextics ``own`` (k,) of one radius, with a tree of their middles."""
        reach = WEIGHS * self.sextics.radii[own[0]]
        reached = pairs_within(points, tree, reach)
        which = np.repeat(np.arange(len(points)), np.diff(reached.indptr))
        weight = np.maximum(1.0 - (reached.data / reach) ** 2, 0.0) ** 3
        real = weight > 0.0
        return which[real], own[reached.indices[real]], weight[real]

    @cached_property
    def _level(self) -> np.ndarray:
        """(p,) by how many radii of others each sextic is smaller."""
        place = np.unique(-self.sextics.radii, return_inverse=True)[1]
        return np.reshape(place, len(self.sextics))

    @cached_property
    def _levels(self) -> list[tuple[np.ndarray, cKDTree]]:
        """The sextics of each radius, and a tree of their middles."""
        owns = [np.flatnonzero(self._level == k) for k in range(self._level.max() + 1)]
        return [(own, cKDTree(self.sextics.origins[own])) for own in owns]

    @property
    def radius(self) -> float:
        """Largest radius of a sextic, length."""
        return float(self.sextics.radii.max())

    def shape_operators(self, points) -> np.ndarray:
        """(n, 3, 3) shape operators, 1/length, of the sextics whose middles are nearest among those
        that face as the nearest samples do."""
        out, side = np.empty((len(points), 3, 3)), self.sides(points)
        count = min(_ASKED, len(self.sextics))
        near = np.reshape(self._tree.query(points, k=count)[1], (-1, count))
        faces = np.einsum("nkj,nj->nk", self.sextics.axes[near, 2], side) > FACING
        nearest = near[np.arange(len(points)), faces.argmax(axis=1)]
        for k in np.unique(nearest).tolist():
            mine = nearest == k
            out[mine] = self.sextics.piece(k).shape_operators(points[mine])
        return out

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.sextics.origins)

    @cached_property
    def _samples(self) -> cKDTree:
        return cKDTree(self.points)

    def _sides(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normals (n, 3) of the samples nearest to points (n, 3), and of the nearest that face the
        other way; and the points (m,) that have such samples about as near."""
        count = min(_NEAREST, len(self.points))
        away, near = (np.reshape(x, (-1, count)) for x in self._samples.query(points, k=count))
        normals = self.normals[near]
        other = np.einsum("nkj,nj->nk", normals, normals[:, 0]) < _OPPOSITE
        other &= away <= _AS_NEAR * away[:, :1]
        second = normals[np.arange(len(points)), other.argmax(axis=1)]
        return normals[:, 0], second, np.flatnonzero(other.any(axis=1))
