"""Trend plus residual: what a patch's polynomial does not explain, as a Gaussian process.

Real objects have detail finer than a patch. Their height is z = phi + g. Here phi, the trend, is
the polynomial with its prior; g, the residual, is a Gaussian process of zero mean along the
surface. Both form one Gaussian model (universal kriging). Given the covariance of g, the
coefficients have ordinary normal equations with its inverse as weights, so prior, evidence and
posterior of polynomials apply. Rasmussen and Williams, Gaussian Processes for Machine Learning,
2006, sections 2.7 and 5.4; Stein, Interpolation of Spatial Data, 1999.

All functions take a stack of m patches with n samples each, in each patch's frame over its radius.
"""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.patch.fit.smoothness import NormalEquations, posterior

# Least standard deviation of a sample, as a fraction of the amplitude, against rounding. Doubled,
# residuals follow exact samples half as closely.
_NUGGET = 1e-3


@dataclass(frozen=True, eq=False)
class Residual:
    """The residuals of m patches, given their samples.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
        Feet of the samples.
    amplitude, length : (m,) float, scaled
        Standard deviation and correlation length of the residual.
    force : (m, n) float
        ``inverse`` times the differences of the heights from the trend; 0 where the stack is
        padded. The mean of g is the sum of its covariances with the samples times these.
    inverse : (m, n, n) float
        Inverse of the covariance of the samples about their trend.
    influence : (m, n, t) float
        ``inverse`` times the monomials.
    """

    feet: np.ndarray
    amplitude: np.ndarray
    length: np.ndarray
    force: np.ndarray
    inverse: np.ndarray
    influence: np.ndarray

    def __getitem__(self, rows) -> "Residual":
        """The residuals of some patches."""
        return Residual(*(getattr(self, field.name)[rows] for field in fields(self)))


def matern(distance):
    """Matern correlation of smoothness 5/2 at distances r over its length.

    k = (1 + s + s^2/3) exp(-s) with s = sqrt(5) r. Its paths have two derivatives, so a surface has
    a curvature. Rasmussen and Williams, equation (4.17).

    >>> round(float(matern(np.array([1.0]))[0]), 3)
    0.524
    """
    s = np.sqrt(5.0) * distance
    # In place: for a stack of large matrices, new arrays would take most of the time.
    value = s / 3.0
    value += 1.0
    value *= s
    value += 1.0
    value *= np.exp(np.negative(s, out=s), out=s)
    return value


def matern_slope(distance):
    """Derivative of ``matern`` by r, divided by r: -5/3 (1 + s) exp(-s)."""
    s = np.sqrt(5.0) * distance
    return (-5.0 / 3.0) * (1.0 + s) * np.exp(-s)


def correlation(samples: PatchSamples, length) -> np.ndarray:
    """(m, n, n) Matern correlations of the samples, by distance in space, for lengths (m,), scaled.
    They are 0 where the stack is padded."""
    used = samples.used
    apart = _distances(samples.feet, samples.feet)
    apart /= length[:, None, None]
    matrix = matern(apart)
    if not used.all():
        matrix *= used[:, :, None] & used[:, None, :]
    return matrix


def sample_covariance(samples: PatchSamples, amplitude, length) -> np.ndarray:
    """(m, n, n) covariance of the samples about their trend, scaled^2: a^2 k + diag(s^2 / w).

    Where the stack is padded, the variance is 1 and the covariances are 0.
    """
    matrix = correlation(samples, length)
    matrix *= (amplitude**2)[:, None, None]
    np.einsum("mnn->mn", matrix)[...] += _own_variance(samples, amplitude)
    return matrix


def _own_variance(samples: PatchSamples, amplitude) -> np.ndarray:
    """(m, n) variance of each sample alone: its noise; 1 where the stack is padded."""
    noise = (samples.noise**2)[:, None] / np.where(samples.used, samples.weight, 1.0)
    noise += (_NUGGET * amplitude[:, None]) ** 2
    return np.where(samples.used, noise, 1.0)


