"""Contours of a touch as plane curves through one point: whether they stay in their planes, and how
far they miss each other."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.section import LEAST_POINTS

# Samples of a curve, to either side of the contact, that tell where it meets the others, and terms
# of the polynomial through them.
_NEAR, _TERMS = 7, 5


@dataclass(frozen=True, eq=False)
class PlaneTest:
    """Parts of the samples of a contour across its plane.

    Parameters
    ----------
    square, freedom : float
        Sum of squares about the best plane, over the variance, and how many are independent.
    tilt, tilt_freedom : float
        The same of what a turned plane explains.
    angle : float, rad
        By which the best plane is turned.
    normal : (3,) float, unit, world
        Of the best plane.
    """

    square: float
    freedom: float
    tilt: float
    tilt_freedom: float
    angle: float
    normal: np.ndarray


def plane_test(contour: Contour) -> PlaneTest | None:
    """Whether a contour stays in its plane; None of one with measured normals, whose samples lie
    beside it, and of few samples.

    Heights over the plane are regressed on the coordinates in it. The second one is left out where
    the contour is so straight that noise turns the plane about it.
    """
    noise, normal = contour.noise_std, contour.plane.normal
    if contour.normals is not None or noise == 0.0 or len(contour.points) < LEAST_POINTS + 2:
        return None
    offset = contour.points - contour.points.mean(axis=0)
    height = offset @ normal
    flat = offset - height[:, None] * normal
    _, spread, axes = np.linalg.svd(flat, full_matrices=False)
    if not spread[0] > noise:
        return None
    count = 2 if spread[1] > max(10.0 * noise, 0.05 * spread[0]) else 1
    along = flat @ axes[:count].T
    slopes = (along.T @ height) / spread[:count] ** 2
    explained = along @ slopes
    rest = height - explained
    turned = normal - slopes @ axes[:count]
    return PlaneTest(
        float(rest @ rest) / noise**2,
        len(height) - 1.0 - count,
        float(explained @ explained) / noise**2,
        float(count),
        float(np.arctan(np.sqrt(slopes @ slopes))),
        turned / np.sqrt(turned @ turned),
    )


@dataclass(frozen=True, eq=False)
class Meeting:
    """Where the curves of a touch meet the line that their planes share.

    Parameters
    ----------
    line : (3,) float, unit, world
    heights, variances : (c,) float, length; length^2
        Along the line, and by noise.
    """

    line: np.ndarray
    heights: np.ndarray
    variances: np.ndarray

    @property
    def misses(self) -> np.ndarray:
        """(c,) heights over their weighted mean, length."""
        weights = 1.0 / self.variances
        return np.asarray(self.heights - weights @ self.heights / weights.sum())


def meeting_of(contours, contact, alpha: float) -> Meeting | None:
    """Where the curves of a touch meet the line of their planes; None where fewer than three follow
    a polynomial there to their noise, or planes share no line."""
    if len(contours) < 3:
        return None
    _, spread, axes = np.linalg.svd(np.array([contour.plane.normal for contour in contours]))
    if spread[2] > 1e-6 or spread[1] < 0.1:
        return None
    found = []
    for contour in contours:
        height = _height(contour, contact, axes[2], alpha)
        if height is None:
            return None
        found.append(height)
    heights, variances = np.array(found).T
    return Meeting(axes[2], heights, variances)


def _height(contour: Contour, contact, line, alpha: float) -> tuple[float, float] | None:
    """Where a curve meets a line in its plane through the contact, and the variance; None where it
    does not cross the line, or a polynomial does not follow it to the noise."""
    noise, offset = contour.noise_std, contour.points - contact
    along = offset @ cross(contour.plane.normal, line)
    middle = int((offset * offset).sum(axis=1).argmin())
    near = slice(max(middle - _NEAR, 0), middle + _NEAR + 1)
    along, height = along[near], (offset @ line)[near]
    freedom = len(along) - _TERMS
    if noise == 0.0 or freedom < 4 or not along.min() < 0.0 < along.max():
        return None
    scale = float(np.abs(along).max())
    design = (along[:, None] / scale) ** np.arange(float(_TERMS))
    inverse = np.linalg.pinv(design)
    found = inverse @ height
    rest = height - design @ found
    # Noise along the curve changes its height by the slope.
    variance = noise**2 * (1.0 + (found[1] / scale) ** 2)
    if float(rest @ rest) > chdtri(freedom, alpha) * variance:
        return None
    return float(found[0]), float(inverse[0] @ inverse[0]) * variance
