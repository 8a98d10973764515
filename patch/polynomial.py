"""Local polynomial z = phi(x, y) in a patch's frame: monomials, derivatives, curvature.

Coefficients are kept in scaled coordinates (x/R, y/R, z/R), R the patch radius, so that they
carry no unit. Monomials come first in every array, (t, ...), and every derivative of the
polynomial is a polynomial over the same monomials.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

VALUE, X, Y, XX, XY, YY = range(6)
_DERIVATIVES = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


@dataclass(frozen=True, eq=False)
class Basis:
    """The monomials x^i y^j z^k of a local polynomial.

    Parameters
    ----------
    exponents : (t, 3) int
        Ordered by total degree; the third column is zero for a Monge polynomial.
    orders : (t,) int
        i + j + k.
    degree : int
        The highest order.
    derivatives : (6, t, t) float
        ``coefficients @ derivatives[D]`` are the coefficients of the derivative D, one of
        VALUE, X, Y, XX, XY, YY.
    """

    exponents: np.ndarray
    orders: np.ndarray
    degree: int
    derivatives: np.ndarray

    @property
    def size(self) -> int:
        """Number of monomials."""
        return len(self.orders)


@lru_cache
def monge_basis(degree: int) -> Basis:
    """All monomials x^i y^j with i + j <= degree, for a height z(x, y).

    >>> monge_basis(2).exponents[:, :2].tolist()
    [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]]
    """
    pairs = [(d - j, j) for d in range(degree + 1) for j in range(d + 1)]
    index = {pair: m for m, pair in enumerate(pairs)}
    derivatives = np.zeros((len(_DERIVATIVES), len(pairs), len(pairs)))
    for d, (p, q) in enumerate(_DERIVATIVES):
        for m, (i, j) in enumerate(pairs):
            if i >= p and j >= q:
                derivatives[d, m, index[i - p, j - q]] = _falling(i, p) * _falling(j, q)
    exponents = np.array([(i, j, 0) for i, j in pairs])
    orders = exponents.sum(axis=1)
    for array in (exponents, orders, derivatives):
        array.flags.writeable = False
    return Basis(exponents, orders, degree, derivatives)


def _falling(n: int, k: int) -> int:
    """n (n-1) ... (n-k+1): what k derivatives leave before x^(n-k)."""
    return int(np.prod(range(n - k + 1, n + 1)))


def monomials(basis: Basis, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(t, ...) monomials at scaled coordinates x, y (...).

    Order by order: the monomials of order d are x times those of order d - 1, and y times the
    last of these.
    """
    out = np.empty((basis.size, *x.shape))
    out[0] = 1.0
    low = 0
    for order in range(1, basis.degree + 1):
        high = low + order
        np.multiply(out[low:high], x, out=out[high : high + order])
        np.multiply(out[high - 1], y, out=out[high + order])
        low = high
    return out


def derivative_coefficients(basis: Basis, coefficients: np.ndarray, which) -> np.ndarray:
    """(..., len(which), t) coefficients of the derivatives ``which`` of polynomials (..., t)."""
    stacked = basis.derivatives[which].transpose(1, 0, 2).reshape(basis.size, -1)
    return (coefficients @ stacked).reshape(*coefficients.shape[:-1], len(which), basis.size)


def evaluate(basis: Basis, coefficients: np.ndarray, x, y, which=(VALUE,)) -> np.ndarray:
    """(len(which), n) derivatives of one polynomial at n scaled points.

    >>> evaluate(monge_basis(2), np.array([0, 0, 0, 1, 0, 0.5]), np.array([2.0]), np.array([2.0]))
    array([[6.]])
    """
    terms = monomials(basis, np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    return derivative_coefficients(basis, coefficients, list(which)) @ terms


def shape_operator(fx, fy, fxx, fxy, fyy) -> np.ndarray:
    """(..., 2, 2) shape operator of the graph z = f(x, y), upward normal, in the x, y basis.

    Positive where the graph bends upward. I^-1 II with E = 1 + fx^2, F = fx fy, G = 1 + fy^2:
    do Carmo, section 3-3, example 5.
    """
    e, f, g = 1.0 + fx * fx, fx * fy, 1.0 + fy * fy
    determinant = e * g - f * f
    scale = determinant**-1.5
    return np.stack(
        [
            np.stack([(g * fxx - f * fxy) * scale, (g * fxy - f * fyy) * scale], axis=-1),
            np.stack([(e * fxy - f * fxx) * scale, (e * fyy - f * fxy) * scale], axis=-1),
        ],
        axis=-2,
    )


def gaussian_curvature(fx, fy, fxx, fxy, fyy):
    """Gaussian curvature K = (fxx fyy - fxy^2) / (1 + fx^2 + fy^2)^2 of a graph.

    do Carmo, section 3-3, example 5; units 1/length^2 of the coordinates given.
    """
    return (fxx * fyy - fxy * fxy) / (1.0 + fx * fx + fy * fy) ** 2


@dataclass(frozen=True, eq=False)
class LocalPolynomial:
    """Polynomial z/R = sum c x^i y^j z^k over scaled coordinates.

    Parameters
    ----------
    basis : Basis
    coefficients : (t,) float, no unit
    scale : float, length
        R: the patch radius.
    """

    basis: Basis
    coefficients: np.ndarray
    scale: float

    def height(self, xy_local) -> np.ndarray:
        """(n,) height over local points (n, 2), length."""
        return self.scale * self._derivatives(xy_local, [VALUE])[0]

    def gradient(self, xy_local) -> np.ndarray:
        """(n, 2) slopes dz/dx, dz/dy at local points (n, 2)."""
        return self._derivatives(xy_local, [X, Y]).T

    def hessian(self, xy_local) -> np.ndarray:
        """(n, 3) second derivatives zxx, zxy, zyy at local points (n, 2), 1/length."""
        return self._derivatives(xy_local, [XX, XY, YY]).T / self.scale

    def unscaled(self) -> np.ndarray:
        """(t,) coefficients of z = sum c x^i y^j z^k in unscaled coordinates."""
        return self.coefficients * self.scale ** (1.0 - self.basis.orders)

    def _derivatives(self, xy_local, which) -> np.ndarray:
        x, y = np.asarray(xy_local, dtype=float).T[:2] / self.scale
        return evaluate(self.basis, self.coefficients, x, y, which)


def evaluate_batch(basis: Basis, coefficients, terms, which=(VALUE,)) -> np.ndarray:
    """(len(which), m, n) derivatives of m polynomials (m, t) from their monomials (t, m, n)."""
    rows = derivative_coefficients(basis, coefficients, list(which))
    return (rows @ terms.transpose(1, 0, 2)).transpose(1, 0, 2)
