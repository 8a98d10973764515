"""Kriging of what polynomials leave out: texture, from the residuals of samples about a point."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

# Samples about a point by which its residual is predicted. Doubled, it takes four times as long and
# gains a hundredth.
_NEAREST = 24
# Points at which residuals are predicted at once: their matrices fit into the cache. Doubled,
# nothing changes.
_AT_ONCE = 128
# Samples about a sample that tell how large residuals are there. Doubled, a rough spot is smoothed.
_LOCAL = 30
# Least cosine of the normals of two samples that tell of each other: 72 degrees.
_FACING = 0.3
# Lengths of correlation that are tried, over the radius of the polynomials. Finer steps change the
# likelihood by little.
_LENGTHS = 0.02, 0.04, 0.08, 0.16, 0.32
# Groups of neighbouring samples whose likelihood tells the length. Doubled, it takes longer.
_GROUPS = 80
# Nearest samples of which one with an amplitude makes a point rough. Doubled, more points are asked
# for nothing.
_ASKED = 4
# Amplitude of residuals in deviations of a sample below which they are noise. Doubled, texture of
# one deviation is left out.
_SLIGHT = 0.5
# Share of a sample's variance that is noise; the rest is lack of fit that is borne, which residuals
# show themselves. Doubled, texture of one deviation is left out and counts as known.
_NOISE = 0.6


@dataclass(frozen=True, eq=False)
class ResidualKriging:
    """Local simple kriging (N. Cressie, "Statistics for Spatial Data", 1993, section 3.2):
    residuals are a Gaussian process of mean zero, with a Matérn correlation of smoothness 3/2 and
    an amplitude that varies from place to place.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
    residuals : (n,) float, length
        Signed distances of the samples from the polynomials.
    amplitudes : (n,) float, length
        Standard deviation of the process about each sample.
    length : float, length
        Length of correlation.
    std : float, length
        Standard deviation of a sample.
    """

    points: np.ndarray
    normals: np.ndarray
    residuals: np.ndarray
    amplitudes: np.ndarray
    length: float
    std: float
    tree: cKDTree

    def correct(self, points, found) -> None:
        """Add what is predicted to distances and variances ``found`` (n, 5) at points (n, 3)."""
        if not (len(points) and self.amplitudes.any()):
            return
        near = self.tree.query(points, k=min(_ASKED, len(self.points)))[1]
        rough = np.flatnonzero(self.amplitudes[near.reshape(len(points), -1)].any(axis=1))
        for start in range(0, len(rough), _AT_ONCE):
            some = rough[start : start + _AT_ONCE]
            normals = found[some, 1:4]
            feet = points[some] - found[some, :1] * normals
            predicted, variance = self._predicted(feet, normals)
            found[some, 0] -= predicted
            found[some, 4] += variance

    def _predicted(self, feet, normals) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (m,) and variances (m,) at feet (m, 3) with normals (m, 3)."""
        count = min(_NEAREST, len(self.points))
        away, near = (np.reshape(x, (-1, count)) for x in self.tree.query(feet, k=count))
        faces = np.einsum("nkj,nj->nk", self.normals[near], normals) > _FACING
        amplitude = np.where(faces, self.amplitudes[near], 0.0)
        own = amplitude.sum(axis=1) / np.maximum(faces.sum(axis=1), 1)
        among = _covariance(self.points[near], amplitude, self.length, self.std)
        toward = own[:, None] * amplitude * matern(away, self.length)
        known = np.where(faces, self.residuals[near], 0.0)
        solved = np.linalg.solve(among, np.stack([known, toward], axis=2))
        variance = own**2 - (toward * solved[..., 1]).sum(axis=1)
        return (toward * solved[..., 0]).sum(axis=1), np.maximum(variance, 0.0)


