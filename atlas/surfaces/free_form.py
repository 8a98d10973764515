"""FreeFormSurface: overlapping sextics of a free-form face, averaged by a partition of unity."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.surfaces.kriging import ResidualKriging, krige, neighbours
from touchatlas.atlas.surfaces.placed_sextics import PlacedSextics
from touchatlas.atlas.surfaces.sextic_mean import Evaluated, Mean, Sides
from touchatlas.atlas.surfaces.sextic_sites import FACING
from touchatlas.atlas.surfaces.sextics import Sextics, joined
from touchatlas.atlas.surfaces.sharp_turns import SharpTurns

# Largest cosine of the normals of two sheets: opposite sides of a wall or of a slot.
_OPPOSITE = -0.3
# Samples nearest to a point that tell its sides.
_NEAREST = 12


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
    sextics : Sextics
        Each fitted within its radius about its middle.
    points, normals : (n, 3) float, length; unit, world
        The samples, and outward normals that tell the sides.
    stds : (n,) float, length, optional
        Standard deviations of the samples; without, the sextics are all there is.
    least : float, length
        Amplitude of what the sextics leave out that is not sought.
    kept : dict
        Normal equations of sextics, and whether a radius follows samples, by what they follow from,
        for the next fit.
    pairs : (k, 2) int
        Samples on both sides of the places at which contours run over a sharp edge.
    """

    sextics: Sextics
    points: np.ndarray
    normals: np.ndarray
    stds: np.ndarray | None = None
    least: float = 0.0
    kept: dict = field(default_factory=dict)
    pairs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), int))

    def values(self, points) -> np.ndarray:
        """(n, 5) distance, normal and variance at points (n, 3). Beyond its scale a sextic goes on
        as the plane that touches it in its middle; its deviation grows as it does.

        The variance is that of the sextic that weighs most, that of the sextics about their mean
        (the law of total variance), and that of what they leave out: the coefficients say nothing
        of a shape that no sextic has. At an edge or a tip that no contour met sextics differ, and
        on a rough surface all of them leave the same out.
        """
        return self.values_of(self.mean_at(points), points)

    def values_of(self, mean: Mean, points) -> np.ndarray:
        """(n, 5) the same, from the mean of the sextics at points (n, 3)."""
        values, left = self._with_rest(mean.values, points)
        return np.column_stack([values, self._variance(mean, points) + left])

    def level(self, points) -> np.ndarray:
        """(n, 4) distance and normal of these values alone, which take less time."""
        return self._with_rest(self.mean_at(points).values, points)[0]

    def _with_rest(self, values, points) -> tuple[np.ndarray, np.ndarray]:
        """Distance and normal (n, 4) at points (n, 3), moved by what the sextics leave out, and the
        variance (n,) of that."""
        if self.stds is None:
            return values, np.zeros(len(values))
        feet = points - values[:, :1] * values[:, 1:]
        residual, variance = self.rest.at(feet, values[:, 1:])
        return np.column_stack([values[:, 0] - residual, values[:, 1:]]), variance

    def mean_at(self, points) -> Mean:
        """What sextics say of points (n, 3) together: those of the nearer side of a wall, cut by
        the other side of a sharp edge."""
        sides = self._sides(points)
        if len(self.pairs):
            return self._mean_of(self._placed.evaluated(points), sides, points)
        mean = self._mean_of(self._placed.evaluated(points, sides), sides, points)
        # A sextic that faces away weighs nothing, unless all that face a side are folded there.
        lost = np.flatnonzero(~mean.faces)
        if not len(lost):
            return mean
        points = points[lost]
        every = self._mean_of(self._placed.evaluated(points), self._sides(points), points)
        return mean.replaced(lost, every, slice(None))

    def at(self, points) -> np.ndarray:
        """(n, 4) distance and normal of the sextics alone at points (n, 3)."""
        return self.mean_at(points).values

    def distances(self, points) -> np.ndarray:
        """(n,) signed distances of points (n, 3) from the sextics alone, length."""
        return self.mean_at(points).values[:, 0]

    @cached_property
    def at_samples(self) -> np.ndarray:
        """(n, 4) the same at the samples. The side of each is its own."""
        sides = Sides(self.normals, self.normals, np.zeros(0, int))
        return self._mean_of(self._of_samples, sides, self.points).values

    @cached_property
    def _of_samples(self) -> Evaluated:
        return self._placed.with_nearest(self._reached_samples, self.points)

    @cached_property
    def _reached_samples(self) -> Evaluated:
        return self._placed.told(*self._placed.within(self._samples), self.points)

    def with_finer(self, sextics: Sextics) -> "FreeFormSurface":
        """The same surface with smaller sextics as well. What the larger ones say of the samples is
        not asked again."""
        if not len(sextics):
            return self
        found = self._with(sextics=joined([self.sextics, sextics]))
        which, number, weight = PlacedSextics(sextics, self.radius).within(self._samples)
        new = found._placed.told(which, number + len(self.sextics), weight, self.points)
        vars(found)["_reached_samples"] = self._reached_samples.joined(new)
        return found

    def with_own_sides(self, stds) -> "FreeFormSurface":
        """The same surface, whose own normals at the samples, of deviations (n,), tell the
        sides."""
        normals = self.at_samples[:, 1:4].copy()
        stray, sides = self._strays(stds)
        normals[stray] = sides
        found = self._with(normals=normals, stds=stds)
        vars(found)["_of_samples"] = self._of_samples
        return found

    def _with(self, **changes) -> "FreeFormSurface":
        """The same surface with changes. What follows from the places of samples alone stays."""
        found = replace(self, **changes)
        kept = {k: v for k, v in vars(self).items() if k in ("_samples", "groups")}
        vars(found).update(kept)
        return found

    @cached_property
    def groups(self) -> np.ndarray:
        """(n, k) the thirty samples about each, itself first."""
        return neighbours(self._samples, np.arange(len(self.points)))

    def _strays(self, stds) -> tuple[np.ndarray, np.ndarray]:
        """The samples (k,) that all samples about them face away from, and the normals (k, 3) there
        of the surface that these are on, where it passes them as near as these, or as the
        deviations (n,) of samples allow.

        A section along the surface shows nothing of its normal.
        """
        off, normals = np.abs(self.at_samples[:, 0]), self.at_samples[:, 1:4]
        near = self.groups[:, 1:_NEAREST]
        others = np.einsum("nkj,nj->nk", normals[near], normals)
        stray = np.flatnonzero((others < FACING).all(axis=1))
        if not near.size or not len(stray):
            return stray[:0], normals[:0]
        found = self._of_samples.some(stray).mean(normals[near[stray, 0]]).values
        limit = np.maximum(off[near[stray]].max(axis=1), 3.0 * stds[stray])
        on = np.abs(found[:, 0]) < limit
        return stray[on], found[on, 1:4]

    @cached_property
    def rest(self) -> ResidualKriging:
        """What the sextics leave out, as samples of deviations ``stds`` show."""
        values = self.at_samples
        # It takes more memory than all else, and is not needed again.
        del self.__dict__["_of_samples"]
        columns = self.points, values[:, 1:4], values[:, 0], self.stds
        return krige(*columns, self.radius, self.least, (self._samples, self.groups))

    def sides(self, points) -> np.ndarray:
        """(n, 3) normals of the samples nearest to points (n, 3)."""
        return self.normals[self._samples.query(points)[1]]

    def leading(self, points) -> np.ndarray:
        """(n,) the sextic that weighs most at each of points (n, 3)."""
        return self.mean_at(points).number

    def reaching(self, points) -> np.ndarray:
        """(m,) the sextics that reach some of points (n, 3) and face as samples do there."""
        evaluated = self._placed.evaluated(points)
        side = self.sides(points)[evaluated.which]
        faces = np.einsum("ij,ij->i", evaluated.upward, side) > FACING
        return np.unique(evaluated.number[faces])

    def shape_operators(self, points) -> np.ndarray:
        """(n, 3, 3) shape operators, 1/length, of the sextics that weigh most at points (n, 3)."""
        out, leading = np.empty((len(points), 3, 3)), self.leading(points)
        for k in np.unique(leading).tolist():
            mine = leading == k
            out[mine] = self.sextics.piece(k).shape_operators(points[mine])
        return out

    @property
    def sample_counts(self) -> np.ndarray:
        """Number (m,) of the samples within the radius of each sextic."""
        sextics = self.sextics
        return np.asarray(
            self._samples.query_ball_point(sextics.origins, sextics.radii, return_length=True)
        )

    @cached_property
    def radius(self) -> float:
        """Largest radius of a sextic, length."""
        return float(self.sextics.radii.max())

    def _variance(self, mean: Mean, points) -> np.ndarray:
        """(n,) variance, length^2, of what sextics say together of points (n, 3)."""
        return self.sextics.variances(mean.number, points) * mean.stretch**2 + mean.spread

    def _mean_of(self, evaluated: Evaluated, sides: Sides, points) -> Mean:
        """The same, where each sextic is evaluated."""
        first, second, rows = sides
        mean = evaluated.mean(first)
        if len(rows):
            other = evaluated.some(rows).mean(second[rows])
            # No other sextic confirms a side that one alone shows: either side may be there.
            half = 0.5 * (other.values[:, 0] - mean.values[rows, 0])
            doubt = np.maximum(2.0 * other.alone - 1.0, 0.0) * half**2
            other = replace(other, spread=other.spread + doubt)
            nearer = np.abs(other.values[:, 0]) < np.abs(mean.values[rows, 0])
            faces = mean.faces.copy()
            faces[rows] &= other.faces
            mean = replace(mean.replaced(rows[nearer], other, nearer), faces=faces)
        return self._cut(mean, evaluated, points, first) if len(self.pairs) else mean

    def _cut(self, mean: Mean, evaluated: Evaluated, points, sides) -> Mean:
        """What is said of points (n, 3) up to a radius beside sharp turns, with the normals
        ``sides`` (n, 3) of the nearest samples. The sextics of the own side of a turn have a point
        up to the other side: at a convex edge the distance is the larger one of both, at a concave
        edge the smaller one, as in the piecewise quadrics of Ohtake and others (2003). Where the
        other side is much less sure than the own one, it must be surely beyond that."""
        beside = self._turns.beside(points, sides, self.radius)
        rows = beside.rows
        evaluated, points = evaluated.some(rows), points[rows]
        own = evaluated.mean(beside.own, beside.other)
        other = evaluated.mean(beside.other, beside.own)
        at = np.where(own.faces, own.values[:, 0], mean.values[rows, 0])
        gap = beside.sign * (other.values[:, 0] - at)
        beyond, unsure = other.faces & (gap > 0.0), self._variance(other, points)
        surely = unsure <= (gap / 2.0) ** 2
        cuts = beyond & (surely | (unsure <= 3.0**2 * self._variance(own, points)))
        mean = mean.replaced(rows[own.faces], own, own.faces)
        return mean.replaced(rows[cuts], other, cuts)

    def _sides(self, points) -> Sides:
        """Normals (n, 3) of the samples nearest to points (n, 3), and of the nearest of some that
        face the other way; and the points (m,) that have such samples no more than four times as
        far away."""
        count = min(_NEAREST, len(self.points))
        away, near = (np.reshape(x, (-1, count)) for x in self._samples.query(points, k=count))
        normals = self.normals.take(near, axis=0)
        other = np.einsum("nkj,nj->nk", normals, normals[:, 0]) < _OPPOSITE
        other &= away <= 4.0 * away[:, :1]
        second = normals[np.arange(len(points)), other.argmax(axis=1)]
        return Sides(normals[:, 0], second, np.flatnonzero(other.any(axis=1)))

    @cached_property
    def _turns(self) -> SharpTurns:
        return SharpTurns(self.pairs, self.points, self.normals)

    @cached_property
    def _placed(self) -> PlacedSextics:
        return PlacedSextics(self.sextics)

    @cached_property
    def _samples(self) -> cKDTree:
        return cKDTree(self.points)
