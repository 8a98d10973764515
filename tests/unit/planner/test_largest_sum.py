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


@pytest.mark.parametrize("scale", [3.0, 25.4, 1e-3])
def test_largest_sum_of_a_lattice_stays_where_it_is_when_lengths_are_scaled(scale):
    """No place lies on a wall of the cubes, which are as wide as two places are apart."""
    axis = 0.05 * np.arange(21)
    points = np.array([(x, y, z) for x in axis for y in axis for z in (0.0, 0.05)])
    values = 1.0 + 0.05 * points[:, 0] + np.random.default_rng(0).uniform(0.0, 0.02, len(points))
    asked = np.arange(len(points))
    found = largest_sum_about(points, values, asked, 0.29)
    assert largest_sum_about(scale * points, values, asked, scale * 0.29) == found


def test_largest_sum_stays_where_it_is_when_lengths_are_scaled():
    points, values = places(0)
    asked = np.arange(2000)
    found = largest_sum_about(points, values, asked, 0.2)
    # A power of two scales all lengths without rounding.
    assert largest_sum_about(1024.0 * points, values, asked, 1024.0 * 0.2) == found
