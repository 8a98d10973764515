"""Bad contacts are left out, good ones are not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import (
    ball_height,
    graph_contours,
)
from touchatlas.patch.fit.bad_contacts import without_bad_contacts

UP = np.array([0.0, 0.0, 1.0])


def contours_of(seed, noise=0.02, height=ball_height):
    return graph_contours(height, 15.0, 19, noise, np.random.default_rng(seed))


def with_bad_contact(contour, place, size):
    points = contour.points.copy()
    points[place, 2] += size
    return replace(contour, points=points)


@pytest.mark.parametrize("place", [0, 1, 5, 9, 18])
def test_one_bad_contact_is_left_out_wherever_it_is(place):
    """50 deviations: the last point of a degree-6 curve is foreseen to about 7."""
    bad = with_bad_contact(contours_of(1)[0], place, 50 * 0.02)
    left = without_bad_contacts(bad).points
    assert len(left) == 18
    assert not (left == bad.points[place]).all(axis=1).any()


def test_good_contacts_are_kept():
    """Five deviations, of Student's law with 11 degrees of freedom at worst: 4e-4 a sample. Of
    3,420 samples one or two may go; five would be one chance in a hundred."""
    dropped = sum(
        len(c.points) - len(without_bad_contacts(c).points)
        for seed in range(60)
        for c in contours_of(seed)
    )
    assert dropped < 5


def test_exact_curves_that_no_polynomial_holds_are_kept():
    contour = contours_of(2, 0.0, lambda x, y: 0.5 * np.sin(x / 3.0) + 0.0 * y)[0]
    assert len(without_bad_contacts(contour).points) == 19
