"""The smoothness prior: a Gaussian prior on the coefficients, and the evidence of the data for it.

Three concurrent curves leave three directions of a quartic undetermined: the multiples of the
product of the three lines. Plain least squares folds the patch there. A prior on the coefficients
of order 3 and more, and on all terms in z, determines them by one linear solve. It has two
parameters, and the evidence of the data chooses both from a fixed grid:

* ``length_ratio`` = R / l, with the feature length l of the surface. The standard deviation of an
  order-m coefficient is AMPLITUDE (R / l)^2 DECAY^(m - 3), in scaled coordinates.
* ``z_scale``: each power of z multiplies that standard deviation by it. It is near zero for a
  height polynomial, and large where the surface keeps its curvature as it tilts, as quadrics do.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from touchatlas.patch.geometry.polynomial import Basis

# Standard deviation of an order-3 coefficient at length ratio 1, scaled. It and DECAY are chosen so
# that intervals hold on the smooth surfaces of tests/studies.
AMPLITUDE = 0.5
# Ratio of the standard deviations of successive orders, no unit.
DECAY = 0.4


@dataclass(frozen=True)
class SmoothnessPrior:
    """Log-normal distribution of the feature length of a surface, learned from earlier patches.

    Parameters
    ----------
    log_length : float
        Mean of log(feature length).
    log_std : float
        Its standard deviation, > 0. It is infinite when nothing is known.
    """

    log_length: float = 0.0
    log_std: float = np.inf

    def __post_init__(self) -> None:
        if not (np.isfinite(self.log_length) and self.log_std > 0):
            raise ValueError(
                f"log_length, log_std are {self.log_length}, {self.log_std}; "
                "the first must be finite and the second > 0"
            )


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of weighted least squares over the monomials phi, in scaled coordinates.

    Parameters
    ----------
    gram : (..., t, t) float
        Sum of w phi phi^t.
    rhs : (..., t) float
        Sum of w phi z/R.
    sum_of_squares : (...) float
        Sum of w (z/R)^2.
    count : (...) float
        Number of samples with weight.
    """

    gram: np.ndarray
    rhs: np.ndarray
    sum_of_squares: np.ndarray
    count: np.ndarray

    def __getitem__(self, index) -> "NormalEquations":
        """The normal equations of some of a stack."""
        return NormalEquations(
            self.gram[index], self.rhs[index], self.sum_of_squares[index], self.count[index]
        )


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """m weighted least-squares problems: coefficients (t,) @ phi = heights.

    Parameters
    ----------
    phi : (m, t, n) float
        Monomials at the samples.
    heights : (m, n) float, scaled
    weight : (m, n) float
    """

    phi: np.ndarray
    heights: np.ndarray
    weight: np.ndarray

    def equations(self) -> NormalEquations:
        """Normal equations (m, ...)."""
        weighted = self.phi * self.weight[:, None]
        return NormalEquations(
            weighted @ self.phi.transpose(0, 2, 1),
            (weighted @ self.heights[..., None])[..., 0],
            np.einsum("mn,mn,mn->m", self.weight, self.heights, self.heights),
            np.count_nonzero(self.weight, axis=1).astype(float),
        )

    def residuals(self, mean) -> np.ndarray:
        """(m, n) heights less those of coefficients (m, t)."""
        return self.heights - (mean[:, None] @ self.phi)[:, 0]


def coefficient_precision(basis: Basis, length_ratio, z_scale) -> np.ndarray:
    """(..., t) prior precision of scaled coefficients, for length ratios and z scales (...)."""
    length_ratio, z_scale = (
        np.asarray(length_ratio, dtype=float)[..., None],
        np.asarray(z_scale, dtype=float)[..., None],
    )
    orders, powers = basis.orders, basis.exponents[:, 2]
    std = AMPLITUDE * length_ratio**2 * DECAY ** (orders - 3.0) * z_scale**powers
    # Height, slope and curvature, which the data determine, have a deviation of one patch radius,
    # 45 degrees and one over the radius. No coefficient is less certain.
    std = np.where((orders >= 3) | (powers > 0), np.minimum(std, 1.0), 1.0)
    return 1.0 / (std * std)


