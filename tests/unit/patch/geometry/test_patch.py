"""Outlines of patches."""

import numpy as np

from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch, outlines
from touchatlas.patch.geometry.polynomial import LocalPolynomial, graded_basis


def test_a_patch_is_printed_in_one_line():
    frame = DarbouxFrame(np.array([1.0, 2.0, 3.0]), np.eye(3))
    basis = graded_basis(4)
    polynomial = LocalPolynomial(basis, np.zeros(basis.size), 5.0)
    patch = Patch(7, frame, polynomial, np.eye(basis.size), 5.0, 0.75, 0.1, 0.1, 99, 1.5)
    assert repr(patch) == "Patch(7 at (1, 2, 3), k1=0, k2=0, radius=5)"


def test_the_outline_of_a_polynomial_that_folds_stays_at_its_distance():
    basis = graded_basis(4)
    scaled = outlines(basis, np.full((1, basis.size), 50.0), 0.75)[0]
    assert np.abs(scaled).max() <= 0.75