def trend_equations(samples: PatchSamples, amplitude, correlations):
    """Normal equations of the trend, with the covariance A of the samples about it.

    Parameters
    ----------
    samples : PatchSamples
    amplitude : (m,) float, scaled
    correlations : (m, n, n) float
        From ``correlation``.

    Returns
    -------
    equations : NormalEquations
        For noise 1.
    log_scale : (m,) float
        -log|A|/2, a term of the evidence.

    Notes
    -----
    Generalised least squares with gram Phi A^-1 Phi^t and right side Phi A^-1 z: Rasmussen and
    Williams, section 2.7. The Cholesky factor of A bordered by the columns of Phi^t and z has L^-1
    times these columns below the factor L of A, if the corner is large enough.
    """
    columns = np.concatenate([samples.terms.transpose(1, 0, 2), samples.height[:, None]], axis=1)
    columns *= samples.used[:, None]
    own = _own_variance(samples, amplitude)
    n, size = own.shape[1], own.shape[1] + columns.shape[1]
    bordered = np.zeros((len(own), size, size))
    np.multiply(correlations, (amplitude**2)[:, None, None], out=bordered[:, :n, :n])
    bordered[:, n:, :n] = columns
    diagonal = np.einsum("mnn->mn", bordered)
    diagonal[:, :n] += own
    diagonal[:, n:] = 1.0 + 2.0 * np.einsum("mkn,mkn,mn->m", columns, columns, 1.0 / own)[:, None]
    factor = np.linalg.cholesky(bordered)
    log_scale = -np.log(np.einsum("mnn->mn", factor)[:, :n]).sum(axis=1)
    half = factor[:, n:, :n]
    sums = half @ half.transpose(0, 2, 1)
    count = np.count_nonzero(samples.used, axis=1).astype(float)
    equations = NormalEquations(sums[:, :-1, :-1], sums[:, :-1, -1], sums[:, -1, -1], count)
    return equations, log_scale


def solve_residual(samples: PatchSamples, amplitude, length, precision):
    """Trend and residual of m patches together, given their samples.

    Parameters
    ----------
    samples : PatchSamples
    amplitude, length : (m,) float, scaled
    precision : (m, t) float
        Prior precision of the coefficients.

    Returns
    -------
    mean : (m, t) float, scaled
        Coefficients of the trend.
    covariance : (m, t, t) float, scaled^2
        Covariance of the coefficients.
    residual : Residual
    """
    used, terms = samples.used, samples.terms.transpose(1, 2, 0)
    inverse = np.linalg.inv(sample_covariance(samples, amplitude, length))
    inverse *= used[:, :, None] & used[:, None, :]
    influence = inverse @ terms
    gram = terms.transpose(0, 2, 1) @ influence
    rhs = (influence.transpose(0, 2, 1) @ samples.height[..., None])[..., 0]
    one = np.ones(len(amplitude))
    mean, covariance = posterior(0.5 * (gram + gram.swapaxes(1, 2)), rhs, one, precision)
    left = samples.height - np.einsum("mt,tmn->mn", mean, samples.terms)
    force = (inverse @ left[..., None])[..., 0]
    return mean, covariance, Residual(samples.feet, amplitude, length, force, inverse, influence)


def residual_at(residual: Residual, points):
    """Mean of the residuals at points, its gradient, and its covariances with the samples.

    Parameters
    ----------
    residual : Residual
    points : (m, q, 3) float, scaled, local

    Returns
    -------
    mean : (m, q) float, scaled
        Term to add to phi.
    gradient : (m, q, 3) float
        Gradient of the mean in x, y and z, to add to that of phi.
    shared : (m, q, n) float, scaled^2
        Covariances of the residual with the samples, for ``joint_variance``.
    """
    length = residual.length[:, None, None]
    variance = (residual.amplitude**2)[:, None, None]
    apart = _distances(points, residual.feet) / length
    shared = variance * matern(apart)
    slope = variance / length**2 * residual.force[:, None] * matern_slope(apart)
    mean = (shared @ residual.force[..., None])[..., 0]
    gradient = slope.sum(axis=2)[..., None] * points - slope @ residual.feet
    return mean, gradient, shared


def joint_variance(residual: Residual, covariance, terms, shared) -> np.ndarray:
    """(m, q) variance of trend plus residual, scaled^2.

    Parameters
    ----------
    residual : Residual
    covariance : (m, t, t) float, scaled^2
        Covariance of the trend's coefficients.
    terms : (t, m, q) float
        Monomials at the points.
    shared : (m, q, n) float, scaled^2
        From ``residual_at``.

    Notes
    -----
    a^2 - k A^-1 k + u^t C u with u = phi - Phi A^-1 k: Rasmussen and Williams, (2.42).
    """
    known = np.einsum("mqn,mqn->mq", shared @ residual.inverse, shared)
    open_terms = terms.transpose(1, 2, 0) - shared @ residual.influence
    trend = np.einsum("mqt,mqt->mq", open_terms @ covariance, open_terms)
    square = (residual.amplitude**2)[:, None]
    return np.maximum(square - known, _NUGGET**2 * square) + trend


def _distances(a, b) -> np.ndarray:
    """(m, p, q) distances between points a (m, p, 3) and b (m, q, 3)."""
    square = a @ (-2.0 * b.transpose(0, 2, 1))
    square += (a * a).sum(axis=2)[:, :, None]
    square += (b * b).sum(axis=2)[:, None, :]
    return np.sqrt(np.maximum(square, 0.0, out=square), out=square)
