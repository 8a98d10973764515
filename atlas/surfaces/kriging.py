"""Kriging: what sextics leave out at a point, from the residuals of the samples about it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.surfaces.sextic_sites import FACING
from touchatlas.patch.geometry.arrays import evenly

# Share of the variance of a sample that is noise. The rest is lack of fit, which residuals show.
_NOISE = 0.6
# Samples about a point by which its residual is predicted, and about a sample by which the
# amplitude is estimated.
_NEAREST, _LOCAL = 16, 30
# Correlation lengths that are compared, over the radius of the sextics.
_LENGTHS = 0.02, 0.04, 0.08, 0.16, 0.32
# Groups of neighbours whose likelihood is compared, and points that are predicted at once.
_GROUPS, _AT_ONCE = 80, 128


@dataclass(frozen=True, eq=False)
class ResidualKriging:
    """Local simple kriging (N. Cressie, "Statistics for Spatial Data", 1993, section 3.2):
    residuals are a Gaussian process of mean zero, with a Matérn correlation of smoothness 3/2 and
    an amplitude that varies from place to place.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
        Samples.
    residuals : (n,) float, length
        Their signed distances from the sextics.
    stds : (n,) float, length
        Their standard deviations.
    variance : (n,) float, length^2
        That of the process about each sample.
    length : float, length
        Correlation length.
    tree : cKDTree
        Of the points.
    """

    points: np.ndarray
    normals: np.ndarray
    residuals: np.ndarray
    stds: np.ndarray
    variance: np.ndarray
    length: float
    tree: cKDTree

    def at(self, points, normals) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (m,), length, and their variances (m,), length^2, at points (m, 3) of the
        surface with its normals (m, 3)."""
        out = np.zeros((2, len(points)))
        if not self.variance.any():
            return out[0], out[1]
        count = min(_NEAREST, len(self.points))
        away, near = (np.reshape(x, (-1, count)) for x in self.tree.query(points, count))
        rough = np.flatnonzero(self.variance.take(near[:, :4]).any(axis=1))
        for start in range(0, len(rough), _AT_ONCE):
            some = rough[start : start + _AT_ONCE]
            out[:, some] = self._predicted(away[some], near[some], normals[some])
        return out[0], out[1]

    def _predicted(self, away, near, normals) -> np.ndarray:
        """(2, m) residuals and variances at points with normals (m, 3), ``away`` (m, k), length,
        from their nearest samples (m, k)."""
        faces = np.einsum("nkj,nj->nk", self.normals.take(near, axis=0), normals) > FACING
        amplitude = np.where(faces, np.sqrt(self.variance.take(near)), 0.0)
        # Inverse squares of distances (Shepard 1968): at a sample the amplitude is its own.
        tiny = np.finfo(float).tiny
        weight = faces / np.maximum(away, 1e-9 * self.length) ** 2
        own = (weight * amplitude).sum(axis=1) / np.maximum(weight.sum(axis=1), tiny)
        columns = self.points.take(near, axis=0), amplitude, self.length, self.stds.take(near)
        among = _covariance(*columns)
        toward = own[:, None] * amplitude * matern(away, self.length)
        known = np.where(faces, self.residuals.take(near), 0.0)
        white = _whitened(among, np.stack([known, toward], axis=1))[1]
        predicted = (white * white[:, 1:]).sum(axis=2)
        return np.stack([predicted[:, 0], np.maximum(own**2 - predicted[:, 1], 0.0)])


def krige(
    points, normals, residuals, stds, radius: float, least: float = 0.0, near=None
) -> ResidualKriging:
    """The process that residuals show beside sextics: its correlation length is the likeliest.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
        Samples, and normals of the sextics there.
    residuals, stds : (n,) float, length
        Their signed distances from the sextics, and their standard deviations.
    radius : float, length
        That of the sextics.
    least : float, length
        Amplitude that is left out of the process.
    near : (cKDTree, (n, k) int), optional
        The tree of the points, and of each its ``neighbours``, where these are known.
    """
    tree = cKDTree(points) if near is None else near[0]
    groups = neighbours(tree, np.arange(len(points))) if near is None else near[1]
    variance = left_out(normals[groups], residuals[groups], stds[groups])
    variance = np.maximum(variance - least**2, 0.0)
    some = evenly(groups, _GROUPS)
    faces = np.einsum("gkj,gj->gk", normals[some], normals[some[:, 0]]) > FACING
    amplitude = np.where(faces, np.sqrt(variance[some]), 0.0)
    known = np.where(faces, residuals[some], 0.0)
    lengths = [radius * part for part in _LENGTHS]
    worst = [_minus_log_likelihood(points[some], amplitude, known, x, stds[some]) for x in lengths]
    best = lengths[int(np.argmin(worst))]
    return ResidualKriging(points, normals, residuals, stds, variance, best, tree)


