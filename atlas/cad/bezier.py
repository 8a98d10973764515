"""Polynomials in Bernstein form: Bezier curves and tensor surfaces through Chebyshev points.

A polynomial of degree d in t on [0, 1] is sum p_m B_m(t), B_m(t) = C(d, m) t^m (1 - t)^(d - m). The
p_m are its poles, which CAD systems store. The interpolant through d + 1 Chebyshev points misses a
smooth function by an error that falls geometrically with d (Trefethen, Approximation Theory and
Approximation Practice, chapter 8). A polynomial of degree d is reproduced exactly.
"""

from functools import lru_cache
from math import comb

import numpy as np

from touchatlas.patch.geometry.polynomial import LocalPolynomial

# Largest degree of a height. The change to poles loses some 0.4 digits a degree; doubled, half of
# the digits are lost and CAD systems take longer.
_LARGEST_DEGREE = 14


@lru_cache
def chebyshev_points(degree: int) -> np.ndarray:
    """(degree + 1,) Chebyshev points of the second kind on [0, 1], ascending, ends included."""
    points = 0.5 * (1.0 - np.cos(np.pi * np.arange(degree + 1) / degree))
    points.flags.writeable = False
    return points


def bernstein(degree: int, t) -> np.ndarray:
    """(n, degree + 1) Bernstein polynomials at t (n,).

    >>> bernstein(2, [0.5])
    array([[0.25, 0.5 , 0.25]])
    """
    t = np.asarray(t, dtype=float)[:, None]
    m = np.arange(degree + 1)
    return np.array([comb(degree, k) for k in m]) * t**m * (1.0 - t) ** (degree - m)


def bernstein_slopes(degree: int, t) -> np.ndarray:
    """(n, degree + 1) derivatives of the Bernstein polynomials: d (B_{m-1} - B_m) of degree
    d - 1."""
    lower = np.pad(bernstein(degree - 1, t), ((0, 0), (1, 1)))
    return degree * (lower[:, :-1] - lower[:, 1:])


@lru_cache
def _to_poles(degree: int) -> np.ndarray:
    """(d + 1, d + 1) matrix from values at the Chebyshev points to poles."""
    return np.linalg.inv(bernstein(degree, chebyshev_points(degree)))


def curve_poles(points) -> np.ndarray:
    """(d + 1, k) poles of the Bezier curve through points (d + 1, k) at the Chebyshev points.

    The ends are kept bit for bit, so curves that share an end point share a pole.
    """
    points = np.asarray(points, dtype=float)
    poles = _to_poles(len(points) - 1) @ points
    poles[0], poles[-1] = points[0], points[-1]
    return poles


def height_poles(polynomial: LocalPolynomial, low, high, degree: int) -> np.ndarray:
    """(d + 1, d + 1) poles, x first, of a patch's height over a rectangle, length.

    Parameters
    ----------
    polynomial : LocalPolynomial
    low, high : (2,) float, length, local
        Corners of the rectangle.
    degree : int
        Degree of the tensor polynomial in x and in y. A Monge polynomial of no higher degree is
        reproduced exactly; a height with terms in z is interpolated at the Chebyshev points.

    Returns
    -------
    (d + 1, d + 1) float, length
        All NaN when the patch has no height over some point of the rectangle.

    Examples
    --------
    The poles of z = x y over the unit square are products of those of x and y:

    >>> from touchatlas.patch.geometry.polynomial import monge_basis
    >>> flat = LocalPolynomial(monge_basis(2), np.array([0, 0, 0, 0, 1.0, 0]), 1.0)
    >>> height_poles(flat, [0.0, 0.0], [1.0, 1.0], 2).round(12) + 0.0
    array([[0.  , 0.  , 0.  ],
           [0.  , 0.25, 0.5 ],
           [0.  , 0.5 , 1.  ]])
    """
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    x, y = (low + (high - low) * chebyshev_points(degree)[:, None]).T
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    height = polynomial.height(grid).reshape(degree + 1, degree + 1)
    return _to_poles(degree) @ height @ _to_poles(degree).T


def tensor_height(poles, low, high, xy_local) -> np.ndarray:
    """(n,) height of the tensor polynomial with these poles over a rectangle, at points (n, 2)."""
    u, v = ((np.asarray(xy_local) - low) / (np.asarray(high) - low)).T
    degree = len(poles) - 1
    return ((bernstein(degree, u) @ poles) * bernstein(degree, v)).sum(axis=1)


def fitting_height(polynomial: LocalPolynomial, low, high, xy_local, tolerance: float):
    """Poles of the tensor polynomial of least degree whose height is within ``tolerance``.

    Parameters
    ----------
    polynomial : LocalPolynomial
    low, high : (2,) float, length, local
        Corners of the rectangle.
    xy_local : (n, 2) float, length
        Points within the rectangle at which the heights are compared.
    tolerance : float, length

    Returns
    -------
    poles : (d + 1, d + 1) float, length
    error : float, length
        Largest difference of height at the points, above ``tolerance`` if no degree suffices.

    Raises
    ------
    ValueError
        When the patch has no height at one of the points: it stands upright there.
    """
    xy_local, wanted = np.asarray(xy_local, dtype=float), polynomial.height(xy_local)
    if np.isnan(wanted).any():
        raise ValueError(
            f"the patch stands upright at {np.isnan(wanted).sum()} of {len(wanted)} points and "
            "has no height there; keep to points nearer to its origin"
        )
    best, least = np.zeros((1, 1)), np.inf
    for degree in range(polynomial.basis.degree, _LARGEST_DEGREE + 1, 2):
        poles = height_poles(polynomial, low, high, degree)
        if np.isnan(poles).any():
            poles = _least_squares(wanted, low, high, xy_local, degree)
        error = float(np.abs(tensor_height(poles, low, high, xy_local) - wanted).max())
        if error < least:
            best, least = poles, error
        if least <= tolerance:
            break
    return best, least


def _least_squares(height, low, high, xy_local, degree: int) -> np.ndarray:
    """(d + 1, d + 1) poles of least squares for heights (n,) at points (n, 2), of least norm among
    equals (Golub and Van Loan, Matrix Computations, 5.5)."""
    u, v = ((xy_local - low) / (np.asarray(high) - low)).T
    rows = np.einsum("na,nb->nab", bernstein(degree, u), bernstein(degree, v))
    poles = np.linalg.lstsq(rows.reshape(len(u), -1), height)[0]
    return poles.reshape(degree + 1, degree + 1)
