"""Tests of a patch's residuals: size, order along the contours, curves that disagree, outliers."""

from typing import NamedTuple

import numpy as np

from touchatlas.patch.fit.curve_tests import disagreement
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import GRADIENT, derivative_coefficients, monomials

# Distance of an outlier in deviations. Doubled, bad contacts of five to ten deviations count as
# lack of fit.
_OUTLIER = 5.0
# Rounding of exact contacts over the radius: the fit takes noise to be no less.
_ROUNDING = 1e-6
# Least gradient within a sampling plane that a distance is divided by, no unit. Doubled, residuals
# on curves nearly along the surface count half.
_LEAST_GRADIENT = 0.2
# Least singular value of the design over the largest: a combination of terms below it is not seen.
# Doubled, one combination in twenty more is not.
_LEAST_VALUE = 1e-3


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
    outliers = float((np.abs(joined) > _OUTLIER).sum()) / max(len(joined), 1)
    good = [np.abs(r) <= _OUTLIER for r in residuals]
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

    It need not be the curve that lies beside the others: a fit may follow that one.
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
    left = left[:, values > _LEAST_VALUE * values.max(initial=0.0)]
    explained = ((design @ patch.covariance) * design).sum(axis=1)
    freedom = float((1.0 - np.minimum((left * left).sum(axis=1), explained)).sum())
    whole = [np.sqrt(std[:, 0] ** 2 + beyond) for _, std, beyond, _, _ in parts]
    residuals = [part[0] / s for part, s in zip(parts, whole, strict=True)]
    return residuals, [part[3] / s[:, None] for part, s in zip(parts, whole, strict=True)], freedom


def _distances(patch: Patch, contour: Contour):
    """F (n,) at a contour's samples within the radius, its standard deviation (n, 1) by the noise,
    its variance (n,) by the orders left out, the monomials (n, t), and the places (n,) of the
    samples along the chord of the contour; all scaled."""
    basis = patch.polynomial.basis
    local = patch.frame.to_local(contour.points_in_plane) / patch.radius
    local = local[(local * local).sum(axis=1) <= 1.0]
    terms = monomials(basis, *local.T)
    rows = derivative_coefficients(basis, patch.polynomial.coefficients, list(GRADIENT))
    phi, px, py, pz = rows @ terms
    gradient = np.stack([-px, -py, 1.0 - pz], axis=1)
    across = patch.frame.axes @ contour.plane.normal
    gradient -= (gradient @ across)[:, None] * across
    length = np.maximum(np.sqrt((gradient * gradient).sum(axis=1)), _LEAST_GRADIENT)
    std = max(contour.noise_std, _ROUNDING * patch.radius) / patch.radius * length
    beyond = patch.leftover**2 * (local[:, :2] ** 2).sum(axis=1) ** (basis.degree + 1)
    chord = patch.frame.axes @ (contour.points[-1] - contour.points[0])
    along = local @ chord / max(np.sqrt(chord @ chord), np.finfo(float).tiny)
    return local[:, 2] - phi, std[:, None], beyond, terms[: basis.size].T, along
