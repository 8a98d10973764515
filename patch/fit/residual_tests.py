"""Tests of a patch's residuals: size, order along the contours, curves that disagree, outliers."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import block_diag

from touchatlas.patch.fit.bad_contacts import OUTLIER
from touchatlas.patch.fit.smoothness import scaled_noise
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import GRADIENT, derivative_coefficients, monomials


class ResidualTests(NamedTuple):
    """Residuals of the samples within the radius, in their standard deviations.

    ``outliers`` is the fraction of samples that are five deviations off; the other numbers are
    without them. ``ratio`` is the root of chi-square over its degrees of freedom, ``excess`` how
    far chi-square exceeds these, in its standard deviations. ``serial`` is von Neumann's serial
    correlation: the sum of products of neighbours over the sum of squares, times the root of the
    number. ``disagreement`` is that of the curves. ``left_out`` says whether most samples of some
    curve are five deviations off, but not of most curves.
    """

    outliers: float
    left_out: bool
    ratio: float
    excess: float
    serial: float
    disagreement: float


def residual_tests(patch: Patch, contours: tuple[Contour, ...]) -> ResidualTests:
    """The tests of a patch against contours.

    Notes
    -----
    von Neumann, Distribution of the ratio of the mean square successive difference to the variance,
    1941: without correlation the serial number is about normal with variance one.
    """
    parts = [_distances(patch, contour) for contour in contours]
    residuals, designs, freedom = _standardised(patch, parts)
    joined = np.concatenate(residuals)
    outliers = float((np.abs(joined) > OUTLIER).sum()) / max(len(joined), 1)
    good = [np.abs(r) <= OUTLIER for r in residuals]
    inliers = [r[keep] for r, keep in zip(residuals, good, strict=True)]
    count, freedom = max(sum(len(r) for r in inliers), 1), max(freedom * (1.0 - outliers), 1.0)
    square = sum(float(r @ r) for r in inliers)
    products = sum(float(r[1:] @ r[:-1]) for r in inliers)
    return ResidualTests(
        outliers=outliers,
        left_out=_left_out(good),
        ratio=float(np.sqrt(square / freedom)),
        excess=(square - freedom) / float(np.sqrt(2.0 * count)),
        serial=products / max(square, 1e-300) * float(np.sqrt(count)),
        disagreement=disagreement(
            inliers,
            [design[keep] for design, keep in zip(designs, good, strict=True)],
            [part[4][keep] for part, keep in zip(parts, good, strict=True)],
            patch.covariance,
        ),
    )


def _left_out(good) -> bool:
    """Whether most samples of some curve are no inliers, but not of most curves.

    It need not be the curve that is displaced from the others: a fit may follow that one.
    """
    out = sum(2 * keep.sum() < len(keep) for keep in good)
    return bool(0 < 2 * out < len(good))


def _standardised(patch: Patch, parts):
    """Distances of each contour's samples within the radius and their terms, both in standard
    deviations, and the degrees of freedom.

    A distance is within the sampling plane, where the noise lies; the orders that the patch leaves
    out add to its variance. A sample's leverage is that of least squares or as the patch's
    covariance has it, whichever is smaller.
    """
    design = np.concatenate([terms / std for _, std, _, terms, _ in parts])
    left, values, _ = np.linalg.svd(design, full_matrices=False)
    # A combination of terms with a singular value below a thousandth of the largest is not seen.
    left = left[:, values > 1e-3 * values.max(initial=0.0)]
    explained = ((design @ patch.covariance) * design).sum(axis=1)
    freedom = float((1.0 - np.minimum((left * left).sum(axis=1), explained)).sum())
    whole = [np.sqrt(std[:, 0] ** 2 + beyond) for _, std, beyond, _, _ in parts]
    residuals = [part[0] / s for part, s in zip(parts, whole, strict=True)]
    return residuals, [part[3] / s[:, None] for part, s in zip(parts, whole, strict=True)], freedom


def _distances(patch: Patch, contour: Contour):
    """F (n,) at a contour's samples within the radius, its standard deviation (n, 1) by the noise,
    its variance (n,) by the orders left out, the monomials (n, t), and the places (n,) of the
    samples along the chord of the contour; all scaled."""
    local, value, _, std, beyond, terms = linearised(patch, contour, 1.0)
    chord = patch.frame.axes @ (contour.points[-1] - contour.points[0])
    along = local @ chord / max(np.sqrt(chord @ chord), np.finfo(float).tiny)
    return value, std[:, None], beyond, terms, along


def linearised(patch: Patch, contour: Contour, reach: float):
    """A contour's samples (n, 3) within so many radii of a patch, F (n,) there, its gradient
    (n, 3), its standard deviation (n,) by the noise, which is in the plane, its variance (n,) by
    the orders left out, and the monomials (n, t); all local and scaled."""
    basis = patch.polynomial.basis
    local = patch.frame.to_local(contour.points_in_plane) / patch.radius
    local = local[(local * local).sum(axis=1) <= reach**2]
    terms = monomials(basis, *local.T)
    rows = derivative_coefficients(basis, patch.polynomial.coefficients, list(GRADIENT))
    phi, px, py, pz = rows @ terms
    gradient = np.stack([-px, -py, 1.0 - pz], axis=1)
    across = patch.frame.axes @ contour.plane.normal
    within = gradient - (gradient @ across)[:, None] * across
    # Samples of curves nearly along the surface keep a finite distance.
    length = np.maximum(np.sqrt((within * within).sum(axis=1)), 0.2)
    std = scaled_noise(contour.noise_std, patch.radius) * length
    beyond = patch.leftover**2 * (local[:, :2] ** 2).sum(axis=1) ** (basis.degree + 1)
    return local, local[:, 2] - phi, gradient, std, beyond, terms[: basis.size].T


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

    A patch with many terms follows a displaced curve, and the sum of all squares hardly shows it.
    The smooth part of the residuals does: cubics along each curve.

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
    kept = [i for i, r in enumerate(residuals) if len(r) > 3]
    if not kept:
        return 0.0
    lines = block_diag(*[_cubics(places[i]) for i in kept])
    seen = lines.T @ np.concatenate([designs[i] for i in kept])
    left, vectors = np.linalg.eigh(np.eye(lines.shape[1]) - seen @ covariance @ seen.T)
    # Directions of which the fit leaves less than a fifth of the variance count for nothing.
    free = left > 0.2
    if not free.any():
        return 0.0
    part = (lines.T @ np.concatenate([residuals[i] for i in kept])) @ vectors[:, free]
    return float(normal_deviate((part * part / left[free]).sum(), free.sum()))


def _cubics(place) -> np.ndarray:
    """(n, 4) orthonormal polynomials of degree 3 at places (n,)."""
    middle, half = 0.5 * (place.max() + place.min()), 0.5 * np.ptp(place)
    return np.linalg.qr(legvander((place - middle) / max(half, np.finfo(float).tiny), 3))[0]


def excess_scatter(contours: tuple[Contour, ...]) -> float:
    """How much more one curve scatters across its own plane than the others, in deviations.

    Across the plane of a curve there is noise alone. In another unit it is larger or smaller by
    the ratio of the units. The plane is that of the points, so that it may be stated wrongly.

    Notes
    -----
    The scatter over the noise is compared with that of the other curves, or with one where theirs
    is less: curves of points that were put on their planes tell nothing.
    """
    noise = [max(c.noise_std, 1e-6 * float(np.ptp(c.points, axis=0).max())) for c in contours]
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
