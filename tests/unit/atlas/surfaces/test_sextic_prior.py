"""The common prior of sextics has the size of their coefficients."""

import numpy as np
import pytest

from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS
from touchatlas.atlas.surfaces.sextic_fit import Equations, with_common_prior

# Standard deviation to which coefficients are measured; and of those of order three and others.
MEASURED, THIRD, OTHERS = 0.01, 0.03, 0.2
HEIGHTS = SEXTIC_BASIS.exponents @ np.array([1, 1, 2])


def measured(count: int, third: float) -> Equations:
    """What is measured of sextics whose coefficients are drawn, those of order three as large as
    that."""
    size = np.where(HEIGHTS == 3, third, OTHERS)
    drawn, errors = np.random.default_rng(0).normal(size=(2, count, SEXTIC_BASIS.size))
    information = np.tile(np.eye(SEXTIC_BASIS.size) / MEASURED**2, (count, 1, 1))
    return Equations(information, (size * drawn + MEASURED * errors) / MEASURED**2)


def covariances_of(factors) -> np.ndarray:
    return factors.transpose(0, 2, 1) @ factors


def test_coefficients_shrink_by_their_common_size():
    """The mean square of 1400 of them is known to a thirtieth, and the factor, of which a tenth is
    left, to four thousandths; two deviations are allowed, and as much for the end of the rounds."""
    equations = measured(200, THIRD)
    shrunk = with_common_prior(equations, MEASURED)[0][:, HEIGHTS == 3]
    raw = equations.right[:, HEIGHTS == 3] * MEASURED**2
    # The posterior mean of a normal prior: v / (v + noise^2) of the measurement.
    expected = THIRD**2 / (THIRD**2 + MEASURED**2)
    assert (shrunk * raw).sum() / (raw * raw).sum() == pytest.approx(expected, rel=0.015)


def test_coefficients_that_are_zero_are_told_to_be():
    """Their posterior deviation is far below that of the measurement."""
    coefficients, factors = with_common_prior(measured(100, 0.0), MEASURED)
    covariances, own = covariances_of(factors), np.flatnonzero(HEIGHTS == 3)
    assert np.abs(coefficients[:, own]).max() < 0.5 * MEASURED
    assert covariances[:, own, own].max() < 0.25 * MEASURED**2


def test_a_sextic_without_samples_has_the_size_of_the_others():
    equations = measured(100, THIRD)
    equations.information[0], equations.right[0] = 0.0, 0.0
    coefficients, factors = with_common_prior(equations, MEASURED)
    covariances, own = covariances_of(factors), np.flatnonzero(HEIGHTS == 3)
    assert coefficients[0] == pytest.approx(0.0, abs=1e-12)
    assert np.sqrt(covariances[0, own, own]) == pytest.approx(THIRD, rel=0.1)


def test_one_sextic_has_a_prior():
    coefficients, factors = with_common_prior(measured(1, THIRD), 0.0)
    assert np.isfinite(coefficients).all()
    assert (np.linalg.eigvalsh(covariances_of(factors)[0]) > 0.0).all()


def test_factors_are_those_of_the_inverse_of_samples_and_prior_together():
    """Without a size to learn, because samples say all: the covariance is the inverse information,
    and the factor is upper triangular."""
    equations = measured(100, OTHERS)
    _, factors = with_common_prior(equations, MEASURED)
    assert np.abs(np.tril(factors, -1)).max() < 1e-15
    # A prior of a twentieth of the deviation takes a 400th off.
    inverse = np.linalg.inv(equations.information)
    off = np.abs(covariances_of(factors) - inverse)
    assert (off <= np.maximum(5e-3 * np.abs(inverse), 1e-12)).all()
