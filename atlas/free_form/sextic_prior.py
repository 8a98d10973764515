"""The prior of the coefficients of many sextics, learned from all of them."""

import numpy as np

from touchatlas.atlas.free_form.sextic_fits import Equations
from touchatlas.atlas.labels.grow import evenly
from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS, Kind, prior_precision

# Order of the height z(x, y) that each coefficient makes.
_HEIGHTS = SEXTIC_BASIS.exponents @ np.array([1, 1, 2])
# Orders whose coefficients have a common size. Doubled, slopes would count, too: they depend on the
# frame.
_LEARNED = 2, 3, 4, 5, 6
# Pairs of rounds of expectation and maximisation at most, with a step ahead after each pair.
# Doubled, only sizes change that are below what the samples can tell.
_PAIRS = 3
# Sextics from which the prior is learned. Doubled, it takes twice as long, and nothing changes;
# at a fourth, shares within the tolerance changed by a hundredth.
_SOME = 100
# Change of the logarithm of a mean square by a pair of rounds and a step, at which they end.
# Doubled, sizes are off by a tenth.
_SETTLED = 0.1
# Largest ratio of the changes of two rounds: a step ahead is up to this over one minus this times
# as long. Doubled in one minus this, rounds are more where they settle slowly.
_RATIO = 0.95
# Least size, in deviations of a sample: smaller ones are not told from nothing. Doubled, nothing
# changes.
_LEAST = 0.1
# Mean square below which nothing is told, no unit: that of rounding.
_TINY = 1e-24
# Largest size, in radii: no sample shows one beyond its sextic, and steps ahead would go on without
# end where samples lie at fewer places than there are parameters. Doubled, nothing changes.
_MOST = 10.0


def with_common_prior(equations: Equations, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, t) of the m sextics of a face, as their samples and their common smoothness
    show them, and upper triangular U (m, t, t): their covariances are U' U.

    A derivative of order o is about as large on one sextic as on another of the same radius. The
    sizes of the orders make all samples most likely: expectation maximisation (A. P. Dempster,
    N. M. Laird, D. B. Rubin, JRSS B 1977), each size with steps ahead (A. C. Aitken, 1926). Where
    samples leave a coefficient open it is as small as it is elsewhere.

    Parameters
    ----------
    equations : Equations
    noise : float
        Standard deviation of a sample, in radii.
    """
    some = Equations(*(array[evenly(np.arange(len(array)), _SOME)] for array in equations))
    bounds = np.log(max((_LEAST * noise) ** 2, _TINY)), np.log(_MOST**2)
    sizes = np.clip(_next(some, prior_precision(Kind.SEXTIC)), *bounds)
    for _ in range(_PAIRS):
        second = np.clip(_next(some, _precision(sizes)), *bounds)
        third = np.clip(_next(some, _precision(second)), *bounds)
        before, sizes = sizes, np.clip(_ahead(sizes, second, third), *bounds)
        if np.abs(sizes - before).max() < _SETTLED:
            break
    return _with_factors(equations, _precision(sizes))


def _with_factors(equations: Equations, precision) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, t) with a prior of a precision (t,), and upper triangular U (m, t, t) of
    covariances U' U: the information, backwards, is L L' (Cholesky), and U is the inverse of L,
    backwards. The covariance itself may be indefinite by rounding."""
    information = equations.information + np.diag(precision)
    lower = np.linalg.cholesky(information[:, ::-1, ::-1])
    factors = np.linalg.inv(lower)[:, ::-1, ::-1]
    right = factors @ equations.right[..., None]
    return (factors.transpose(0, 2, 1) @ right)[..., 0], factors


def _next(equations: Equations, precision) -> np.ndarray:
    """Logarithms of the mean squares of the coefficients of each order with a prior of a precision
    (t,)."""
    means, covariances = _posterior(equations, precision)
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    square = (means**2 + variances).mean(axis=0)
    return np.log([square[order == _HEIGHTS].mean() for order in _LEARNED])


def _posterior(equations: Equations, precision) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (m, t) and covariances (m, t, t) with a prior of a precision (t,)."""
    covariances = np.linalg.inv(equations.information + np.diag(precision))
    return (covariances @ equations.right[..., None])[..., 0], covariances


def _precision(sizes) -> np.ndarray:
    """(t,) prior precision of the coefficients, with the logarithms of mean squares of orders."""
    out = prior_precision(Kind.SEXTIC).copy()
    for order, size in zip(_LEARNED, sizes, strict=True):
        out[order == _HEIGHTS] = np.exp(-size)
    return out


def _ahead(first, second, third) -> np.ndarray:
    """Where three numbers lead whose changes fall by a constant ratio."""
    change, after = second - first, third - second
    ratio = np.divide(after, change, out=np.zeros_like(change), where=change != 0.0)
    ratio = np.clip(ratio, 0.0, _RATIO)
    return np.asarray(third + after * ratio / (1.0 - ratio))
