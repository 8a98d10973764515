"""Bad contacts: samples of a contour that no smooth curve explains."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.geometry.contour import Contour

_DEGREE = 6
# A contact this many deviations off is bad: one in 1.7 million good ones.
_OUTLIER = 5.0
# No more than this share of a contour can be told from its shape.
_LARGEST_SHARE = 0.25
_LEAST_FREEDOM = 5


def without_bad_contacts(contour: Contour) -> Contour:
    """The contour without the samples that its own smooth course, without them, misses widely.

    A polynomial of degree 6 along the curve, in its plane; the sample with the largest deletion
    residual goes first, as long as that exceeds five deviations, of the noise or of what the
    polynomial leaves of the other samples, whichever is more.

    Parameters
    ----------
    contour : Contour
        One without noise is kept as it is: exact contacts are not bad.

    Notes
    -----
    Deletion residuals: Cook and Weisberg, Residuals and Influence in Regression, section 2.2.
    They find a bad contact at the end of a contour, which the curve
    would otherwise follow.

    Examples
    --------
    >>> from touchatlas.patch.geometry.contour import ContourEnd, SamplingPlane
    >>> points = np.zeros((21, 3))
    >>> points[:, 0], points[0, 2] = np.linspace(-1, 1, 21), 0.5
    >>> plane = SamplingPlane(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    >>> bad = Contour(points, plane, 1e-3, (ContourEnd.LENGTH_REACHED,) * 2)
    >>> len(without_bad_contacts(bad).points)
    20
    """
    if contour.noise_std == 0.0:
        return contour
    course = _course(contour)
    keep = np.arange(len(contour.points))
    least = max(_DEGREE + 1 + _LEAST_FREEDOM, len(keep) * (1.0 - _LARGEST_SHARE))
    while len(keep) > least:
        along, across = course[:, keep]
        residuals = _deletion_residuals(along, across, contour.noise_std)
        worst = int(residuals.argmax())
        if residuals[worst] <= _OUTLIER:
            break
        keep = np.delete(keep, worst)
    if len(keep) == len(contour.points):
        return contour
    return replace(contour, points=contour.points[keep])


def _course(contour: Contour) -> np.ndarray:
    """(2, n) coordinates in the plane, along the contour over its reach and across it."""
    centred = contour.points_in_plane - contour.points_in_plane.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    along, across = centred @ axes[0], centred @ axes[1]
    return np.stack([along / max(float(np.abs(along).max()), np.finfo(float).tiny), across])


def _deletion_residuals(along, across, noise_std: float) -> np.ndarray:
    """(n,) what each sample is off the curve of the others, in its standard deviations."""
    design = np.polynomial.legendre.legvander(along, _DEGREE)
    q, _ = np.linalg.qr(design)
    residual = across - q @ (q.T @ across)
    free = np.maximum(1.0 - (q * q).sum(axis=1), np.finfo(float).eps)
    # Of the others, without each: noise, and what the degree leaves out.
    square = residual @ residual - residual * residual / free
    left = np.maximum(square, 0.0) / (len(along) - _DEGREE - 2)
    spread = np.maximum(np.sqrt(left), max(noise_std, np.finfo(float).eps))
    return np.abs(residual) / (np.sqrt(free) * spread)
