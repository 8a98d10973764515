"""Fit many sextics at once: normal equations at feet, and a prior that all have in common."""

import hashlib
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dtrtri

from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS, Kind, prior_precision
from touchatlas.atlas.surfaces.sextic_sites import SexticSites
from touchatlas.patch.geometry.arrays import evenly
from touchatlas.patch.geometry.polynomial import GRADIENT, derivative_coefficients, monomials

# Order of the height z(x, y) that each coefficient makes.
_HEIGHTS = SEXTIC_BASIS.exponents @ np.array([1, 1, 2])
# Orders whose coefficients have a common size: slopes depend on the frame.
_LEARNED = 2, 3, 4, 5, 6
# Monomials 1, x, y, and of second order, which begin the fit.
_PARABOLOID = 6
_FLAT = np.diag(prior_precision(Kind.SEXTIC))


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


def equations_of(sites: SexticSites, points, stds, before: dict, kept: dict) -> Equations:
    """The normal equations of sextics from samples (n, 3) of standard deviations (n,), length. They
    are ``kept`` by the content that they follow from, and taken from those kept ``before``."""
    noise, local = np.broadcast_to(np.asarray(stds) / sites.radius, len(points)), []
    for middle, axes, some in zip(sites.middles, sites.axes, sites.members, strict=True):
        local.append((points[some] - points[middle]) @ (axes.T / sites.radius))
    keys = [
        hashlib.blake2b(rows.tobytes() + noise[some].tobytes()).digest()
        for rows, some in zip(local, sites.members, strict=True)
    ]
    kept |= {key: before[key] for key in keys if key in before}
    new = list(dict((key, k) for k, key in enumerate(keys) if key not in kept).values())
    # Groups of eight of about the same size: their monomials fit into the cache of a processor.
    sizes = np.array([-(-len(local[k]) // 50) * 50 for k in new], int)
    for size in np.unique(sizes).tolist():
        alike = [new[k] for k in np.flatnonzero(sizes == size)]
        for start in range(0, len(alike), 8):
            group = alike[start : start + 8]
            scaled, real = np.zeros((len(group), size, 3)), np.zeros((len(group), size), bool)
            own = np.ones((len(group), size))
            for row, k in enumerate(group):
                scaled[row, : len(local[k])], real[row, : len(local[k])] = local[k], True
                own[row, : len(local[k])] = noise[sites.members[k]]
            found = _fitted(scaled, real, own)
            for row, k in enumerate(group):
                kept[keys[k]] = found.information[row].copy(), found.right[row].copy()
    return Equations(*(np.array(x) for x in zip(*(kept[key] for key in keys), strict=True)))


def _fitted(scaled, real, noise) -> Equations:
    """Equations of sextics at scaled local points (m, n, 3) that are real or not (m, n), of
    standard deviations (m, n): of distances from them at the feet of the fit before, three times;
    see ``touchatlas.atlas.pieces.fit_piece``."""
    terms = _monomials(scaled)
    weight = real / noise**2
    start = _equations(terms[:, :_PARABOLOID], scaled[..., 2], weight)
    mean = np.pad(coefficients_of(start), ((0, 0), (0, len(_FLAT) - _PARABOLOID)))
    for turn in range(3):
        at, steep, distance, far = _feet(mean, scaled, terms, noise)
        heights = at[..., 2] + steep * distance
        own = _monomials(at)[:, : len(_FLAT)]
        # P. J. Huber 1964: of noise one in 80 weighs less. From the paraboloid all that bends
        # otherwise is far.
        robust = 2.5 / np.maximum(far, 2.5) if turn else 1.0
        found = _equations(own, heights, weight * robust / steep**2)
        mean = coefficients_of(found)
    return found


def coefficients_of(equations: Equations) -> np.ndarray:
    """(m, t) coefficients with the prior of a piece."""
    size = equations.right.shape[1]
    information = equations.information + _FLAT[:size, :size]
    return np.asarray(np.linalg.solve(information, equations.right[..., None])[..., 0])


def _feet(mean, scaled, terms, noise):
    """Feet (m, n, 3) of scaled points on sextics with coefficients (m, t), gradients there (m, n),
    distances of no more than five deviations (m, n), and all of them in deviations (m, n)."""
    values = derivative_coefficients(SEXTIC_BASIS, mean, list(GRADIENT)) @ terms
    gradient = -values[:, 1:].transpose(0, 2, 1)
    gradient[..., 2] += 1.0
    steep = np.maximum(np.sqrt((gradient * gradient).sum(axis=2)), 0.2)
    distance = (scaled[..., 2] - values[:, 0]) / steep
    far = np.abs(distance) / noise
    distance = np.clip(distance, -5.0 * noise, 5.0 * noise)
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


def with_common_prior(equations: Equations, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, t) of the m sextics of a face, as their samples and their common smoothness
    show them, and upper triangular U (m, t, t): their covariances are U' U.

    A derivative of order o is about as large on one sextic as on another of the same radius. The
    sizes of the orders make the samples of 100 sextics most likely: expectation maximisation
    (A. P. Dempster, N. M. Laird, D. B. Rubin, JRSS B 1977), each size with steps ahead
    (A. C. Aitken, 1926). Where samples leave a coefficient open it is as small as it is elsewhere.
    A size is a tenth of the deviation of a sample at least, and ten radii at most.

    Parameters
    ----------
    equations : Equations
    noise : float
        Standard deviation of a sample, in radii.
    """
    some = Equations(*(array[evenly(np.arange(len(array)), 100)] for array in equations))
    bounds = np.log(max((0.1 * noise) ** 2, 1e-24)), np.log(10.0**2)
    sizes = np.clip(_next(some, prior_precision(Kind.SEXTIC)), *bounds)
    for _ in range(3):
        second = np.clip(_next(some, _precision(sizes)), *bounds)
        third = np.clip(_next(some, _precision(second)), *bounds)
        before, sizes = sizes, np.clip(_ahead(sizes, second, third), *bounds)
        if np.abs(sizes - before).max() < 0.1:
            break
    return with_factors(equations, np.diag(_precision(sizes)))


def with_factors(equations: Equations, precision=_FLAT) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, t) with a prior of a precision (t, t), and upper triangular U (m, t, t) of
    covariances U' U: the information, backwards, is L L' (Cholesky), and U is the inverse of L,
    backwards. The covariance itself may be indefinite by rounding."""
    mean, factors = np.empty_like(equations.right), np.empty_like(equations.information, np.float32)
    # In blocks, for the memory that matrices take.
    for start in range(0, len(mean), 64):
        some = slice(start, start + 64)
        lower = np.linalg.cholesky((equations.information[some] + precision)[:, ::-1, ::-1])
        own = _inverses(lower)[:, ::-1, ::-1]
        right = own @ equations.right[some, :, None]
        mean[some], factors[some] = (own.transpose(0, 2, 1) @ right)[..., 0], own
    return mean, factors


def _next(equations: Equations, precision) -> np.ndarray:
    """Logarithms of the mean squares of the coefficients of each order with a prior of a precision
    (t,)."""
    own = _inverses(np.linalg.cholesky(equations.information + np.diag(precision)))
    means = (own.transpose(0, 2, 1) @ (own @ equations.right[..., None]))[..., 0]
    variances = (own * own).sum(axis=1)
    square = (means**2 + variances).mean(axis=0)
    return np.log([square[order == _HEIGHTS].mean() for order in _LEARNED])


def _inverses(lower) -> np.ndarray:
    """(m, t, t) inverses of lower triangular matrices (m, t, t). Of any matrices they take four
    times as long."""
    return np.stack([dtrtri(one, lower=1)[0] for one in lower])


def _precision(sizes) -> np.ndarray:
    """(t,) prior precision of the coefficients, with the logarithms of mean squares of orders."""
    out = prior_precision(Kind.SEXTIC).copy()
    for order, size in zip(_LEARNED, sizes, strict=True):
        out[order == _HEIGHTS] = np.exp(-size)
    return out


def _ahead(first, second, third) -> np.ndarray:
    """Where three numbers lead whose changes fall by a constant ratio, 0.95 at most."""
    change, after = second - first, third - second
    ratio = np.divide(after, change, out=np.zeros_like(change), where=change != 0.0)
    ratio = np.clip(ratio, 0.0, 0.95)
    return np.asarray(third + after * ratio / (1.0 - ratio))
