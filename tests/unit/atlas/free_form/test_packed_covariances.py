"""Packed covariances say what whole ones do, in a sixth of the memory."""

import pickle

import numpy as np
import pytest

from touchatlas.atlas.free_form.packed_covariances import PackedCovariances

SIZE = 49


def factors(count: int, spread: float) -> np.ndarray:
    """Upper triangular matrices whose rows are of sizes from 1 to a spread."""
    rows = np.geomspace(1.0, spread, SIZE)[:, None]
    return np.triu(np.random.default_rng(0).normal(size=(count, SIZE, SIZE))) * rows


@pytest.mark.parametrize("spread", [1.0, 1e-6])
def test_variances_are_those_of_the_whole_matrices(spread):
    """A number is off by half a unit of 1/32767 of the largest of its row, some 1.5e-5 of it. The
    errors of 49 numbers add up by chance to a ten-thousandth of the row."""
    upper, terms = factors(5, spread), np.random.default_rng(1).normal(size=(5, SIZE, 7))
    whole = upper.transpose(0, 2, 1) @ upper
    packed, every = PackedCovariances(upper), np.arange(5)
    expected = np.einsum("gsn,gst,gtn->gn", terms, whole, terms)
    assert packed.variances(every, terms) == pytest.approx(expected, rel=1e-3)
    for k in every.tolist():
        assert packed.covariance(k) == pytest.approx(whole[k], abs=1e-3 * np.abs(whole[k]).max())
    # Any of them, in any order.
    some = np.array([3, 0])
    assert packed.variances(some, terms[some]) == pytest.approx(expected[some], rel=1e-3)


def test_they_take_a_sixth_of_the_memory():
    upper = factors(100, 1.0)
    assert len(pickle.dumps(PackedCovariances(upper))) < upper.nbytes / 6


def test_open_coefficients_do_not_hide_those_that_are_known():
    """Those of the last columns are ten million times as uncertain: whole numbers of a row alone
    would round what the first ones say to nothing."""
    upper = factors(3, 1.0) * np.geomspace(1e-7, 1.0, SIZE)
    first = np.zeros((3, SIZE, 1))
    first[:, 0] = 1.0
    found = PackedCovariances(upper).variances(np.arange(3), first)
    assert found[:, 0] == pytest.approx(upper[:, 0, 0] ** 2, rel=1e-3)


def test_a_covariance_of_zero_has_variances_of_zero():
    packed = PackedCovariances(np.zeros((1, 3, 3)))
    assert packed.variances(np.array([0]), np.ones((1, 3, 2))).tolist() == [[0.0, 0.0]]