@lru_cache
def smoothness_grid(basis: Basis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Length ratios (g,), z scales (g,) and prior precisions (g, t) to choose from."""
    # A ratio of 0.12 is a quadric but for 1 % of the radius; with 2 there is detail of half of it.
    # A z scale of 0.02 makes a height polynomial, one of 1 a quadric.
    length_ratios = np.geomspace(0.12, 2.0, 6)
    z_scales = np.array([0.02, 1.0, 4.0]) if basis.has_z else np.ones(1)
    length_ratio, z_scale = (a.ravel() for a in np.meshgrid(length_ratios, z_scales, indexing="ij"))
    return length_ratio, z_scale, coefficient_precision(basis, length_ratio, z_scale)


def scaled_noise(noise_std, radius):
    """Noise over patch radius, at least 1e-6: exact contacts stay solvable in floating point."""
    return np.maximum(noise_std / radius, 1e-6)


def log_evidence(equations: NormalEquations, noise, prior_precision):
    """Log evidence of a linear Gaussian model, and its chi-square.

    Parameters
    ----------
    equations : NormalEquations
    noise : (...) float, scaled
    prior_precision : (..., t) float

    Returns
    -------
    evidence, chi_square : (...) float
        The evidence omits the constant n log(2 pi)/2. Chi-square is z^t C^-1 z with the
        covariance C of the samples under the model: about ``count`` if the model is right.

    Notes
    -----
    (b^t P^-1 b - z^t z/s^2 - log|P| + log|D|)/2 - n log s with the prior precision D,
    P = G/s^2 + D and b = r/s^2: Bishop, Pattern Recognition and Machine Learning, section 3.5.1.
    One Cholesky factor of P bordered by b gives all terms.
    """
    weight = np.asarray(noise, dtype=float) ** -2.0
    t = prior_precision.shape[-1]
    gram, rhs = equations.gram, equations.rhs
    shape = np.broadcast_shapes(prior_precision.shape[:-1], weight.shape, gram.shape[:-2])
    bordered = np.empty((*shape, t + 1, t + 1))
    np.multiply(gram, weight[..., None, None], out=bordered[..., :t, :t])
    np.multiply(rhs, weight[..., None], out=bordered[..., t, :t])
    # One is added here and subtracted from chi-square, so that rounding leaves it positive.
    bordered[..., t, t] = equations.sum_of_squares * weight + 1.0
    diagonal = np.einsum("...ii->...i", bordered)[..., :t]
    diagonal += prior_precision
    factor = np.linalg.cholesky(bordered)
    roots = np.einsum("...ii->...i", factor)
    chi_square = np.maximum(roots[..., t] ** 2 - 1.0, 0.0)
    evidence = 0.5 * (np.log(prior_precision).sum(axis=-1) - chi_square)
    evidence -= np.log(roots[..., :t]).sum(axis=-1)
    return evidence + 0.5 * equations.count * np.log(weight), chi_square


def leftover(basis: Basis, length_ratio) -> np.ndarray:
    """(...) standard deviation of the orders above the degree at distance R, scaled.

    It is that of the prior's next order, times 0.3: the fraction that lower orders cannot imitate
    on a disc. At
    distance r it is smaller by the factor (r/R)^(degree + 1).
    """
    return 0.3 * AMPLITUDE * np.square(length_ratio) * DECAY ** (basis.degree - 2.0)


def log_prior(prior: SmoothnessPrior, length_ratio, radius):
    """Log prior density (...) of length ratios, up to a constant. It is 0 when nothing is known."""
    if not np.isfinite(prior.log_std):
        return np.zeros(1)
    return -0.5 * ((np.log(radius / length_ratio) - prior.log_length) / prior.log_std) ** 2


def map_coefficients(equations: NormalEquations, noise, precision):
    """Maximum-a-posteriori coefficients (m, t) for noise (m,) and prior precision (m, t)."""
    matrix = equations.gram.copy()
    diagonal = np.einsum("...ii->...i", matrix)
    diagonal += precision * (noise * noise)[:, None]
    return np.linalg.solve(matrix, equations.rhs[..., None])[..., 0]


def posterior(gram, rhs, noise, prior_precision):
    """Mean (..., t) and covariance (..., t, t) of the coefficients given normal equations.

    ``noise`` (...) is scaled; ``prior_precision`` (..., t) is the diagonal of the prior.
    """
    weight = np.asarray(noise)[..., None] ** -2.0
    precision = gram * weight[..., None]
    diagonal = np.einsum("...ii->...i", precision)
    diagonal += prior_precision
    covariance = np.linalg.inv(precision)
    # Rounding leaves the computed inverse slightly asymmetric.
    covariance = 0.5 * (covariance + covariance.swapaxes(-1, -2))
    mean = (covariance @ (rhs * weight)[..., None])[..., 0]
    return mean, covariance


def effective_parameters(covariance, prior_precision):
    """Number of coefficients (...) that the data, not the prior, determine."""
    from_prior = np.einsum("...ii,...i->...", covariance, prior_precision)
    return prior_precision.shape[-1] - from_prior
