"""What keeps a patch from folding between its curves: a Gaussian prior on its coefficients.

Three concurrent curves leave three directions of a quartic undetermined (multiples of the
product of the three lines), and plain least squares folds there. A prior on the coefficients
of order 3 and more, and on all terms in z, fills them by one linear solve. Two numbers shape
it, and the evidence of the data chooses both from a fixed grid:

* ``length_ratio`` = R / l, l the feature length of the surface. The standard deviation of an
  order-m coefficient is AMPLITUDE (R / l)^2 DECAY^(m - 3), in scaled coordinates.
* ``z_scale``, by which each power of z multiplies it: near zero for a height polynomial, large
  where the surface turns on as a quadric does.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from touchatlas.patch.geometry.polynomial import Basis

AMPLITUDE, DECAY = 0.5, 0.4
# Height, slope and curvature are left to the data: one patch radius, 45 degrees, ...
_LOOSE_STD = 1.0
_LEAST_NOISE = 1e-6
# Share of the order d + 1 that the orders up to d cannot take over.
_LEFTOVER = 0.3
_TURNS = np.geomspace(0.12, 2.0, 6)
_BENDS = np.array([0.02, 1.0, 4.0])


@dataclass(frozen=True)
class SmoothnessPrior:
    """Belief about the feature length of a surface: log-normal, learned from patches so far.

    Parameters
    ----------
    log_length : float
        Mean of log(feature length).
    log_std : float
        Standard deviation of it, > 0; infinite when nothing is known.
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
    """Weighted sums over samples that a least-squares polynomial needs, in scaled coordinates.

    Parameters
    ----------
    gram : (..., t, t) float
        Sum of w phi phi^t.
    rhs : (..., t) float
        Sum of w phi z/R.
    sum_of_squares : (...) float
        Sum of w (z/R)^2.
    count : (...) float
        Samples with any weight.
    """

    gram: np.ndarray
    rhs: np.ndarray
    sum_of_squares: np.ndarray
    count: np.ndarray

    def part(self, count: int) -> "NormalEquations":
        """Those of the first ``count`` coefficients alone."""
        return NormalEquations(
            self.gram[..., :count, :count], self.rhs[..., :count], self.sum_of_squares, self.count
        )

    def __getitem__(self, index) -> "NormalEquations":
        """Those of some of a stack."""
        return NormalEquations(
            self.gram[index], self.rhs[index], self.sum_of_squares[index], self.count[index]
        )


def coefficient_precision(basis: Basis, length_ratio, z_scale) -> np.ndarray:
    """(..., t) prior precision of scaled coefficients for turn and bend (...)."""
    length_ratio, z_scale = (
        np.asarray(length_ratio, dtype=float)[..., None],
        np.asarray(z_scale, dtype=float)[..., None],
    )
    orders, powers = basis.orders, basis.exponents[:, 2]
    std = AMPLITUDE * length_ratio**2 * DECAY ** (orders - 3.0) * z_scale**powers
    # Nothing is looser than slope and curvature are: coefficients stay of the size of one.
    std = np.where((orders >= 3) | (powers > 0), np.minimum(std, _LOOSE_STD), _LOOSE_STD)
    return 1.0 / (std * std)


@lru_cache
def smoothness_grid(basis: Basis) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Turns (g,), bends (g,) and prior precisions (g, t) that the evidence chooses from."""
    z_scales = _BENDS if basis.has_z else np.ones(1)
    length_ratio, z_scale = (a.ravel() for a in np.meshgrid(_TURNS, z_scales, indexing="ij"))
    return length_ratio, z_scale, coefficient_precision(basis, length_ratio, z_scale)


def scaled_noise(noise_std, radius):
    """Noise over patch radius, kept above what the solver can tell from zero."""
    return np.maximum(noise_std / radius, _LEAST_NOISE)


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
        The first without n log(2 pi)/2; the second is z^t C^-1 z with C the covariance of the
        samples under the model, about ``count`` when the model is right.

    Notes
    -----
    (b^t P^-1 b - z^t z/s^2 - log|P| + log|D|)/2 - n log s with D the prior precision,
    P = G/s^2 + D, b = r/s^2 (Bishop, Pattern Recognition and Machine Learning, section 3.5.1).
    One Cholesky factor of P bordered by b gives all of it.
    """
    weight = np.asarray(noise, dtype=float) ** -2.0
    t = prior_precision.shape[-1]
    gram, right = equations.gram, equations.rhs
    shape = np.broadcast_shapes(prior_precision.shape[:-1], weight.shape, gram.shape[:-2])
    bordered = np.empty((*shape, t + 1, t + 1))
    bordered[..., :t, :t] = gram * weight[..., None, None]
    bordered[..., t, :t] = right * weight[..., None]
    # One more, so that rounding leaves it positive.
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
    """(...) standard deviation of what the degree leaves out at distance R, scaled.

    The next order of the prior, and of it what the orders that are there cannot take over. At
    distance r it is (r/R)^(degree + 1) of this.
    """
    return _LEFTOVER * AMPLITUDE * np.square(length_ratio) * DECAY ** (basis.degree - 2.0)


def log_prior(prior: SmoothnessPrior, length_ratio, radius):
    """Log belief (...) in turns = radius / feature length, up to a constant: 0 without any."""
    if not np.isfinite(prior.log_std):
        return np.zeros(1)
    return -0.5 * ((np.log(radius / length_ratio) - prior.log_length) / prior.log_std) ** 2


def posterior(gram, right, noise, prior_precision):
    """Mean (..., t) and covariance (..., t, t) of the coefficients given normal equations.

    ``noise`` (...) is in scaled units, ``prior_precision`` (..., t) diagonal.
    """
    weight = np.asarray(noise)[..., None] ** -2.0
    precision = gram * weight[..., None]
    diagonal = np.einsum("...ii->...i", precision)
    diagonal += prior_precision
    covariance = np.linalg.inv(precision)
    # Rounding leaves the inverse of a symmetric matrix a little askew.
    covariance = 0.5 * (covariance + covariance.swapaxes(-1, -2))
    mean = (covariance @ (right * weight)[..., None])[..., 0]
    return mean, covariance


def residual_square(equations: NormalEquations, mean):
    """Weighted sum of squared residuals (...) of coefficients (..., t), in scaled units."""
    fitted = (equations.gram @ mean[..., None])[..., 0]
    return np.maximum(
        equations.sum_of_squares + (mean * (fitted - 2.0 * equations.rhs)).sum(axis=-1), 0.0
    )


def effective_parameters(covariance, prior_precision):
    """Number of coefficients (...) that the data, not the prior, determine."""
    held = np.einsum("...ii,...i->...", covariance, prior_precision)
    return prior_precision.shape[-1] - held