def krige(
    points, normals, residuals, radius: float, std: float, least: float = 0.0
) -> ResidualKriging:
    """The process that residuals (n,) of samples at points (n, 3) with normals (n, 3) show, beside
    polynomials of a radius; ``std`` is the standard deviation of a sample, and amplitudes of no
    more than ``least``, length, are left out."""
    tree = cKDTree(points)
    near = nearest_of(tree, np.arange(len(points)))
    square = amplitudes_of(normals[near], residuals[near], std) ** 2
    # It falls to zero steadily: where it ended at once the surface would have a step.
    amplitudes = np.sqrt(np.maximum(square - max(_SLIGHT * std, least) ** 2, 0.0))
    near = near[np.unique(np.linspace(0, len(points) - 1, _GROUPS).astype(int))]
    faces = np.einsum("nkj,nj->nk", normals[near], normals[near[:, 0]]) > _FACING
    amplitude = np.where(faces, amplitudes[near], 0.0)
    known = np.where(faces, residuals[near], 0.0)
    trials = [radius * part for part in _LENGTHS]
    worst = [_minus_log_likelihood(points[near], amplitude, known, x, std) for x in trials]
    length = trials[int(np.argmin(worst))]
    return ResidualKriging(points, normals, residuals, amplitudes, length, std, tree)


def nearest_of(tree: cKDTree, samples) -> np.ndarray:
    """(m, k) samples about samples (m,) that tell how large residuals are there, these first."""
    near = tree.query(tree.data[samples], k=min(_LOCAL, tree.n))[1].reshape(len(samples), -1)
    # Of coincident samples another one may be the first.
    moved = np.where(near[:, 1:] == samples[:, None], near[:, :1], near[:, 1:])
    return np.column_stack([samples, moved])


def amplitudes_of(normals, residuals, std: float) -> np.ndarray:
    """(m,) standard deviation of residuals (m, k) of neighbours with normals (m, k, 3) of which the
    first is the middle, length, without that of a sample."""
    faces = np.einsum("nkj,nj->nk", normals, normals[:, 0]) > _FACING
    return amplitude_of((residuals**2 * faces).sum(axis=1) / np.maximum(faces.sum(axis=1), 1), std)


def amplitude_of(square, std: float) -> np.ndarray:
    """(m,) standard deviation of residuals of mean squares (m,), length^2, without that of a
    sample."""
    return np.asarray(np.sqrt(np.maximum(square - _NOISE * std**2, 0.0)))


def matern(distance, length: float) -> np.ndarray:
    """Correlation at distances: Matérn of smoothness 3/2.

    >>> float(matern(0.0, 2.0)), float(matern(2.0, 2.0).round(3))
    (1.0, 0.483)
    """
    ratio = np.sqrt(3.0) * np.asarray(distance) / length
    return np.asarray((1.0 + ratio) * np.exp(-ratio))


def _covariance(points, amplitude, length: float, std: float) -> np.ndarray:
    """(g, k, k) covariance of samples in groups (g, k, 3) of amplitudes (g, k), with their noise.

    Squares of distances are differences of squares: rounding changes a correlation, whose slope is
    zero at a distance of zero, by no more than itself.
    """
    offset = (points - points[:, :1]) * (np.sqrt(3.0) / length)
    square = (offset * offset).sum(axis=2)
    ratio = offset @ offset.transpose(0, 2, 1)
    ratio *= -2.0
    ratio += square[:, :, None]
    ratio += square[:, None]
    np.sqrt(np.maximum(ratio, 0.0, out=ratio), out=ratio)
    out = np.exp(-ratio)
    ratio += 1.0
    out *= ratio
    out *= amplitude[:, :, None]
    out *= amplitude[:, None]
    out[:, np.arange(points.shape[1]), np.arange(points.shape[1])] += _NOISE * std**2
    return np.asarray(out)


def _minus_log_likelihood(points, amplitude, residuals, length: float, std: float) -> float:
    """Minus the logarithm of the likelihood of residuals (g, k), without a constant."""
    factor = np.linalg.cholesky(_covariance(points, amplitude, length, std))
    white = np.linalg.solve(factor, residuals[..., None])[..., 0]
    return float(0.5 * (white**2).sum() + np.log(np.einsum("gii->gi", factor)).sum())
