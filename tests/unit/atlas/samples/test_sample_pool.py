"""The pool of samples: what is asked of all of them, without looking at all of them."""

import numpy as np
import pytest

from touchatlas.atlas.samples.sample_pool import SamplePool


@pytest.mark.parametrize("counts", [(1,), (300, 1, 40, 500), (5, 0, 2000, 3)])
def test_the_nearest_sample_and_the_extent_are_those_of_all(counts):
    """As samples arrive, a tree holds some of them, and the others are looked at one by one."""
    rng, pool = np.random.default_rng(0), SamplePool()
    for count in counts:
        points = rng.normal(size=(count, 3))
        pool.add(points, points, points, np.zeros(count, bool), 0.0)
        for point in rng.normal(size=(20, 3)):
            square = ((pool.points - point) ** 2).sum(axis=1)
            assert pool.nearest(point) == square.argmin()
        assert pool.extent == pytest.approx(np.linalg.norm(np.ptp(pool.points, axis=0)), rel=1e-12)


def test_a_pool_without_samples_has_no_extent():
    assert SamplePool().extent == 0.0


def test_of_equal_samples_the_first_is_the_nearest_while_the_other_is_new():
    pool, points = SamplePool(), np.arange(900.0).reshape(300, 3)
    pool.add(points, points, points, np.zeros(300, bool), 0.0)
    assert pool.nearest(points[7]) == 7
    pool.add(points[7:8], points[7:8], points[7:8], np.zeros(1, bool), 0.0)
    assert pool.nearest(points[7]) == 7
