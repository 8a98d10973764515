"""What is not known of the smoothness adds to the covariance of what no sample determines."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.fit.angular_waves import phase_excess
from touchatlas.patch.fit.darboux_fit import Solution
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    log_evidence,
    log_prior,
    scaled_noise,
    smoothness_grid,
)

# Temperature of the posterior of length ratio and z scale, no unit. Coefficients of real surfaces
# are not as independent as the prior takes them to be, so that the evidence counts half. It is
# chosen so that intervals hold on a torus, which the prior does not know, as often as on smooth
# random surfaces. Doubled, intervals hold 99 % on these.
_TEMPERATURE = 2.0
# Height, slopes and curvatures come first in every basis.
_SEEN = slice(0, 6)


def averaged_again(solution: Solution, prior: SmoothnessPrior) -> Solution:
    """``averaged`` over the smoothnesses that the samples of a solution of one fit allow.

    Residuals that exceed the noise count as noise.
    """
    reach = solution.stack.reach
    noise = np.maximum(scaled_noise(solution.stack.noise, reach), solution.residual)
    length_ratios, _, precisions = smoothness_grid(solution.basis)
    evidence, _ = log_evidence(solution.equations[:, None], noise[:, None], precisions)
    log_posterior = evidence + log_prior(prior, length_ratios, reach[:, None])
    return averaged(solution, log_posterior, precisions)


def averaged(solution: Solution, log_posterior, precisions) -> Solution:
    """The solution of one fit with the covariance of all its smoothnesses together.

    Between the curves the covariance is that of the prior, and the most probable smoothness alone
    would be too sure of it. Slopes and curvatures are seen in the curves and keep their covariance.

    Parameters
    ----------
    solution : Solution
        Of the most probable point of the smoothness grid.
    log_posterior : (1, g) float
        Of g smoothnesses, up to a constant.
    precisions : (g, t) float
        Their prior precisions of the coefficients.

    Notes
    -----
    Averaged over the grid, a prior variance V becomes larger by a factor 1 + g (law of total
    variance; Hoeting, Madigan, Raftery and Volinsky, Bayesian model averaging: a tutorial, 1999).
    With W = V^-1/2 C V^-1/2, the fraction of the posterior covariance C that comes from the prior,
    W^4 V g W^4 is added: all of V g where no sample helps, and a 256th of it where half is known.
    V g includes the excess of waves of which one phase is seen, see ``phase_excess``.
    The posterior is tempered, because the model is only nearly right (Gruenwald and
    van Ommen, Inconsistency of Bayesian inference for misspecified linear models, 2017).
    """
    score = log_posterior[0]
    weight = np.exp((score - score.max()) / _TEMPERATURE)
    own = coefficient_precision(solution.basis, solution.length_ratio, solution.z_scale)[0]
    root = 1.0 / np.sqrt(own)
    gain = np.maximum((weight @ (1.0 / precisions)) * (own / weight.sum()) - 1.0, 0.0)
    noise = scaled_noise(solution.stack.noise.item(), solution.stack.reach.item())
    excess = max(1.0, (solution.residual.item() / noise) ** 2)
    covariance, variance = solution.covariance[0] / excess, root * root
    averaged_variance = (1.0 + gain) * variance
    phases = phase_excess(solution.basis, solution.mean[0], covariance, variance, averaged_variance)
    fraction = covariance / (root * root[:, None])
    fraction = fraction @ fraction
    fraction = fraction @ fraction
    added = np.concatenate([np.diag(np.sqrt(gain)), phases / root[:, None]], axis=1)
    unseen = root[:, None] * (fraction @ added) * np.sqrt(excess)
    unseen[_SEEN] = 0.0
    return replace(solution, covariance=solution.covariance + unseen @ unseen.T)
