"""The order of points along a curve: whether they have one, and which of them are bad contacts."""

import numpy as np
from scipy.spatial import cKDTree


def out_of_order(points) -> bool:
    """Whether points (n, 3) are in no order of travel along a curve.

    The sum of squared successive differences over that of squared deviations from the mean is
    about 2 in random order (von Neumann, Distribution of the ratio of the mean square successive
    difference to the variance, 1941), 12 / n^2 along a curve, and 3 / n more with one jump back to
    the middle.

    >>> line = np.arange(10.0)[:, None] * [1.0, 0.0, 0.0]
    >>> out_of_order(line), out_of_order(line[[0, 5, 1, 6, 2, 7]])
    (False, True)
    """
    points = np.asarray(points, float)
    if len(points) < 2:
        return False
    offset = points - points.mean(axis=0)
    spread = float((offset * offset).sum())
    step = np.diff(points, axis=0)
    ratio = float((step * step).sum()) / spread if spread > 0.0 else 0.0
    return ratio > 0.5 + 4.0 / len(points)


def fills_area(points) -> bool:
    """Whether points (n, 3) lie all over an area, as those of a raster do, and not along a curve:
    within three median steps of a point a straight curve has seven, and these have half as many
    more in the mean.

    >>> row, column = np.meshgrid(np.arange(4.0), np.arange(4.0))
    >>> raster = np.stack([row, column, 0.0 * row], axis=2)
    >>> raster[1::2] = raster[1::2, ::-1]
    >>> fills_area(raster.reshape(-1, 3)), fills_area(raster[0])
    (True, False)
    """
    points = np.asarray(points, float)
    if len(points) < 3:
        return False
    step = float(np.median(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))))
    # Rounding leaves out no point at three steps.
    near = cKDTree(points).query_ball_point(points, 3.001 * step, return_length=True)
    return bool(np.mean(near) > 1.5 * 7.0)


def far_points(points) -> np.ndarray:
    """(n,) whether points (n, 3) are far off their neighbours along a curve: by more than ten
    median steps from the median of five.

    >>> s = np.arange(9.0)[:, None] * [1.0, 0.0, 0.0]
    >>> s[4, 2] = 30.0
    >>> np.flatnonzero(far_points(s)).tolist()
    [4]
    """
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    around = np.clip(np.arange(len(points))[:, None] + np.arange(-2, 3), 0, len(points) - 1)
    away = np.sqrt(((points - np.median(points[around], axis=1)) ** 2).sum(axis=1))
    return away > 10.0 * np.median(step)


def disorder(points) -> str:
    """What is wrong with points (n, 3) that are in no order of travel, and what to do: a few of
    them are bad contacts, or they are shuffled."""
    far = far_points(points)
    if 0 < far.sum() <= 0.2 * len(points) and not out_of_order(points[~far]):
        places = [f"{i + 1}" for i in np.flatnonzero(far)]
        listed = ", ".join(places[:5]) + (" ..." if len(places) > 5 else "")
        return (
            f"has {len(places)} of {len(points)} points far off their neighbours (its points "
            f"{listed}); they look like failed contacts: leave them out, in a file also by a "
            "column valid with 0 for them"
        )
    return (
        "has its points in no order of travel; sort them along the curve, or give them as single "
        "contacts: in a file without a name of the curve, else as a Scan"
    )
