"""What is not known of the smoothness adds to the covariance of what no sample determines."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.special import ndtri, stdtrit

from touchatlas.patch.fit.darboux_fit import Solution
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    log_evidence,
    log_prior,
    scaled_noise,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import Basis


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
    # At temperature 2 intervals hold on a torus as often as on smooth random surfaces: coefficients
    # of real surfaces are not as independent as the prior takes them to be.
    weight = np.exp((score - score.max()) / 2.0)
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
    # Height, slopes and curvatures come first in every basis.
    unseen[:6] = 0.0
    return replace(solution, covariance=solution.covariance + unseen @ unseen.T)


def phase_excess(basis: Basis, mean, covariance, variance, averaged) -> np.ndarray:
    """Square root (t, w) of the prior covariance that unequal waves add to a polynomial's.

    Of a wave r^m cos(l (a - b)) whose wave number l is that of the curves, these see one phase b
    and not the other. A surface has no preferred direction, so both phases have one variance. Its
    posterior, given what is seen of both, is an inverse gamma distribution, and the unseen phase
    has Student's t distribution.

    Parameters
    ----------
    basis : Basis
    mean : (t,) float
        Coefficients.
    covariance : (t, t) float
        Posterior for the prior ``variance``.
    variance : (t,) float
        Prior variances of the fit.
    averaged : (t,) float
        Prior variances averaged over all smoothnesses.

    Notes
    -----
    Student's t: Bishop, Pattern Recognition and Machine Learning, section 2.3.7. With n phases
    seen, their squares summing to q times the expected variance, it has nu + n degrees of freedom
    and (nu + q)/(nu + n) times the expected variance as its square scale. It may have no variance:
    what is given is the variance of the normal distribution with the same interval of 95 %. It is
    never taken to be less than the expected one.
    """
    columns, rows = waves(basis)
    expected = rows**2 @ averaged
    unknown = ((rows @ covariance) * rows).sum(axis=1) / (rows**2 @ variance)
    seen = _of_both(1.0 - np.minimum(unknown, 1.0))
    square = _of_both((rows @ mean) ** 2 / expected)
    # Two degrees of freedom before the phases are seen: the heaviest tail with which intervals on
    # smooth random surfaces hold 92 to 98 %. The quantile 0.975 is that of 1.96 deviations.
    freedom = 2.0 + seen
    widening = stdtrit(freedom, 0.975) / ndtri(0.975)
    factor = widening**2 * (2.0 + square) / freedom
    return columns * np.sqrt(np.maximum(factor - 1.0, 0.0) * expected)


def _of_both(values) -> np.ndarray:
    """(w,) sums over the two phases of each wave, for both."""
    return values.reshape(-1, 2).sum(axis=1).repeat(2)


@lru_cache
def waves(basis: Basis) -> tuple[np.ndarray, np.ndarray]:
    """The waves of order m >= 3 and wave number l >= 1, cosine before sine.

    Returns
    -------
    columns : (t, w) float
        Coefficients of each wave.
    rows : (w, t) float
        Amplitude of each wave in a polynomial. Terms in z have none.

    Examples
    --------
    >>> from touchatlas.patch.geometry.polynomial import monge_basis
    >>> columns, _ = waves(monge_basis(3))
    >>> columns[6:, 0].tolist()  # of x^3, x^2 y, x y^2 and y^3: the monkey saddle
    [1.0, 0.0, -3.0, 0.0]
    """
    place = {tuple(e): i for i, e in enumerate(basis.exponents.tolist())}
    columns, rows = [np.zeros((basis.size, 0))], [np.zeros((0, basis.size))]
    for m in range(3, basis.degree + 1):
        own = [place[m - k, k, 0] for k in range(m + 1)]
        parts = [_wave(m, number) for number in range(m, -1, -2)]
        every = np.array([p for z in parts for p in (z.real, z.imag)])[: m + 1].T
        count = 2 * ((m + 1) // 2)
        column, row = np.zeros((basis.size, count)), np.zeros((count, basis.size))
        column[own], row[:, own] = every[:, :count], np.linalg.inv(every)[:count]
        columns.append(column)
        rows.append(row)
    return np.concatenate(columns, axis=1), np.concatenate(rows)


def _wave(m: int, number: int) -> np.ndarray:
    """(m + 1,) coefficients of (x + i y)^number (x^2 + y^2)^((m - number)/2) by powers of y."""
    found = np.ones(1, complex)
    for _ in range(number):
        found = np.convolve(found, [1.0, 1.0j])
    for _ in range((m - number) // 2):
        found = np.convolve(found, [1.0, 0.0, 1.0])
    return found
