"""Waves of a polynomial: their coefficients, and what one phase tells of the other."""

import numpy as np
import pytest

from touchatlas.patch.fit.averaging import phase_excess, waves
from touchatlas.patch.fit.smoothness import coefficient_precision
from touchatlas.patch.geometry.polynomial import graded_basis, monomials

BASIS = graded_basis(4)
# Orders and wave numbers of the waves of a quartic, cosine and sine each.
WAVES = ((3, 3), (3, 1), (4, 4), (4, 2))
# Place of r^3 cos 3a among them.
COSINE, SINE = 0, 1
PRIOR = 1.0 / coefficient_precision(BASIS, 0.5, 0.02)


def test_waves_are_those_of_polar_coordinates():
    """Second route: r^m cos(l a) and r^m sin(l a) themselves."""
    r, a = np.meshgrid([0.3, 1.0], np.linspace(0.0, 6.0, 9))
    terms = monomials(BASIS, (r * np.cos(a)).ravel(), (r * np.sin(a)).ravel(), np.zeros(r.size))
    found = waves(BASIS)[0].T @ terms[: BASIS.size]
    true = [r**m * trig(number * a) for m, number in WAVES for trig in (np.cos, np.sin)]
    assert found == pytest.approx(np.reshape(true, found.shape), abs=1e-14)


def test_amplitudes_are_those_of_the_waves():
    columns, rows = waves(BASIS)
    assert rows @ columns == pytest.approx(np.eye(columns.shape[1]), abs=1e-14)


def excess(amplitude: float, seen: float) -> np.ndarray:
    """Variance (w,) that is added to each wave where r^3 cos 3a has an amplitude in its prior
    deviations, and a fraction of it is seen."""
    columns, rows = waves(BASIS)
    std = np.sqrt(rows**2 @ PRIOR)
    known = np.diag(PRIOR)
    direction = known @ rows[COSINE] / std[COSINE]
    known -= seen * np.outer(direction, direction)
    added = phase_excess(BASIS, columns[:, COSINE] * amplitude * std[COSINE], known, PRIOR, PRIOR)
    return ((rows @ added) ** 2).sum(axis=1) / std**2


def test_a_large_phase_widens_the_unseen_one_as_student_s_t():
    """Two degrees of freedom before, one phase seen: Student's t with three, whose 97.5 % quantile
    is 3.182, and the scale (2 + 25)/3 for q = 25; less the one that is there."""
    variance = (3.182 / 1.960) ** 2 * (2.0 + 25.0) / 3.0
    assert excess(5.0, 1.0)[SINE] == pytest.approx(variance - 1.0, rel=1e-3)


def test_nothing_seen_leaves_the_interval_of_student_s_t_with_two_degrees():
    """Its 97.5 % quantile is 0.95/sqrt(2 * 0.975 * 0.025) = 4.303."""
    variance = (4.303 / 1.960) ** 2
    assert excess(0.0, 0.0) == pytest.approx(np.full(8, variance - 1.0), rel=1e-3)


def test_nothing_becomes_narrower():
    assert (excess(0.0, 1.0) >= 0.0).all()
