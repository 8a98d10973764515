"""Bad contacts: samples of a contour that no smooth curve explains."""

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour

# Least distance of a bad contact, in standard deviations: one in 1.7 million good ones is as far.
OUTLIER = 5.0
# Samples of a window to either side.
_SIDE = 3


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


def are_bad_contacts(contour: Contour, noise: float) -> np.ndarray:
    """(n,) whether each sample of a contour is a bad contact, with any edges in it.

    A bad contact lies off the median of the seven samples about it, by more than five deviations
    across the plane, or by ten in it across the direction of travel, and does so alone: a sample
    beside it that lies off to the same side is part of a narrow feature. Along a curve that bends
    or turns at an edge its own median is near. Fine detail does not make a curve turn by a right
    angle and back within one sample, so that a bad contact lies off in the plane by a step at
    least. Samples with measured normals lie beside their plane, and at the ends a single sample may
    be beyond an edge; these are judged by the other part alone.

    Notes
    -----
    The Hampel identifier (Davies and Gather, The identification of multiple outliers, 1993), with
    ``noise``, length, as the least deviation.

    Examples
    --------
    A corner is none, a sample beside it is:

    >>> from touchatlas.patch.geometry.contour import ContourEnd, SamplingPlane
    >>> s = np.abs(np.arange(-10.0, 11.0))[:, None]
    >>> points = s * [1.0, 0.0, 0.0] + np.arange(-10.0, 11.0)[:, None] * [0.0, 1.0, 0.0]
    >>> points[14, 1] += 3.0
    >>> plane = SamplingPlane(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    >>> bad = Contour(points, plane, 0.01, (ContourEnd.LENGTH_REACHED,) * 2)
    >>> np.flatnonzero(are_bad_contacts(bad, 0.01)).tolist()
    [14]
    """
    points, normal, count = contour.points, contour.plane.normal, len(contour.points)
    if count <= 2 * _SIDE or noise == 0.0:
        return np.zeros(count, bool)
    middle = np.clip(np.arange(count), _SIDE, count - 1 - _SIDE)
    window = points[middle[:, None] + np.arange(-_SIDE, _SIDE + 1)] - points[:, None]
    along = _medoid(window[:, -_SIDE:]) - _medoid(window[:, :_SIDE])
    side = cross(np.broadcast_to(normal, along.shape), along)
    length = np.sqrt((side * side).sum(axis=1))
    side /= np.maximum(length, np.finfo(float).tiny)[:, None]
    # At an edge samples are a few deviations apart, and their order says little.
    within, is_off_within = _off_median(np.einsum("nkj,nj->nk", window, side), 2.0 * noise)
    across, is_off_across = _off_median(window @ normal, noise)
    is_off_within &= middle == np.arange(count)
    step = 0.5 * np.sqrt(((window[:, _SIDE + 1] - window[:, _SIDE - 1]) ** 2).sum(axis=1))
    is_off_within &= np.abs(within) > step
    is_off_across &= contour.normals is None
    off = np.stack([within * is_off_within, across * is_off_across], axis=1)
    offset = off[:, :1] * side + off[:, 1:] * normal
    # No shape leads a contour out of its plane.
    bad = is_off_across | (is_off_within & ~_are_joined(offset))
    # Where a quarter is bad, none is: the contour has another shape.
    return bad if bad.mean() <= 0.25 else np.zeros(count, bool)


def _medoid(window) -> np.ndarray:
    """(n, 3) of each group of points (n, k, 3) the one that is nearest to the others in sum."""
    apart = np.sqrt(((window[:, :, None] - window[:, None]) ** 2).sum(axis=3))
    which = apart.sum(axis=2).argmin(axis=1)
    return np.asarray(window[np.arange(len(window)), which])


def _off_median(heights, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """How far each sample, at height 0, is off the median of the heights (n, k) of those about it,
    and whether (n,) that is more than noise and their spread explain."""
    median = np.median(heights, axis=1)
    # The deviation of a normal law over the median of absolute ones.
    spread = 1.4826 * np.median(np.abs(heights - median[:, None]), axis=1)
    return -median, np.abs(median) > OUTLIER * np.maximum(noise, spread)


def _are_joined(offset) -> np.ndarray:
    """(n,) whether a sample beside each lies off to the same side by a third of its offset (n, 3),
    or more."""
    square = (offset * offset).sum(axis=1)
    product = (offset[1:] * offset[:-1]).sum(axis=1)
    size = np.sqrt(square)
    alike = product > 0.5 * size[1:] * size[:-1]
    alike &= np.minimum(size[1:], size[:-1]) > np.maximum(size[1:], size[:-1]) / 3.0
    return np.append(alike, False) | np.append(False, alike)
