"""Choice of degree, terms, smoothness and samples where the first choice is doubtful.

The orders above degree d grow as r^(d+1). Their size follows from the prior on the lower orders,
so they are part of the model: the variance of a sample is s^2 + (leftover r^(d+1))^2. The evidence
then compares degree, terms in z, length ratio, z scale and noise together.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.fit.bad_contacts import OUTLIER
from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    coefficient_precision,
    leftover,
    log_evidence,
    log_prior,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import Basis, graded_basis, monge_basis, monomials

# Degrees that the evidence chooses from. Degree 6 has 28 terms in x and y, 57 samples of a touch
# hardly more.
DEGREES = (2, 3, 4, 5, 6)


@dataclass(frozen=True, eq=False)
class Choice:
    """Terms, smoothness and weights of one patch.

    Parameters
    ----------
    basis : Basis
    length_ratio, z_scale : float
    weight : (n,) float
        Weights of F^2 of the samples. They fall where higher orders exceed the noise, and are 0
        for outliers.
    mean : (t,) float
        Coefficients.
    residual_rms : float, scaled
        Of the samples that are not outliers.
    outliers : int
        Number of samples without weight.
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
    value: np.ndarray,
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
        Feet of the samples on a first polynomial, in a frame whose normal is about right.
    value : (n,) float, scaled
        F of that polynomial at the samples.
    weight : (n,) float
        Weights of F^2. A sample of weight 0 is ignored.
    noise : float, scaled
    radius : float, length
        It relates length ratios to the prior's feature length.
    prior : SmoothnessPrior
    candidates : tuple of Basis
    """
    terms = {b: monomials(b, *feet.T) for b in candidates}
    z, distance = feet[:, 2] + value, np.sqrt((feet[:, :2] ** 2).sum(axis=1))
    basis = min(candidates, key=lambda b: abs(b.degree - DEGREES[2]))
    # Bad contacts are first found with the middle of the length ratios and of the z scales.
    variance = np.full(len(z), noise**2)
    _, keep, spread = _robust(basis, terms[basis], z, weight, variance, 0.5, 1.0)
    sigmas = np.unique([noise, max(noise, 0.5 * spread), max(noise, spread)])
    for _ in range(2):
        # The second pass is without outliers, and for the best basis alone.
        scores = [_best(b, terms[b], z, keep, distance, sigmas, radius, prior) for b in candidates]
        basis, (_, length_ratio, z_scale, sigma) = max(
            zip(candidates, scores, strict=True), key=lambda pair: pair[1][0]
        )
        candidates = (basis,)
        variance = sigma**2 + (leftover(basis, length_ratio) * distance ** (basis.degree + 1)) ** 2
        mean, keep, residual = _robust(
            basis, terms[basis], z, weight, variance, length_ratio, z_scale
        )
    outliers = int((weight > 0).sum() - (keep > 0).sum())
    final = keep * noise**2 / np.maximum(variance, noise**2)
    return Choice(basis, length_ratio, z_scale, final, mean, residual, outliers)


def candidates_of(height_only: bool) -> tuple[Basis, ...]:
    """The bases that the evidence chooses from. A basis of degree 2 has no terms in z."""
    make = monge_basis if height_only else graded_basis
    return (monge_basis(2), *(make(d) for d in DEGREES[1:]))


def _best(basis, terms, z, weight, distance, sigmas, radius, prior):
    """Largest log posterior of a basis, with its length ratio, z scale and noise."""
    length_ratio, z_scale, precision = smoothness_grid(basis)
    length_ratios = np.unique(length_ratio)
    beyond = np.multiply.outer(leftover(basis, length_ratios), distance ** (basis.degree + 1))
    variance = sigmas[:, None, None] ** 2 + beyond**2
    w = weight / variance
    phi = terms[: basis.size]
    weighted = w[:, :, None, :] * phi
    sums = NormalEquations(
        weighted @ phi.T, weighted @ z, w @ (z * z), np.full(w.shape[:2], (weight > 0).sum())
    )
    # The z scales of the grid are an axis of their own: the sums do not depend on them.
    precision = precision.reshape(len(length_ratios), -1, basis.size)
    evidence, _ = log_evidence(sums[:, :, None], np.ones(1), precision)
    used = weight > 0
    evidence += 0.5 * np.log(w[:, :, used]).sum(axis=-1)[:, :, None]
    score = evidence.reshape(len(sigmas), -1) + log_prior(prior, length_ratio, radius)
    s, g = np.unravel_index(score.argmax(), score.shape)
    return float(score[s, g]), float(length_ratio[g]), float(z_scale[g]), float(sigmas[s])


def _robust(basis, terms, z, weight, variance, length_ratio, z_scale):
    """Coefficients by iterated reweighting, weights without outliers, and residual rms.

    The first steps have Cauchy's weights. The last ones leave out samples that are far off.
    """
    precision = coefficient_precision(basis, length_ratio, z_scale)
    phi = terms[: basis.size]
    keep = weight
    # Cauchy's weights have 95 % efficiency at 2.4 deviations (Holland and Welsch 1977); 1.4826
    # medians of normal noise are its deviation.
    for step in range(5):
        weighted = keep / variance * phi
        mean = np.linalg.solve(weighted @ phi.T + np.diag(precision), weighted @ z)
        distance = np.abs(z - mean @ phi) * np.sqrt(weight)
        u = distance / np.sqrt(variance)
        if step == 0 and u.max() <= OUTLIER:
            break
        u /= max(1.0, 1.4826 * float(np.median(u[weight > 0])))
        soft = 1.0 / (1.0 + (u / 2.4) ** 2) if step < 3 else u <= OUTLIER
        keep = weight * soft
    return mean, keep, float(np.sqrt(np.mean(distance[keep > 0] ** 2)))
