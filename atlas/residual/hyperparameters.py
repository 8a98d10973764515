"""How rough a surface is at scales finer than its patches, learned over an atlas.

Two numbers, amplitude and length. Which of its patches are rough, and by how much, the evidence
of each says; where polynomials are enough there is no residual.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.gaussian_process import correlation, trend_equations
from touchatlas.patch.fit.darboux_fit import LinearSystem
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    log_evidence,
    log_prior,
    smoothness_grid,
)
from touchatlas.patch.geometry.polynomial import Basis

# A patch has a residual where log evidence speaks for it so strongly, 20 to 1: Kass and Raftery,
# Bayes factors, 1995.
STRONG = 3.0
# Lengths and amplitudes, over the patch radius, among which a texture is found.
_LENGTHS = np.geomspace(0.1, 1.6, 5)
_AMPLITUDES = np.geomspace(1e-4, 0.1, 10)
# A patch may be so many times as rough as its surface, and the standard deviation of the
# logarithm of how many times it is.
_ROUGHER = np.array([0.25, 1.0, 4.0])
_ROUGHER_STD = np.log(3.0)
# Patches are asked so many at once, for the memory that their covariances take.
_AT_ONCE = 8


@dataclass(frozen=True)
class ResidualScale:
    """Detail of a surface beyond polynomials.

    Parameters
    ----------
    amplitude : float, length
        Standard deviation; zero where polynomials are enough.
    length : float, length
        How far along the surface it is correlated, > 0.
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
    """What the evidence says of m patches and their residuals.

    Parameters
    ----------
    gain : (m,) float
        Log of how much likelier trend plus residual makes the samples than a trend alone.
    amplitude : (m,) float, scaled
        The likeliest of those that the texture allows.
    length_ratio, z_scale : (m,) float
        Smoothness of the trend that goes with it.
    """

    gain: np.ndarray
    amplitude: np.ndarray
    length_ratio: np.ndarray
    z_scale: np.ndarray

    @property
    def needed(self) -> np.ndarray:
        """(m,) bool: whether a patch is to have a residual."""
        return self.gain > STRONG


def residual_evidence(
    basis: Basis,
    samples: PatchSamples,
    residual_scale: ResidualScale,
    radius,
    prior: SmoothnessPrior = SmoothnessPrior(),
) -> ResidualEvidence:
    """Whether patches are rough, and how rough, given the texture of their surface.

    Parameters
    ----------
    basis : Basis
    samples : PatchSamples
    residual_scale : Texture
        Of an amplitude > 0.
    radius : (m,) float, length
    prior : SmoothnessPrior
    """
    if not residual_scale.amplitude > 0:
        raise ValueError("the texture has amplitude 0: there is no residual to ask for")
    believed = -0.5 * (np.log(_ROUGHER) / _ROUGHER_STD) ** 2
    parts = []
    for rows in _few(len(radius)):
        some, r = samples[rows], radius[rows]
        alone, _, _ = _best_trend(basis, independent_equations(some), r, prior)
        alike = correlation(some, residual_scale.length / r)
        sums = (trend_equations(some, k * residual_scale.amplitude / r, alike) for k in _ROUGHER)
        tried = [_best_trend(basis, one, r, prior) for one in sums]
        scores = np.array([evidence for evidence, *_ in tried]) + believed[:, None]
        best = scores.argmax(axis=0), np.arange(len(r))
        length_ratio, z_scale = (
            np.array(values)[best] for values in list(zip(*tried, strict=True))[1:]
        )
        amplitude = _ROUGHER[best[0]] * residual_scale.amplitude / r
        parts.append((scores[best] - alone, amplitude, length_ratio, z_scale))
    return ResidualEvidence(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def learn_residual_scale(
    basis: Basis, samples: PatchSamples, radius, prior: SmoothnessPrior = SmoothnessPrior()
) -> ResidualScale:
    """Texture of a surface from some of its patches.

    Parameters
    ----------
    basis : Basis
    samples : PatchSamples
    radius : (m,) float, length
    prior : SmoothnessPrior

    Notes
    -----
    Each patch has the amplitude and the length that make its samples likeliest (type II maximum
    likelihood; Rasmussen and Williams, section 5.4.1). The surface's are their medians over the
    patches that need a residual at all: the amplitude at the median length, since the two trade
    against each other. A sum over the patches would be ruled by those, few, that took in
    samples of another sheet.
    """
    gain = np.concatenate(
        [_gains(basis, samples[rows], radius[rows], prior) for rows in _few(len(radius))]
    )
    rough = gain.max(axis=(1, 2)) > STRONG
    if not rough.any():
        return ResidualScale()
    gain, radius = gain[rough], radius[rough]
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
    """Log evidence (m,) with the smoothness of the trend that suits it best; that turn, bend."""
    equations, log_scale = sums
    length_ratios, z_scales, precisions = smoothness_grid(basis)
    evidence, _ = log_evidence(equations[:, None], np.ones(1), precisions)
    evidence = evidence + log_prior(prior, length_ratios, radius[:, None])
    best = evidence.argmax(axis=1)
    return evidence[np.arange(len(best)), best] + log_scale, length_ratios[best], z_scales[best]


def _gains(basis: Basis, samples: PatchSamples, radius, prior) -> np.ndarray:
    """(m, amplitudes, lengths) log evidence of each texture over none; of amplitudes that cannot be
    the likeliest of any of the patches, minus infinity."""
    alone, _, _ = _best_trend(basis, independent_equations(samples), radius, prior)
    gain = np.full((len(radius), len(_AMPLITUDES), len(_LENGTHS)), -np.inf)
    for j, length in enumerate(_LENGTHS):
        alike = correlation(samples, np.full(len(radius), length))
        for i, a in enumerate(_AMPLITUDES):
            sums = trend_equations(samples, np.full(len(radius), a), alike)
            # The determinant alone bounds the evidence, of this amplitude and of all above it.
            if i and (sums[1] - alone <= gain[:, :i, j].max(axis=1)).all():
                break
            gain[:, i, j] = _best_trend(basis, sums, radius, prior)[0] - alone
    return gain


def _few(count: int) -> list[np.ndarray]:
    """Indices of patches, few at once."""
    return np.array_split(np.arange(count), max(1, -(-count // _AT_ONCE)))
