"""What is not known of the smoothness adds to the covariance of the coefficients."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from touchatlas.patch.fit.darboux_fit import Solution
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    log_evidence,
    log_prior,
    scaled_noise,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import Basis

# Temperature of the posterior of length ratio and z scale, no unit. Coefficients of real surfaces
# are not as independent as the prior takes them to be, so that the evidence counts half. It is
# chosen so that intervals hold on a torus, which the prior does not know, as often as on smooth
# random surfaces. Doubled, intervals hold 99 % on these.
_TEMPERATURE = 2.0


def log_posterior_of(solution: Solution, prior: SmoothnessPrior) -> np.ndarray:
    """(1, g) log posterior of the smoothness grid for the samples of a solution of one fit.

    Residuals that exceed the noise count as noise.
    """
    reach = solution.stack.reach
    noise = np.maximum(scaled_noise(solution.stack.noise, reach), solution.residual)
    length_ratios, _, precisions = smoothness_grid(solution.basis)
    evidence, _ = log_evidence(solution.equations[:, None], noise[:, None], precisions)
    return evidence + log_prior(prior, length_ratios, reach[:, None])


def averaged(solution: Solution, log_posterior) -> Solution:
    """The solution of one fit with the covariance of all its smoothnesses together.

    Parameters
    ----------
    solution : Solution
        Of the most probable point of the smoothness grid.
    log_posterior : (1, g) float
        Of each point of the grid, up to a constant.

    Notes
    -----
    Before the samples, a coefficient has the mean of its prior variances, by the law of total
    variance (Hoeting, Madigan, Raftery and Volinsky, Bayesian model averaging: a tutorial, 1999).
    The posterior is tempered, because the model is only nearly right (Gruenwald and van Ommen,
    Inconsistency of Bayesian inference for misspecified linear models, 2017).
    """
    weight = np.exp((log_posterior[0] - log_posterior.max()) / _TEMPERATURE)
    variance = weight @ _variances(solution.basis) / weight.sum()
    equations, residual = solution.equations, solution.residual.item()
    noise = scaled_noise(solution.stack.noise.item(), solution.stack.reach.item())
    matrix = equations.gram[0] * noise**-2.0
    matrix.flat[:: len(variance) + 1] += 1.0 / variance
    covariance = max(1.0, (residual / noise) ** 2) * np.linalg.inv(matrix)
    # Rounding leaves the computed inverse slightly asymmetric.
    return replace(solution, covariance=0.5 * (covariance + covariance.T)[None])


@lru_cache
def _variances(basis: Basis) -> np.ndarray:
    """(g, t) prior variances of the coefficients at the points of the smoothness grid."""
    return 1.0 / smoothness_grid(basis)[2]
