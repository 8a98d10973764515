"""Errors of recorded curves: how far whole curves are displaced, and points out of order."""

import numpy as np
from scipy.special import chdtri, ndtri, stdtrit

from touchatlas.patch.geometry.curvature import normal_from_tangents
from touchatlas.patch.geometry.order import disorder, out_of_order
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.reference_point import foot, meeting_point


def offset_deviation(point, contours, noise: float) -> float:
    """Standard deviation of the displacements of curves, by their heights over their common point,
    length; 0 where noise explains the heights.

    Of each curve a cubic is fitted to the heights near the point, and its value there has a known
    variance. The sum of squares of the values about their mean, over that variance, is chi-squared
    with one degree less than there are curves. Few curves tell little of a deviation: see
    ``_of_few``.

    Parameters
    ----------
    point : (3,) float, length, world
    contours : sequence of Contour
    noise : float, length
        Of each coordinate.
    """
    parts = [c.points - c.points.mean(axis=0) for c in contours]
    tangents = np.array([np.linalg.svd(p, full_matrices=False)[2][0] for p in parts])
    normal = normal_from_tangents(tangents, np.ones(3))
    found = [_height(c.points - point, t, normal) for c, t in zip(contours, tangents, strict=True)]
    heights, factors = np.array(found).T
    variance = float(np.mean(factors)) * noise**2
    square, freedom = float(((heights - heights.mean()) ** 2).sum()), len(heights) - 1
    reach = max(float(np.ptp(c.points, axis=0).max()) for c in contours)
    # One in a thousand good files exceeds it. A cubic leaves 5e-4 of the longest curve of the
    # shape.
    limit = max(chdtri(freedom, 1e-3) * variance, freedom * (5e-4 * reach) ** 2)
    return _of_few(square / freedom - variance, freedom) if square > limit else 0.0


def miss_deviation(contours) -> float:
    """Standard deviation of the displacements of curves, by their distances from the point nearest
    to all of them, length.

    A displacement along a curve moves it within itself, so each of c curves tells two coordinates.
    The point takes three of them: 2 c - 3 degrees of freedom are left.
    """
    point = meeting_point([c.points for c in contours])
    square = sum(float(((foot(c.points, point)[0] - point) ** 2).sum()) for c in contours)
    freedom = 2 * len(contours) - 3
    return _of_few(square / freedom, freedom)


def _of_few(variance: float, freedom: int) -> float:
    """Deviation for a variance of few degrees of freedom, such that 1.96 of it hold 95 %.

    The quantile of Student's t takes the place of the normal one: Guide to the expression of
    uncertainty in measurement (GUM), G.3. With two degrees of freedom it is 2.2 times as large.
    """
    return float(np.sqrt(variance) * stdtrit(freedom, 0.975) / ndtri(0.975))


def _height(offset, tangent, normal) -> tuple[float, float]:
    """Height of a curve over the origin, and its variance for noise of one."""
    along = offset @ (tangent - (tangent @ normal) * normal)
    scale = float(np.abs(along).max())
    order = np.argsort(np.abs(along))
    # Farther than half of the longer arm the shape of the surface counts.
    near = order[: max(LEAST_POINTS, int((np.abs(along) <= 0.5 * scale).sum()))]
    design = (along[near, None] / scale) ** np.arange(4.0)
    inverse = np.linalg.pinv(design.T @ design)
    coefficients = inverse @ (design.T @ (offset[near] @ normal))
    return float(coefficients[0]), float(inverse[0, 0])


def check_order(name: str, points, noise: float) -> None:
    """Refuse points (n, 3) that are not in order of travel.

    Raises
    ------
    ValueError
        When they are shuffled, or neighbours are swapped; or some are far off their neighbours.
    """
    if out_of_order(points):
        raise ValueError(f"curve {name!r} {disorder(points)}")
    step = np.diff(points, axis=0)
    length = np.sqrt((step * step).sum(axis=1))
    cosine = (step[1:] * step[:-1]).sum(axis=1) / np.maximum(length[1:] * length[:-1], 1e-300)
    # A turn of more than 120 degrees, between steps that noise does not explain.
    back = (cosine < -0.5) & (np.minimum(length[1:], length[:-1]) > 6.0 * noise)
    # A jump back to the contact turns once, a bad contact is off to the side.
    swapped = np.flatnonzero(back[1:] & back[:-1])
    if len(swapped):
        raise ValueError(
            f"curve {name!r} goes to and fro at its points {swapped[0] + 2} and {swapped[0] + 3}; "
            "give all in order of travel"
        )
