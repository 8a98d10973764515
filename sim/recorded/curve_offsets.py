"""Do recorded curves lie on one surface: how far apart they pass over their common point."""

import numpy as np
from scipy.stats import chi2, norm, t

from touchatlas.atlas.records.order_of_points import out_of_order
from touchatlas.patch.geometry.curvature import normal_from_tangents
from touchatlas.sim.recorded.contour_file import LEAST_POINTS
from touchatlas.sim.recorded.reference_point import foot, meeting_point

# Fraction of a curve's longer arm within which its height over the common point is fitted by a
# cubic. Doubled, the shape of the surface counts as an offset.
_NEAR = 0.5
# Probability of calling curves displaced that are not. Doubled, one in 500 good files is flagged.
_ERROR = 1e-3
# Least offset that counts, as a fraction of the longest curve: what a cubic leaves of the shape.
# Doubled, smaller displacements pass.
_LEAST = 5e-4
# Probability beyond either side of an interval of 95 %. Doubled, intervals hold 90 %.
_TAIL = 0.025
# A step turns back if its cosine with the one before is below this, 120 degrees, and if both are
# longer than this number of deviations. Doubled, swapped neighbours of short steps pass.
_BACK, _SURE = -0.5, 6.0


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
    limit = max(chi2.isf(_ERROR, freedom) * variance, freedom * (_LEAST * reach) ** 2)
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
    return float(np.sqrt(variance) * t.isf(_TAIL, freedom) / norm.isf(_TAIL))


def _height(offset, tangent, normal) -> tuple[float, float]:
    """Height of a curve over the origin, and its variance for noise of one."""
    along = offset @ (tangent - (tangent @ normal) * normal)
    scale = float(np.abs(along).max())
    order = np.argsort(np.abs(along))
    near = order[: max(LEAST_POINTS, int((np.abs(along) <= _NEAR * scale).sum()))]
    design = (along[near, None] / scale) ** np.arange(4.0)
    inverse = np.linalg.pinv(design.T @ design)
    coefficients = inverse @ (design.T @ (offset[near] @ normal))
    return float(coefficients[0]), float(inverse[0, 0])


def check_order(name: str, points, noise: float) -> None:
    """Refuse points (n, 3) that are not in order of travel.

    Raises
    ------
    ValueError
        When they are shuffled, or neighbours are swapped.
    """
    if out_of_order(points):
        raise ValueError(
            f"the points of curve {name!r} are in no order of travel; sort them along the curve, "
            "or leave its name empty, which makes them scattered contacts"
        )
    step = np.diff(points, axis=0)
    length = np.sqrt((step * step).sum(axis=1))
    cosine = (step[1:] * step[:-1]).sum(axis=1) / np.maximum(length[1:] * length[:-1], 1e-300)
    back = (cosine < _BACK) & (np.minimum(length[1:], length[:-1]) > _SURE * noise)
    # A jump back to the contact turns once, a bad contact is off to the side.
    swapped = np.flatnonzero(back[1:] & back[:-1])
    if len(swapped):
        raise ValueError(
            f"curve {name!r} goes to and fro at its points {swapped[0] + 2} and {swapped[0] + 3}; "
            "give all in order of travel"
        )
