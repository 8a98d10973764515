"""Bad contacts: samples of a contour that no smooth curve explains."""

import numpy as np

from touchatlas.patch.geometry.contour import Contour

# Least distance of a bad contact, in standard deviations: one in 1.7 million good ones is as far.
OUTLIER = 5.0


def without_bad_contacts(contour: Contour) -> Contour:
    """The contour without samples far off the smooth curve through the other samples.

    The curve is a polynomial of degree 6 in the plane. The sample with the largest deletion
    residual is removed first, as long as that exceeds five standard deviations. The standard
    deviation is that of the noise or of the other residuals, whichever is larger.

    Parameters
    ----------
    contour : Contour
        A contour without noise is returned unchanged: exact contacts are not bad.

    Notes
    -----
    Deletion residuals: Cook and Weisberg, Residuals and Influence in Regression, section 2.2. They
    find a bad contact at the end of a contour, where the curve would otherwise follow it.

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
    coordinates = _plane_coordinates(contour)
    keep = np.arange(len(contour.points))
    # Five degrees of freedom are left. An edge in a contour makes more than a quarter bad.
    least = max(12, 0.75 * len(keep))
    while len(keep) > least:
        along, across = coordinates[:, keep]
        residuals = _deletion_residuals(along, across, contour.noise_std)
        worst = int(residuals.argmax())
        if residuals[worst] <= OUTLIER:
            break
        keep = np.delete(keep, worst)
    if len(keep) == len(contour.points):
        return contour
    return contour.only(keep)


def _plane_coordinates(contour: Contour) -> np.ndarray:
    """(2, n) coordinates in the plane: along the contour, over its half length, and across it."""
    centred = contour.points_in_plane - contour.points_in_plane.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    along, across = centred @ axes[0], centred @ axes[1]
    return np.stack([along / max(float(np.abs(along).max()), np.finfo(float).tiny), across])


def _deletion_residuals(along, across, noise_std: float) -> np.ndarray:
    """(n,) distance of each sample from the curve of the others, in standard deviations."""
    # Degree 6 follows an arc of 90 degrees to 2e-4 of its radius.
    design = np.polynomial.legendre.legvander(along, 6)
    q, _ = np.linalg.qr(design)
    residual = across - q @ (q.T @ across)
    # One minus the leverage: the variance of a residual over that of the noise.
    ratio = np.maximum(1.0 - (q * q).sum(axis=1), np.finfo(float).eps)
    sum_of_squares = residual @ residual - residual * residual / ratio
    variance = np.maximum(sum_of_squares, 0.0) / (len(along) - 8)
    spread = np.maximum(np.sqrt(variance), max(noise_std, np.finfo(float).eps))
    return np.abs(residual) / (np.sqrt(ratio) * spread)
