"""FreeFormSurface: overlapping sextics of a free-form face, averaged by a partition of unity."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.residual_kriging import ResidualKriging
from touchatlas.atlas.faces.sextic_batch import SexticBatch
from touchatlas.atlas.faces.sextic_fits import SexticFits
from touchatlas.atlas.faces.sextic_sites import FACING, pairs_within

# Middles among which the nearest one is sought that faces as a point does: about as many as reach
# it from both sides of a wall. Doubled, nothing changes.
_ASKED = 24
# Distance from its middle at which a sextic no longer weighs, in radii. At 0.8 errors were up to
# 6 % larger. Doubled, it takes four times as long.
_WEIGHS = 0.9
# Nearest samples among which one may be of another sheet, and its distance over that of the
# nearest. Doubled, both sides of thicker walls are compared.
_NEAREST, _AS_NEAR = 12, 4.0
# Largest cosine of the normals of two sheets: opposite sides of a wall or of a slot. Doubled in
# angle, strong bends are walls.
_OPPOSITE = -0.3
# Weight of a sextic that faces away from the side of a point: it counts where no other one does.
# That of one that is folded there is the square of it. Squared, nothing changes.
_SLIGHT = 1e-50
# Share of smaller sextics at a point, over that in the middle of one, at which larger ones have
# none: half-way to where it no longer weighs. Doubled, one small sextic has more of the surface.
_COVERS = 3.0


@dataclass(frozen=True, eq=False)
class FreeFormSurface:
    """Overlapping sextics, averaged at each point with weights that fall to zero with the distance
    from their middles and with the angle to their normals: the partition of unity of Y. Ohtake,
    A. Belyaev, M. Alexa, G. Turk, H.-P. Seidel, "Multi-level partition of unity implicits",
    SIGGRAPH 2003.

    Of two sides of a wall the nearer one has a point. Only sextics that face as the samples of a
    side do are averaged.

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
    """

    sextics: SexticBatch
    points: np.ndarray
    normals: np.ndarray
    rest: ResidualKriging | None = None
    fits: SexticFits | None = None

    def values(self, points, texture: bool = True) -> np.ndarray:
        """(n, 5) distance, normal and variance at points (n, 3), with or without what the sextics
        leave out. Beyond its scale a sextic goes on as the plane that touches it in its middle; its
        deviation grows as it does.

        The variance is that of the sextic that weighs most, and that of the sextics about their
        mean (the law of total variance): its coefficients say nothing of a shape that no sextic
        has, as at an edge or a tip that no contour met, but there sextics differ.
        """
        mean, number, stretch, spread = self._of_sextics(points)
        variance = self.sextics.variances(number, points) * stretch**2 + spread
        found = np.column_stack([mean, variance])
        if texture and self.rest is not None:
            self.rest.correct(points, found)
        return found

    def at(self, points) -> np.ndarray:
        """(n, 4) distance and normal at points (n, 3), without what the sextics leave out."""
        return self._of_sextics(points)[0]

    def _of_sextics(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(n, 4) distance and normal; the sextic (n,) that weighs most, whose deviation holds, with
        the length (n,) of a unit of its heights; and the variance (n,) of the sextics."""
        which, number, weight = self._asked(points)
        found, stretch = self.sextics.values(number, points[which])
        upward, level = self.sextics.axes[number, 2], self._level[number]
        first, second, rows = self._sides(points)
        mean, lead, spread, _ = _averaged(which, weight, level, upward, found, first)
        if len(rows):
            some = np.flatnonzero(np.isin(which, rows))
            at = np.searchsorted(rows, which[some])
            taken = at, weight[some], level[some], upward[some], found[some], second[rows]
            other, its, far, alone = _averaged(*taken)
            # No other sextic confirms a side that one alone shows: either side may be there.
            far += np.maximum(2.0 * alone - 1.0, 0.0) * (0.5 * (other[:, 0] - mean[rows, 0])) ** 2
            nearer = np.abs(other[:, 0]) < np.abs(mean[rows, 0])
            mean[rows[nearer]], lead[rows[nearer]] = other[nearer], some[its[nearer]]
            spread[rows[nearer]] = far[nearer]
        return mean, number[lead], stretch[lead], spread

    def _asked(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which of points (n, 3), ascending, ask which sextics (m,), and weights of these: those
        that reach them, or the nearest one."""
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
        return which, number, weight

    def _of_level(self, points, own, tree: cKDTree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of the sextics ``own`` (k,) of one radius, with a tree of their middles."""
        reach = _WEIGHS * self.sextics.radii[own[0]]
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
        out, side = np.empty((len(points), 3, 3)), self.normals[self._samples.query(points)[1]]
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


def _averaged(
    which, weight, level, upward, found, sides
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(n, 4) distance and normal at n points, from what sextics ``found`` (m, 4) at points
    ``which`` (m,), ascending, each of them: the mean of those that face as ``sides`` (n, 3), by
    weights (m,) that fall with the angle to their normals ``upward`` (m, 3), where no sextics of a
    higher level (m,) have the point; the place (n,) of the
    one that weighs most; the variance (n,) of their distances; and the sum of the squares of their
    weights (n,), 1 where one has a point alone."""
    side = sides[which]
    faces = np.einsum("ij,ij->i", found[:, 1:4], side) > 0.0
    turned = np.maximum(np.einsum("ij,ij->i", upward, side) - FACING, _SLIGHT)
    share = np.where(faces, turned, _SLIGHT**2) * weight
    if level.any():
        share = _left_by_smaller(which, share, level, len(sides))
    first = np.searchsorted(which, np.arange(len(sides) + 1))
    if not len(sides):
        return np.empty((0, 4)), first[:0], np.empty(0), np.empty(0)
    most = np.flatnonzero(share == np.maximum.reduceat(share, first[:-1])[which])
    most = most[np.searchsorted(which[most], np.arange(len(sides)))]
    share /= np.add.reduceat(share, first[:-1])[which]
    mean = csr_array((share, np.arange(len(which)), first), (len(sides), len(which))) @ found
    off = found[:, 0] - mean[which, 0]
    # Sextics are less sure where they weigh less: squares of weights count. The variance of n alike
    # sextics about their own mean is too small by (n - 1) / n; that of fewer than two is taken
    # twice.
    square = share * share
    alone = np.add.reduceat(square, first[:-1])
    few = np.add.reduceat(square * square, first[:-1]) / alone**2
    spread = np.add.reduceat(square * off**2, first[:-1]) / (alone * np.maximum(1.0 - few, 0.5))
    length = np.sqrt((mean[:, 1:4] ** 2).sum(axis=1))
    mean[:, 1:4] /= np.maximum(length, np.finfo(float).tiny)[:, None]
    return mean, most, spread, alone


def _left_by_smaller(which, share, level, count: int) -> np.ndarray:
    """(m,) shares (m,) of sextics at ``count`` points ``which`` (m,), less where sextics of higher
    levels (m,) have these: none about the middle of one."""
    out, left = share.copy(), np.ones(count)
    for k in range(level.max(), -1, -1):
        own = level == k
        out[own] *= np.maximum(left[which[own]], _SLIGHT)
        covered = np.bincount(which[own], _COVERS * share[own], count)
        left *= np.maximum(1.0 - covered, 0.0)
    return out
