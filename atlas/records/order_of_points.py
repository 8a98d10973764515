"""Whether the points of a curve are in order of travel."""

import numpy as np

# Ratio of von Neumann above which points are out of order, and its addition for each of few points.
# In random order the ratio is 2 in the mean; in order it is 12 / n^2, and 3 / n more with one jump
# back to the middle. Doubled, only random orders are refused.
_MOST, _FEW = 0.5, 4.0


def von_neumann_ratio(points) -> float:
    """Sum of squared successive differences over that of squared deviations from the mean.

    It is small for points (n, 3) along a curve, and about 2 for the same points in random order
    (von Neumann, Distribution of the ratio of the mean square successive difference to the
    variance, 1941). 0 for points that are all the same.

    >>> line = np.arange(10.0)[:, None] * [1.0, 0.0, 0.0]
    >>> round(von_neumann_ratio(line), 3), round(von_neumann_ratio(line[[0, 5, 1, 6, 2, 7]]), 3)
    (0.109, 2.578)
    """
    points = np.asarray(points, float)
    offset = points - points.mean(axis=0)
    spread = float((offset * offset).sum())
    step = np.diff(points, axis=0)
    return float((step * step).sum()) / spread if spread > 0.0 else 0.0


def out_of_order(points) -> bool:
    """Whether points (n, 3) are in no order of travel along a curve."""
    return von_neumann_ratio(points) > _MOST + _FEW / len(points)
