"""Choice of terms, smoothness and samples where the first choice does not hold.

What a polynomial of degree d leaves out grows as r^(d+1). Its size follows from the prior on
the orders that are there, so it is part of the model: each sample's variance is
s^2 + (leftover r^(d+1))^2, and the evidence weighs degree, terms in z, turn, bend and noise
together.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    coefficient_precision,
    leftover,
    log_evidence,
    log_prior,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import (
    Basis,
    graded_basis,
    monge_basis,
    monomials,
)

_DEGREES = (2, 3, 4, 5, 6)
# Turn and bend with which the worst contacts are found, before anything is known.
_FIRST = (0.5, 1.0)
# A contact this many deviations off is bad: one in 1.7 million good ones.
_OUTLIER = 5.0
_REWEIGHTINGS = 5
_CAUCHY, _MEDIAN_TO_STD = 2.4, 1.4826


@dataclass(frozen=True, eq=False)
class Choice:
    """What a patch is fitted with.

    Parameters
    ----------
    basis : Basis
    length_ratio, z_scale : float
    weight : (n,) float
        Of each sample's distance: 1 where noise is all of it, 0 for outliers.
    mean : (t,) float
        Coefficients.
    residual_rms : float, scaled
        Of the samples that were kept.
    outliers : int
    """

    basis: Basis
    length_ratio: float
    z_scale: float
    weight: np.ndarray
    mean: np.ndarray
    residual_rms: float
    outliers: int


def choose_terms(
    feet: np.ndarray,
    lift: np.ndarray,
    weight: np.ndarray,
    noise: float,
    radius: float,
    prior: SmoothnessPrior,
    candidates: tuple[Basis, ...],
) -> Choice:
    """Basis, smoothness and weights with the highest evidence.

    Parameters
    ----------
    feet : (n, 3) float, scaled
        Of the samples on a first polynomial, in a frame whose normal is about right.
    lift : (n,) float, scaled
        F of that polynomial at the samples.
    weight : (n,) float
        Of the squares of F; 0 leaves a sample out.
    noise : float, scaled
    radius : float, length
        For the prior on the feature length.
    prior : SmoothnessPrior
    candidates : tuple of Basis
    """
    terms = {b: monomials(b, *feet.T) for b in candidates}
    z, reach = feet[:, 2] + lift, np.sqrt((feet[:, :2] ** 2).sum(axis=1))
    basis = min(candidates, key=lambda b: abs(b.degree - _DEGREES[2]))
    _, keep, spread = _robust(basis, terms[basis], z, weight, np.full(len(z), noise**2), *_FIRST)
    sigmas = np.unique([noise, max(noise, 0.5 * spread), max(noise, spread)])
    for _ in range(2):
        # The second time without outliers, of the winner alone.
        scores = [_best(b, terms[b], z, keep, reach, sigmas, radius, prior) for b in candidates]
        basis, (_, length_ratio, z_scale, sigma) = max(
            zip(candidates, scores, strict=True), key=lambda pair: pair[1][0]
        )
        candidates = (basis,)
        variance = sigma**2 + (leftover(basis, length_ratio) * reach ** (basis.degree + 1)) ** 2
        mean, keep, residual = _robust(
            basis, terms[basis], z, weight, variance, length_ratio, z_scale
        )
    outliers = int((weight > 0).sum() - (keep > 0).sum())
    final = keep * noise**2 / np.maximum(variance, noise**2)
    return Choice(basis, length_ratio, z_scale, final, mean, residual, outliers)


def candidates_of(height_only: bool) -> tuple[Basis, ...]:
    """The bases that may be worth their parameters; degree 2 has no terms in z to offer."""
    make = monge_basis if height_only else graded_basis
    return (monge_basis(2), *(make(d) for d in _DEGREES[1:]))


def _best(basis, terms, z, weight, reach, sigmas, radius, prior):
    """Highest score of a basis and the turn, bend and noise that reach it."""
    length_ratio, z_scale, precision = smoothness_grid(basis)
    length_ratios, place = np.unique(length_ratio, return_inverse=True)
    beyond = np.multiply.outer(leftover(basis, length_ratios), reach ** (basis.degree + 1))
    variance = sigmas[:, None, None] ** 2 + beyond**2
    w = weight / variance
    phi = terms[: basis.size]
    weighted = w[:, :, None, :] * phi
    sums = NormalEquations(
        weighted @ phi.T, weighted @ z, w @ (z * z), np.full(w.shape[:2], (weight > 0).sum())
    )
    evidence, _ = log_evidence(sums[:, place], np.ones(1), precision)
    used = weight > 0
    evidence += 0.5 * np.log(w[:, :, used]).sum(axis=-1)[:, place]
    score = evidence + log_prior(prior, length_ratio, radius)
    s, g = np.unravel_index(score.argmax(), score.shape)
    return float(score[s, g]), float(length_ratio[g]), float(z_scale[g]), float(sigmas[s])


def _robust(basis, terms, z, weight, variance, length_ratio, z_scale):
    """Coefficients by reweighting, weights of what is kept, residual rms.

    Weights of Cauchy's distribution first, then a cut: what lies far off is no contact.
    """
    precision = coefficient_precision(basis, length_ratio, z_scale)
    phi = terms[: basis.size]
    keep = weight
    for step in range(_REWEIGHTINGS):
        weighted = keep / variance * phi
        mean = np.linalg.solve(weighted @ phi.T + np.diag(precision), weighted @ z)
        distance = np.abs(z - mean @ phi) * np.sqrt(weight)
        u = distance / np.sqrt(variance)
        if step == 0 and u.max() <= _OUTLIER:
            break
        u /= max(1.0, _MEDIAN_TO_STD * float(np.median(u[weight > 0])))
        soft = 1.0 / (1.0 + (u / _CAUCHY) ** 2) if step < _REWEIGHTINGS - 2 else u <= _OUTLIER
        keep = weight * soft
    return mean, keep, float(np.sqrt(np.mean(distance[keep > 0] ** 2)))
