"""Waves r^m cos(l a) and r^m sin(l a) of a polynomial: what one phase tells of the other."""

from functools import lru_cache

import numpy as np
from scipy.special import ndtri, stdtrit

from touchatlas.patch.geometry.polynomial import Basis

# Degrees of freedom of the variance of a wave before its phases are seen: the heaviest tail with
# which intervals on smooth random surfaces hold 92 to 98 % (tests/laws/test_patch_closed_forms.py).
# Halved, they hold 99 %, and a quarter as many patches of a torus are silently wrong. Doubled,
# unseen phases widen by a fifth less where the seen one is as large as expected.
_FREEDOM = 2.0
# The quantile that a deviation stands for: 1.96 of them hold 95 %.
_QUANTILE = 0.975


def phase_excess(basis: Basis, mean, covariance, variance, averaged) -> np.ndarray:
    """Square root (t, w) of the prior covariance that unequal waves add to a polynomial's.

    Of a wave r^m cos(l (a - b)) whose wave number l is that of the curves, these see one phase b
    and not the other. A surface has no preferred direction, so both phases have one variance. Its
    posterior, given what is seen of both, is an inverse gamma distribution, and the unseen phase
    has Student's t distribution.

    Parameters
    ----------
    basis : Basis
    mean : (t,) float
        Coefficients.
    covariance : (t, t) float
        Posterior for the prior ``variance``.
    variance : (t,) float
        Prior variances of the fit.
    averaged : (t,) float
        Prior variances averaged over all smoothnesses.

    Notes
    -----
    Student's t: Bishop, Pattern Recognition and Machine Learning, section 2.3.7. With n phases
    seen, their squares summing to q times the expected variance, it has nu + n degrees of freedom
    and (nu + q)/(nu + n) times the expected variance as its square scale. It may have no variance:
    what is given is the variance of the normal distribution with the same interval of 95 %. It is
    never taken to be less than the expected one.
    """
    columns, rows = waves(basis)
    expected = rows**2 @ averaged
    unknown = ((rows @ covariance) * rows).sum(axis=1) / (rows**2 @ variance)
    seen = _of_both(1.0 - np.minimum(unknown, 1.0))
    square = _of_both((rows @ mean) ** 2 / expected)
    freedom = _FREEDOM + seen
    widening = stdtrit(freedom, _QUANTILE) / ndtri(_QUANTILE)
    factor = widening**2 * (_FREEDOM + square) / freedom
    return columns * np.sqrt(np.maximum(factor - 1.0, 0.0) * expected)


def _of_both(values) -> np.ndarray:
    """(w,) sums over the two phases of each wave, for both."""
    return values.reshape(-1, 2).sum(axis=1).repeat(2)


@lru_cache
def waves(basis: Basis) -> tuple[np.ndarray, np.ndarray]:
    """The waves of order m >= 3 and wave number l >= 1, cosine before sine.

    Returns
    -------
    columns : (t, w) float
        Coefficients of each wave.
    rows : (w, t) float
        Amplitude of each wave in a polynomial. Terms in z have none.

    Examples
    --------
    >>> from touchatlas.patch.geometry.polynomial import monge_basis
    >>> columns, _ = waves(monge_basis(3))
    >>> columns[6:, 0].tolist()  # of x^3, x^2 y, x y^2 and y^3: the monkey saddle
    [1.0, 0.0, -3.0, 0.0]
    """
    place = {tuple(e): i for i, e in enumerate(basis.exponents.tolist())}
    columns, rows = [np.zeros((basis.size, 0))], [np.zeros((0, basis.size))]
    for m in range(3, basis.degree + 1):
        own = [place[m - k, k, 0] for k in range(m + 1)]
        parts = [_wave(m, number) for number in range(m, -1, -2)]
        every = np.array([p for z in parts for p in (z.real, z.imag)])[: m + 1].T
        count = 2 * ((m + 1) // 2)
        column, row = np.zeros((basis.size, count)), np.zeros((count, basis.size))
        column[own], row[:, own] = every[:, :count], np.linalg.inv(every)[:count]
        columns.append(column)
        rows.append(row)
    return np.concatenate(columns, axis=1), np.concatenate(rows)


def _wave(m: int, number: int) -> np.ndarray:
    """(m + 1,) coefficients of (x + i y)^number (x^2 + y^2)^((m - number)/2) by powers of y."""
    found = np.ones(1, complex)
    for _ in range(number):
        found = np.convolve(found, [1.0, 1.0j])
    for _ in range((m - number) // 2):
        found = np.convolve(found, [1.0, 0.0, 1.0])
    return found
