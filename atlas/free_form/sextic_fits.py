"""Normal equations of many sextics at once, kept from one fit of a face to the next."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from touchatlas.atlas.free_form.sextic_sites import SexticSites
from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS, Kind, prior_precision
from touchatlas.patch.geometry.polynomial import GRADIENT, derivative_coefficients, monomials

# Fits at the feet of the fit before: see touchatlas.atlas.pieces.fit_piece. Doubled, it takes twice
# the time.
_AT_FEET = 3
# Largest distance of a sample from its foot, in standard deviations. Doubled, feet are sought where
# the fit before does not hold.
_FARTHEST = 5.0
# Distance from which a sample weighs less the farther it is, in standard deviations (P. J. Huber,
# 1964): of noise one in 80 does. Doubled, a dimple bends the surface about it.
_ROBUST = 2.5
# Least gradient in a weight, no unit. Doubled, samples near a crossing weigh less.
_LEAST_GRADIENT = 0.2
# Monomials 1, x, y, and of second order, which begin the fit.
_PARABOLOID = 6
# Samples by which the arrays of a group grow. Doubled, smaller sextics take more time.
_STEP = 50
# Sextics of a group: their monomials fit into the cache. Doubled, nothing changes.
_GROUP = 8
_PRECISION = np.diag(prior_precision(Kind.SEXTIC))


class Equations(NamedTuple):
    """What samples say of the coefficients of sextics, without a prior.

    Parameters
    ----------
    information : (m, t, t) float, no unit
        Inverse covariance.
    right : (m, t) float, no unit
        That times the coefficients.
    """

    information: np.ndarray
    right: np.ndarray


@dataclass(frozen=True, eq=False)
class SexticFits:
    """Normal equations of sextics of the same samples. Those that were found before with the first
    of the samples are taken from there, so that only sextics with other members are fitted.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
    std : float, length
        Standard deviation of a sample's distance.
    before : dict
        Equations by radius, middle, axes and members.
    kept : dict
        The same of what was asked.
    """

    points: np.ndarray
    normals: np.ndarray
    std: float
    before: dict = field(default_factory=dict)
    kept: dict = field(default_factory=dict)

    def following(self, points, normals, std: float) -> "SexticFits":
        """Fits of the same samples and more, or of others."""
        count = len(self.points)
        same = std == self.std and np.array_equal(self.points, points[:count])
        same = same and np.array_equal(self.normals, normals[:count])
        return SexticFits(points, normals, std, self.kept if same else {})

    def equations(self, sites: SexticSites) -> Equations:
        """Those of sextics."""
        rows = zip(sites.middles.tolist(), sites.axes, sites.members, strict=True)
        keys = [(sites.radius, k, axes.tobytes(), some.tobytes()) for k, axes, some in rows]
        self.kept.update({key: self.before[key] for key in keys if key in self.before})
        new = [k for k, key in enumerate(keys) if key not in self.kept]
        sizes = np.array([-(-len(sites.members[k]) // _STEP) * _STEP for k in new], int)
        for size in np.unique(sizes).tolist():
            alike = np.flatnonzero(sizes == size)
            for start in range(0, len(alike), _GROUP):
                group = [new[k] for k in alike[start : start + _GROUP]]
                scaled, real = self._scaled(sites, group, size)
                found = _fitted(scaled, real, self.std / sites.radius)
                for row, k in enumerate(group):
                    self.kept[keys[k]] = found.information[row].copy(), found.right[row].copy()
        both = [self.kept[key] for key in keys]
        return Equations(*(np.array(column) for column in zip(*both, strict=True)))

    def _scaled(self, sites: SexticSites, group, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Scaled local coordinates (g, size, 3) of the members of a group of sextics, and which of
        them are real (g, size); the others are zero."""
        out, real = np.zeros((len(group), size, 3)), np.zeros((len(group), size), bool)
        for row, k in enumerate(group):
            some = sites.members[k]
            offset = self.points[some] - self.points[sites.middles[k]]
            out[row, : len(some)] = offset @ (sites.axes[k].T / sites.radius)
            real[row, : len(some)] = True
        return out, real


def _fitted(scaled, real, noise: float) -> Equations:
    """Equations of sextics at scaled local points (m, n, 3) that are real or not (m, n), of a
    standard deviation: of distances from them at the feet of the fit before."""
    terms = _monomials(scaled)
    weight = real / noise**2
    start = _equations(terms[:, :_PARABOLOID], scaled[..., 2], weight)
    mean = np.pad(coefficients_of(start), ((0, 0), (0, len(_PRECISION) - _PARABOLOID)))
    for turn in range(_AT_FEET):
        at, steep, distance, far = _feet(mean, scaled, terms, noise)
        heights = at[..., 2] + steep * distance
        own = _monomials(at)[:, : len(_PRECISION)]
        # From the paraboloid all that bends otherwise is far.
        robust = _ROBUST / np.maximum(far, _ROBUST) if turn else 1.0
        found = _equations(own, heights, weight * robust / steep**2)
        mean = coefficients_of(found)
    return found


def coefficients_of(equations: Equations, precision=_PRECISION) -> np.ndarray:
    """(m, t) coefficients with a prior of the precision (t, t)."""
    size = equations.right.shape[1]
    information = equations.information + precision[:size, :size]
    return np.asarray(np.linalg.solve(information, equations.right[..., None])[..., 0])


def _feet(mean, scaled, terms, noise: float):
    """Feet (m, n, 3) of scaled points on sextics with coefficients (m, t), gradients there (m, n),
    distances of no more than some deviations (m, n), and all of them in deviations (m, n)."""
    values = derivative_coefficients(SEXTIC_BASIS, mean, list(GRADIENT)) @ terms
    gradient = -values[:, 1:].transpose(0, 2, 1)
    gradient[..., 2] += 1.0
    steep = np.maximum(np.sqrt((gradient * gradient).sum(axis=2)), _LEAST_GRADIENT)
    distance = (scaled[..., 2] - values[:, 0]) / steep
    far = np.abs(distance) / noise
    distance = np.clip(distance, -_FARTHEST * noise, _FARTHEST * noise)
    return scaled - (distance / steep)[..., None] * gradient, steep, distance, far


def _equations(terms, heights, weight) -> Equations:
    """Equations of weighted heights (m, n) where the monomials are terms (m, t, n)."""
    root = np.sqrt(weight)[:, None]
    weighted = terms * root
    right = weighted @ (heights[:, None] * root).transpose(0, 2, 1)
    return Equations(weighted @ weighted.transpose(0, 2, 1), right[..., 0])


def _monomials(scaled) -> np.ndarray:
    """(m, s, n) monomials at scaled points (m, n, 3)."""
    x, y, z = (scaled[..., axis] for axis in range(3))
    return monomials(SEXTIC_BASIS, x, y, z).transpose(1, 0, 2)
