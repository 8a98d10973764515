"""Amplitude and correlation length of the residuals of a surface, learned from its patches.

The evidence of each patch decides whether it has a residual, and with which amplitude. Where
polynomials are enough there is none.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.gaussian_process import correlation, trend_equations
from touchatlas.patch.fit.linear_system import LinearSystem
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    log_evidence,
    log_prior,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import Basis

# Least gain of log evidence for which a patch has a residual, 20 to 1: Kass and Raftery, Bayes
# factors, 1995. Doubled, to 400 to 1, faint residuals are lost.
STRONG = 3.0
# Correlation lengths and amplitudes to choose from, in patch radii. Doubled, finest detail is lost.
_LENGTHS = np.geomspace(0.1, 1.6, 5)
_AMPLITUDES = np.geomspace(1e-4, 0.1, 10)
# Factors of a patch's amplitude over that of the surface, and the standard deviation of their
# logarithms in the prior. Doubled, patches differ more in amplitude.
_FACTORS = np.array([0.25, 1.0, 4.0])
_FACTOR_LOG_STD = np.log(3.0)
# Number of patches in one numpy call. Doubled, their covariances take twice the memory.
_AT_ONCE = 8


@dataclass(frozen=True)
class ResidualScale:
    """Amplitude and correlation length of the residuals of a surface.

    Parameters
    ----------
    amplitude : float, length
        Standard deviation; zero where polynomials are enough.
    length : float, length
        Correlation length along the surface, > 0.
    """

    amplitude: float = 0.0
    length: float = 1.0

    def __post_init__(self) -> None:
        if not (0 <= self.amplitude < np.inf and 0 < self.length < np.inf):
            raise ValueError(
                f"amplitude, length are {self.amplitude}, {self.length}; "
                "they must be finite lengths, >= 0 and > 0"
            )


@dataclass(frozen=True, eq=False)
class ResidualEvidence:
    """Evidence for the residuals of m patches.

    Parameters
    ----------
    gain : (m,) float
        Log evidence of trend plus residual, less that of a trend alone.
    amplitude : (m,) float, scaled
        The likeliest amplitude.
    length_ratio, z_scale : (m,) float
        Prior of the trend that is likeliest with this amplitude.
    """

    gain: np.ndarray
    amplitude: np.ndarray
    length_ratio: np.ndarray
    z_scale: np.ndarray

    @property
    def needed(self) -> np.ndarray:
        """(m,) bool: whether the evidence for a residual is strong."""
        return self.gain > STRONG


def residual_evidence(
    basis: Basis,
    samples: PatchSamples,
    residual_scale: ResidualScale,
    radius,
    prior: SmoothnessPrior = SmoothnessPrior(),
) -> ResidualEvidence:
    """Evidence for residuals of patches, given the amplitude and length of their surface.

    Parameters
    ----------
    basis : Basis
    samples : PatchSamples
    residual_scale : ResidualScale
        With an amplitude > 0.
    radius : (m,) float, length
    prior : SmoothnessPrior

    Raises
    ------
    ValueError
        If the amplitude is zero.
    """
    if not residual_scale.amplitude > 0:
        raise ValueError("residual_scale has amplitude 0; it must be > 0: learn it from samples")
    log_factor_prior = -0.5 * (np.log(_FACTORS) / _FACTOR_LOG_STD) ** 2
    parts = []
    for rows in _few(len(radius)):
        some, r = samples[rows], radius[rows]
        alone, _, _ = _best_trend(basis, independent_equations(some), r, prior)
        alike = correlation(some, residual_scale.length / r)
        sums = (trend_equations(some, k * residual_scale.amplitude / r, alike) for k in _FACTORS)
        tried = np.array([_best_trend(basis, one, r, prior) for one in sums])
        scores = tried[:, 0] + log_factor_prior[:, None]
        best = scores.argmax(axis=0), np.arange(len(r))
        amplitude = _FACTORS[best[0]] * residual_scale.amplitude / r
        parts.append((scores[best] - alone, amplitude, tried[:, 1][best], tried[:, 2][best]))
    return ResidualEvidence(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def learn_residual_scale(
    basis: Basis, samples: PatchSamples, radius, prior: SmoothnessPrior = SmoothnessPrior()
) -> ResidualScale:
    """Amplitude and correlation length of the residuals of a surface, from some of its patches.

    Parameters
    ----------
    basis : Basis
    samples : PatchSamples
    radius : (m,) float, length
    prior : SmoothnessPrior

    Notes
    -----
    Each patch chooses the amplitude and length that make its samples likeliest (type II maximum
    likelihood; Rasmussen and Williams, section 5.4.1). The length of the surface is the median over
    the patches with strong evidence. Its amplitude is the median of their best amplitudes at that
    length, because the two trade off. A sum of the evidence would be dominated by the few patches
    that hold samples of another sheet.
    """
    gain = np.concatenate(
        [_gains(basis, samples[rows], radius[rows], prior) for rows in _few(len(radius))]
    )
    strong = gain.max(axis=(1, 2)) > STRONG
    if not strong.any():
        return ResidualScale()
    gain, radius = gain[strong], radius[strong]
    length = float(np.median(_LENGTHS[gain.max(axis=1).argmax(axis=1)] * radius))
    nearest = np.abs(np.log(np.outer(radius, _LENGTHS) / length)).argmin(axis=1)
    at_length = gain[np.arange(len(radius)), :, nearest]
    return ResidualScale(float(np.median(_AMPLITUDES[at_length.argmax(axis=1)] * radius)), length)


def independent_equations(samples: PatchSamples):
    """``trend_equations`` without a residual."""
    weight = samples.weight / (samples.noise**2)[:, None]
    log_scale = 0.5 * np.log(np.where(weight > 0, weight, 1.0)).sum(axis=1)
    system = LinearSystem(samples.terms.transpose(1, 0, 2), samples.height, weight)
    return system.equations(), log_scale


def _best_trend(basis: Basis, sums, radius, prior):
    """Log evidence (m,) with the likeliest prior of the trend, its length ratio and z scale."""
    equations, log_scale = sums
    length_ratios, z_scales, precisions = smoothness_grid(basis)
    evidence, _ = log_evidence(equations[:, None], np.ones(1), precisions)
    evidence = evidence + log_prior(prior, length_ratios, radius[:, None])
    best = evidence.argmax(axis=1)
    return evidence[np.arange(len(best)), best] + log_scale, length_ratios[best], z_scales[best]


def _gains(basis: Basis, samples: PatchSamples, radius, prior) -> np.ndarray:
    """(m, amplitudes, lengths) gain of log evidence with each residual; minus infinity for
    amplitudes that are the likeliest for none of the patches."""
    alone, _, _ = _best_trend(basis, independent_equations(samples), radius, prior)
    gain = np.full((len(radius), len(_AMPLITUDES), len(_LENGTHS)), -np.inf)
    for j, length in enumerate(_LENGTHS):
        alike = correlation(samples, np.full(len(radius), length))
        for i, a in enumerate(_AMPLITUDES):
            sums = trend_equations(samples, np.full(len(radius), a), alike)
            # The determinant bounds the evidence for this amplitude and for all above it.
            if i and (sums[1] - alone <= gain[:, :i, j].max(axis=1)).all():
                break
            gain[:, i, j] = _best_trend(basis, sums, radius, prior)[0] - alone
    return gain


def _few(count: int) -> list[np.ndarray]:
    """Indices of patches, at most _AT_ONCE in each array."""
    return np.array_split(np.arange(count), max(1, -(-count // _AT_ONCE)))