def neighbours(tree: cKDTree, samples) -> np.ndarray:
    """(m, k) the thirty samples about samples (m,), these first."""
    near = tree.query(tree.data[samples], k=min(_LOCAL, tree.n))[1].reshape(len(samples), -1)
    # Of coincident samples another one may be the first.
    moved = np.where(near[:, 1:] == samples[:, None], near[:, :1], near[:, 1:])
    return np.column_stack([samples, moved])


def left_out(normals, residuals, stds) -> np.ndarray:
    """(g,) variance, length^2, of what a surface leaves out in groups of neighbours beyond the
    noise of samples: a mean with the inverse variances as weights.

    Parameters
    ----------
    normals : (g, k, 3) float, unit
        Those of the surface. Neighbours that do not face as the first one does do not count.
    residuals, stds : (g, k) float, length
        Signed distances of the samples from the surface, and their standard deviations.
    """
    faces = np.einsum("gkj,gj->gk", normals, normals[:, 0]) > FACING
    least = stds.min(axis=1)
    weight = faces * (least[:, None] / stds) ** 2
    sum_of_weights = np.maximum(weight.sum(axis=1), np.finfo(float).tiny)
    square = (residuals**2 * weight).sum(axis=1) / sum_of_weights
    return beyond_noise(square, least * np.sqrt(faces.sum(axis=1) / sum_of_weights))


def beyond_noise(square, std) -> np.ndarray:
    """(m,) what mean squares of residuals (m,), length^2, have beyond the noise of samples."""
    return np.maximum(square - _NOISE * std**2, 0.0)


def matern(distance, length: float) -> np.ndarray:
    """Correlation at distances: Matérn of smoothness 3/2.

    >>> float(matern(0.0, 2.0)), float(matern(2.0, 2.0).round(3))
    (1.0, 0.483)
    """
    ratio = np.sqrt(3.0) * np.asarray(distance)
    ratio /= length
    decay = np.exp(-ratio)
    ratio += 1.0
    decay *= ratio
    return np.asarray(decay)


def _covariance(points, amplitude, length: float, stds) -> np.ndarray:
    """(g, k, k) covariance of samples in groups (g, k, 3) of amplitudes (g, k), length, with their
    noise."""
    offset = points - points[:, :1]
    square = (offset * offset).sum(axis=2)
    # Rounding of differences of squares changes a correlation, whose slope is zero at a distance of
    # zero, by no more than itself.
    between = 2.0 * offset @ offset.transpose(0, 2, 1)
    np.subtract(square[:, :, None] + square[:, None], between, out=between)
    np.maximum(between, 0.0, out=between)
    out = matern(np.sqrt(between, out=between), length)
    out *= amplitude[:, :, None] * amplitude[:, None]
    diagonal = np.arange(points.shape[1])
    # A millionth of the amplitude is beyond what rounding leaves of samples that nearly coincide.
    out[:, diagonal, diagonal] += _NOISE * stds**2 + (1e-6 * amplitude) ** 2
    return out


def _minus_log_likelihood(points, amplitude, residuals, length: float, stds) -> float:
    """Minus the logarithm of the likelihood of residuals (g, k), without a constant."""
    covariance = _covariance(points, amplitude, length, stds)
    diagonal, white = _whitened(covariance, residuals[:, None])
    return float(0.5 * (white**2).sum() + np.log(diagonal).sum())


def _whitened(covariance, vectors) -> tuple[np.ndarray, np.ndarray]:
    """Diagonals (g, k) of the lower triangular L with L L' a covariance (g, k, k), and L^-1 v of
    vectors v (g, r, k). Written below the covariance, they become that in its Cholesky factor,
    whatever large numbers follow on the diagonal."""
    groups, count, size = vectors.shape
    bordered = np.zeros((groups, size + count, size + count))
    bordered[:, :size, :size], bordered[:, size:, :size] = covariance, vectors
    below = np.arange(size, size + count)
    bordered[:, below, below] = np.finfo(float).max
    factor = np.linalg.cholesky(bordered)
    return np.einsum("gii->gi", factor)[:, :size], factor[:, size:, :size]
