"""Trend plus residual: what a patch's polynomial leaves over, as a Gaussian process.

Real objects have detail finer than a patch. There the height is z = phi + g: phi the patch's
polynomial with its prior, and g a Gaussian process of zero mean along the surface. Both are one
joint Gaussian model (universal kriging): given g's covariance the coefficients have ordinary
normal equations, of samples weighted by the inverse of it, so all that is known of polynomials
(prior, evidence, posterior) holds as it is. Rasmussen and Williams, Gaussian Processes for
Machine Learning, 2006, sections 2.7 and 5.4; Stein, Interpolation of Spatial Data, 1999.

All is for a stack of m patches of n samples each, in each patch's frame over its radius.
"""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.patch.fit.smoothness import NormalEquations, posterior

# No sample is better than this share of the amplitude: below, rounding would be all there is.
_NUGGET = 1e-3


@dataclass(frozen=True, eq=False)
class Residual:
    """The residuals of m patches, given their samples.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
        Of the samples; what only fills the stack has no force.
    amplitude, length : (m,) float, scaled
        Standard deviation of the residual, and how far along the surface it is correlated.
    force : (m, n) float
        The mean of g is the sum of them times the covariance with the samples.
    inverse : (m, n, n) float
        Of the covariance of the samples about their trend.
    influence : (m, n, t) float
        ``inverse`` times the monomials: what a coefficient takes from the forces.
    """

    feet: np.ndarray
    amplitude: np.ndarray
    length: np.ndarray
    force: np.ndarray
    inverse: np.ndarray
    influence: np.ndarray

    def __getitem__(self, rows) -> "Residual":
        """Some of them."""
        return Residual(*(getattr(self, field.name)[rows] for field in fields(self)))


def matern(distance):
    """Matern correlation of smoothness 5/2 at distances over its length.

    k = (1 + s + s^2/3) exp(-s) with s = sqrt(5) r: a path has two derivatives, as a surface
    needs for its curvature. Rasmussen and Williams, equation (4.17).

    >>> round(float(matern(np.array([1.0]))[0]), 3)
    0.524
    """
    s = np.sqrt(5.0) * distance
    # In place: of a stack of large matrices the memory is most of the time.
    value = s / 3.0
    value += 1.0
    value *= s
    value += 1.0
    value *= np.exp(np.negative(s, out=s), out=s)
    return value


def matern_slope(distance):
    """Derivative of ``matern`` along the distance r, over r: -5/3 (1 + s) exp(-s)."""
    s = np.sqrt(5.0) * distance
    return (-5.0 / 3.0) * (1.0 + s) * np.exp(-s)


def correlation(samples: PatchSamples, length) -> np.ndarray:
    """(m, n, n) Matern correlation of the samples, by chords in space, for lengths (m,), scaled."""
    used = samples.used
    apart = _distances(samples.feet, samples.feet)
    apart /= length[:, None, None]
    matrix = matern(apart)
    if not used.all():
        matrix *= used[:, :, None] & used[:, None, :]
    return matrix


def sample_covariance(samples: PatchSamples, amplitude, length) -> np.ndarray:
    """(m, n, n) covariance of the samples about their trend: a^2 k + diag(s^2 / w).

    What only fills the stack varies alone, by one.
    """
    matrix = correlation(samples, length)
    matrix *= (amplitude**2)[:, None, None]
    np.einsum("mnn->mn", matrix)[...] += _own_variance(samples, amplitude)
    return matrix


def _own_variance(samples: PatchSamples, amplitude) -> np.ndarray:
    """(m, n) variance that a sample shares with no other; one of what only fills the stack."""
    noise = (samples.noise**2)[:, None] / np.where(samples.used, samples.weight, 1.0)
    noise += (_NUGGET * amplitude[:, None]) ** 2
    return np.where(samples.used, noise, 1.0)


def trend_equations(samples: PatchSamples, amplitude, correlations):
    """Normal equations of the trend, of samples that vary together about it.

    Parameters
    ----------
    samples : PatchSamples
    amplitude : (m,) float, scaled
        Of the residual.
    correlations : (m, n, n) float
        Of ``correlation``.

    Returns
    -------
    equations : NormalEquations
        For noise 1.
    log_scale : (m,) float
        -log|A|/2: what the covariance A of the samples adds to the evidence.

    Notes
    -----
    Generalised least squares, gram Phi A^-1 Phi^t and right side Phi A^-1 z, by the Cholesky
    factor L of A: Rasmussen and Williams, section 2.7. That of A bordered by the columns has
    L^-1 times them below L, whatever stands in its corner, if only it is large enough.
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
        Of the prior on the coefficients.

    Returns
    -------
    mean : (m, t) float
        Coefficients of the trend.
    covariance : (m, t, t) float
    residual : Residual
    """
    used, terms = samples.used, samples.terms.transpose(1, 2, 0)
    inverse = np.linalg.inv(sample_covariance(samples, amplitude, length))
    inverse *= used[:, :, None] & used[:, None, :]
    influence = inverse @ terms
    gram = terms.transpose(0, 2, 1) @ influence
    right = (influence.transpose(0, 2, 1) @ samples.height[..., None])[..., 0]
    one = np.ones(len(amplitude))
    mean, covariance = posterior(0.5 * (gram + gram.swapaxes(1, 2)), right, one, precision)
    left = samples.height - np.einsum("mt,tmn->mn", mean, samples.terms)
    force = (inverse @ left[..., None])[..., 0]
    return mean, covariance, Residual(samples.feet, amplitude, length, force, inverse, influence)


def residual_at(residual: Residual, points):
    """Mean of the residuals at points, its gradient, and covariances with the samples.

    Parameters
    ----------
    residual : Residual
    points : (m, q, 3) float, scaled, local

    Returns
    -------
    mean : (m, q) float, scaled
        To be added to phi.
    gradient : (m, q, 3) float
        Of the mean in x, y and z, to be added to that of phi.
    shared : (m, q, n) float, scaled^2
        What ``joint_variance`` needs.
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
    """(m, q) variance of trend plus residual, scaled.

    Parameters
    ----------
    residual : Residual
    covariance : (m, t, t) float
        Of the trend's coefficients.
    terms : (t, m, q) float
        Monomials at the points.
    shared : (m, q, n) float
        Of ``residual_at``.

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
    """(m, p, q) distances of points a (m, p, 3) from points b (m, q, 3)."""
    square = a @ (-2.0 * b.transpose(0, 2, 1))
    square += (a * a).sum(axis=2)[:, :, None]
    square += (b * b).sum(axis=2)[:, None, :]
    return np.sqrt(np.maximum(square, 0.0, out=square), out=square)
