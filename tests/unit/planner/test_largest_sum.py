"""The place with the largest sum about it, told by cubes, is that of all sums."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from touchatlas.planner.place.largest_sum import largest_sum_about


def places(seed: int):
    """Places (2000, 3) on two sides of a wall, with values that grow towards some of them."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (2000, 3)) * [1.0, 1.0, 0.0]
    points[::2, 2] = 0.05
    vague = rng.uniform(-1.0, 1.0, (5, 3))
    return points, np.exp(-4.0 * cdist(points, vague).min(axis=1)) * rng.uniform(0.5, 1.5, 2000)


@pytest.mark.parametrize("seed", range(5))
def test_largest_sum_is_that_of_all_sums(seed):
    points, values = places(seed)
    asked = np.flatnonzero(points[:, 0] < 0.7)
    sums = (cdist(points[asked], points) <= 0.2) @ values
    assert largest_sum_about(points, values, asked, 0.2) == asked[sums.argmax()]


def test_largest_sum_stays_where_it_is_when_lengths_are_scaled():
    points, values = places(0)
    asked = np.arange(2000)
    found = largest_sum_about(points, values, asked, 0.2)
    # A power of two scales all lengths without rounding.
    assert largest_sum_about(1024.0 * points, values, asked, 1024.0 * 0.2) == found
