"""Patches in words."""

import numpy as np

from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import LocalPolynomial, graded_basis


def test_a_patch_is_printed_in_one_line():
    frame = DarbouxFrame(np.array([1.0, 2.0, 3.0]), np.eye(3))
    basis = graded_basis(4)
    polynomial = LocalPolynomial(basis, np.zeros(basis.size), 5.0)
    patch = Patch(7, frame, polynomial, np.eye(basis.size), 5.0, 0.75, 0.1, 0.1, 99, 1.5)
    assert repr(patch) == "Patch(7 at (1, 2, 3), k1=0, k2=0, radius=5)"
