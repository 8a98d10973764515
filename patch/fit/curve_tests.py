"""Tests of the curves of a touch against each other: one surface, and one unit."""

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import block_diag

from touchatlas.patch.geometry.contour import Contour

# Degree along a curve of the residuals that are compared: height, slope, bend and its change. With
# degree 6 the test finds as many curves of another frame, and fewer that lie beside the others.
_DEGREE = 3
# Least fraction of a residual's variance that a fit leaves. Doubled, the slope of a curve counts
# only where a fourth one crosses it.
_LEFT = 0.2
# Rounding of exact contacts over the size of a curve.
_ROUNDING = 1e-6


def normal_deviate(chi_square, freedom):
    """The standard normal deviate that is as probable as a chi-square.

    Notes
    -----
    Wilson and Hilferty, The distribution of chi-square, 1931. It errs by 0.05 at three degrees of
    freedom and three deviations.

    Examples
    --------
    One of a thousand chi-squares of three degrees of freedom exceeds 16.27, and one of a thousand
    normal numbers 3.09:

    >>> round(float(normal_deviate(16.27, 3)), 1)
    3.1
    """
    variance = 2.0 / (9.0 * freedom)
    return ((chi_square / freedom) ** (1.0 / 3.0) - 1.0 + variance) / np.sqrt(variance)


def disagreement(residuals, designs, places, covariance) -> float:
    """How far curves disagree on the surface where they cross, in standard deviations.

    A patch with many terms follows a curve that lies beside the others, and the sum of all squares
    hardly shows it. The smooth part of the residuals does: cubics along each curve.

    Parameters
    ----------
    residuals : list of (n,) float
        Of each curve, over their deviations.
    designs : list of (n, t) float
        Terms at the samples, over the same deviations.
    places : list of (n,) float
        Of the samples along their curve, in any unit.
    covariance : (t, t) float
        Of the coefficients.

    Notes
    -----
    Residuals of a fit have the covariance I - H with H = J C J^t. Projected on cubics along the
    curves, in the directions that the fit leaves, their squares sum to a chi-square: Cook and
    Weisberg, Residuals and Influence in Regression, section 2.1.
    """
    kept = [i for i, r in enumerate(residuals) if len(r) > _DEGREE]
    if not kept:
        return 0.0
    lines = block_diag(*[_cubics(places[i]) for i in kept])
    seen = lines.T @ np.concatenate([designs[i] for i in kept])
    left, vectors = np.linalg.eigh(np.eye(lines.shape[1]) - seen @ covariance @ seen.T)
    free = left > _LEFT
    if not free.any():
        return 0.0
    part = (lines.T @ np.concatenate([residuals[i] for i in kept])) @ vectors[:, free]
    return float(normal_deviate((part * part / left[free]).sum(), free.sum()))


def _cubics(place) -> np.ndarray:
    """(n, 4) orthonormal polynomials of degree 3 at places (n,)."""
    middle, half = 0.5 * (place.max() + place.min()), 0.5 * np.ptp(place)
    return np.linalg.qr(legvander((place - middle) / max(half, np.finfo(float).tiny), _DEGREE))[0]


def excess_scatter(contours: tuple[Contour, ...]) -> float:
    """How much more one curve scatters across its own plane than the others, in deviations.

    Across the plane of a curve there is noise alone. In another unit it is larger or smaller by
    the ratio of the units. The plane is that of the points, so that it may be stated wrongly.

    Notes
    -----
    The scatter over the noise is compared with that of the other curves, or with one where theirs
    is less: curves of points that were put on their planes tell nothing.
    """
    noise = [max(c.noise_std, _ROUNDING * float(np.ptp(c.points, axis=0).max())) for c in contours]
    sums = np.array([_off_plane(c) / s**2 for c, s in zip(contours, noise, strict=True)])
    freedom = np.array([len(c.points) - 3.0 for c in contours])
    enough = freedom > 0
    sums, freedom = sums[enough], freedom[enough]
    if len(sums) < 2:
        return 0.0
    others = (sums.sum() - sums) / (freedom.sum() - freedom)
    return float(normal_deviate(sums / np.maximum(others, 1.0), freedom).max())


def _off_plane(contour: Contour) -> float:
    """Sum of the squared distances of a curve's points from their best plane."""
    centred = contour.points - contour.points.mean(axis=0)
    return float(np.linalg.svd(centred, compute_uv=False)[-1] ** 2) if len(centred) > 3 else 0.0
