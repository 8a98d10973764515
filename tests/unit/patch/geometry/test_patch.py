"""Outlines of patches."""

import numpy as np

from touchatlas.patch.geometry.patch import outlines
from touchatlas.patch.geometry.polynomial import graded_basis


def test_the_outline_of_a_polynomial_that_folds_stays_at_its_distance():
    basis = graded_basis(4)
    scaled = outlines(basis, np.full((1, basis.size), 50.0), 0.75)[0]
    assert np.abs(scaled).max() <= 0.75
