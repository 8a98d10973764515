"""What keeps a patch from folding between its curves: a Gaussian prior on its coefficients.

Three concurrent curves leave three directions of a quartic undetermined (multiples of the
product of the three lines), and plain least squares folds there. A prior on the coefficients
of order 3 and more, in scaled coordinates, fills them by one linear solve. Its single
hyper-parameter is the feature length l of the surface: order-m coefficients z/R ~ (x/R)^m
have standard deviation AMPLITUDE (R/l)^(m-1), as for a surface whose m-th derivatives are
of size l^(1-m). The evidence of the data chooses l, near what earlier patches chose.
"""

from dataclasses import dataclass

import numpy as np

AMPLITUDE = 0.5
# Orders 0 to 2 are left to the data: one patch radius of height, 45 degrees of slope, ...
_LOOSE_STD = 1.0
_TURNS = np.geomspace(0.03, 3.0, 7)
_LEAST_NOISE = 1e-6


@dataclass(frozen=True)
class SmoothnessPrior:
    """Belief about the feature length of a surface: log-normal, learned from patches so far.

    Parameters
    ----------
    log_length : float
        Mean of log(feature length).
    log_std : float
        Standard deviation of it; infinite when nothing is known.
    """

    log_length: float = 0.0
    log_std: float = np.inf


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Sums over samples that a least-squares polynomial needs, in scaled coordinates.

    Parameters
    ----------
    gram : (t, t) float
        Sum of phi phi^t.
    right : (t,) float
        Sum of phi z/R.
    square : float
        Sum of (z/R)^2.
    count : int
    """

    gram: np.ndarray
    right: np.ndarray
    square: float
    count: int


def coefficient_precision(orders: np.ndarray, turn) -> np.ndarray:
    """(..., t) prior precision of scaled coefficients for turn = R / feature length (...)."""
    turn = np.asarray(turn, dtype=float)[..., None]
    std = np.where(orders >= 3, AMPLITUDE * turn ** (orders - 1.0), _LOOSE_STD)
    return 1.0 / (std * std)


def scaled_noise(noise_std, radius):
    """Noise over patch radius, kept above what the solver can tell from zero."""
    return np.maximum(noise_std / radius, _LEAST_NOISE)


def choose_turn(
    equations: NormalEquations,
    orders: np.ndarray,
    noise: float,
    prior: SmoothnessPrior,
    radius: float,
) -> float:
    """R / feature length that maximises evidence times prior, over a fixed grid.

    Notes
    -----
    log evidence of a linear Gaussian model, up to a constant:
    (b^t P^-1 b - log|P| + log|D|)/2 with D the prior precision, P = G/s^2 + D, b = r/s^2
    (Bishop, Pattern Recognition and Machine Learning, section 3.5.1).
    """
    prior_precision = coefficient_precision(orders, _TURNS)
    precision = equations.gram / noise**2 + prior_precision[:, :, None] * np.eye(len(orders))
    right = equations.right / noise**2
    factor = np.linalg.cholesky(precision)
    half = np.linalg.solve(factor, right[:, None])[..., 0]
    log_determinant = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    score = 0.5 * (half * half).sum(axis=1) - log_determinant
    score += 0.5 * np.log(prior_precision).sum(axis=1)
    if np.isfinite(prior.log_std):
        score -= 0.5 * ((np.log(radius / _TURNS) - prior.log_length) / prior.log_std) ** 2
    return float(_TURNS[score.argmax()])


def posterior(gram, right, noise, prior_precision):
    """Mean (..., t) and covariance (..., t, t) of the coefficients given normal equations.

    ``noise`` (...) is in scaled units, ``prior_precision`` (..., t) diagonal.
    """
    weight = np.asarray(noise)[..., None] ** -2.0
    precision = gram * weight[..., None]
    diagonal = np.einsum("...ii->...i", precision)
    diagonal += prior_precision
    covariance = np.linalg.inv(precision)
    mean = (covariance @ (right * weight)[..., None])[..., 0]
    return mean, covariance


def residual_square(gram, right, square, mean):
    """Sum of squared residuals (...) of coefficients (..., t), in scaled units."""
    fitted = (gram @ mean[..., None])[..., 0]
    return np.maximum(square + (mean * (fitted - 2.0 * right)).sum(axis=-1), 0.0)


def effective_parameters(covariance, prior_precision):
    """Number of coefficients (...) that the data, not the prior, determine."""
    held = np.einsum("...ii,...i->...", covariance, prior_precision)
    return prior_precision.shape[-1] - held
