"""Local polynomial z = phi(x, y, z) in a patch's frame: monomials, derivatives, curvature.

With terms in x and y alone it is a height over the tangent plane (a Monge patch). Terms with z
let the surface tilt further than a height can: it is the zero set of F = z - phi, and a quadric is
exact. Coefficients are kept in scaled coordinates (x/R, y/R, z/R) with the patch radius R, so they
have no unit. In every array the monomials are the first axis, (t, ...).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from touchatlas.patch.geometry.arrays import frozen_array

# Orders of d/dx, d/dy and d/dz.
_DERIVATIVES = (
    (0, 0, 0),
    (1, 0, 0),
    (0, 1, 0),
    (2, 0, 0),
    (1, 1, 0),
    (0, 2, 0),
    (0, 0, 1),
    (1, 0, 1),
    (0, 1, 1),
    (0, 0, 2),
)
VALUE, X, Y, XX, XY, YY, Z, XZ, YZ, ZZ = range(len(_DERIVATIVES))
GRADIENT = (VALUE, X, Y, Z)
SECOND_ORDER = (X, Y, XX, XY, YY, Z, XZ, YZ, ZZ)


@dataclass(frozen=True, eq=False)
class Basis:
    """The monomials x^i y^j z^k of a local polynomial.

    Parameters
    ----------
    exponents : (t, 3) int
        Sorted by k, then by order. The third column is zero for a Monge polynomial.
    orders : (t,) int
        i + j + k.
    degree : int
        The highest i + j + 2k: the order of the height z(x, y) that the polynomial defines.
    derivatives : (10, t, s) float
        ``coefficients @ derivatives[D]`` are the coefficients of the derivative D, one of
        VALUE, X, Y, XX, XY, YY, Z, XZ, YZ, ZZ. They belong to the s monomials of
        ``monomials``: the t of the polynomial and, if it has terms in z, z itself.
    """

    exponents: np.ndarray
    orders: np.ndarray
    degree: int
    derivatives: np.ndarray

    @cached_property
    def at_origin(self) -> np.ndarray:
        """(t, 10) matrix: ``coefficients @ at_origin`` are VALUE and SECOND_ORDER at zero."""
        return np.ascontiguousarray(self.derivatives[[VALUE, *SECOND_ORDER], :, 0].T)

    @cached_property
    def sources(self) -> tuple[np.ndarray, np.ndarray]:
        """Index (10, s) and factor (10, s) of the coefficient that each coefficient of a derivative
        comes from. There is only one, because the derivative of a monomial is a monomial."""
        return np.abs(self.derivatives).argmax(axis=1), self.derivatives.sum(axis=1)

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.orders)

    @property
    def has_z(self) -> bool:
        """Whether there are terms in z."""
        return self.derivatives.shape[1] != self.derivatives.shape[2]


@lru_cache
def monge_basis(degree: int) -> Basis:
    """All monomials x^i y^j with i + j <= degree, for a height z(x, y).

    >>> monge_basis(2).exponents[:, :2].tolist()
    [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]]
    """
    return _basis([(d - j, j, 0) for d in range(degree + 1) for j in range(d + 1)], degree)


@lru_cache
def graded_basis(degree: int) -> Basis:
    """All monomials x^i y^j z^k with i + j + 2k <= degree, except z itself.

    z counts twice because a patch rises with the square of x and y. To leading order a term in z
    repeats terms without z; beyond, it lets the surface tilt further. Every quadric has degree 4.

    >>> graded_basis(4).exponents[15:].tolist()
    [[1, 0, 1], [0, 1, 1], [2, 0, 1], [1, 1, 1], [0, 2, 1], [0, 0, 2]]
    """
    terms = [
        (d - j, j, k)
        for k in range(degree // 2 + 1)
        for d in range(degree - 2 * k + 1)
        for j in range(d + 1)
    ]
    terms.remove((0, 0, 1))
    return _basis(terms, degree)


def _basis(terms: list[tuple[int, int, int]], degree: int) -> Basis:
    across = terms + [(0, 0, 1)] if any(k for *_, k in terms) else terms
    index = {term: m for m, term in enumerate(across)}
    derivatives = np.zeros((len(_DERIVATIVES), len(terms), len(across)))
    for d, (p, q, r) in enumerate(_DERIVATIVES):
        for m, (i, j, k) in enumerate(terms):
            if i >= p and j >= q and k >= r:
                factor = _falling(i, p) * _falling(j, q) * _falling(k, r)
                derivatives[d, m, index[i - p, j - q, k - r]] = factor
    exponents = np.array(terms)
    orders = exponents.sum(axis=1)
    for array in (exponents, orders, derivatives):
        array.flags.writeable = False
    return Basis(exponents, orders, degree, derivatives)


def _falling(n: int, k: int) -> int:
    """Falling factorial n (n-1) ... (n-k+1): the factor of x^(n-k) after k derivatives of x^n."""
    return int(np.prod(range(n - k + 1, n + 1)))


def monomials(basis: Basis, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(s, ...) monomials at scaled coordinates x, y, z (...). z itself is last, if there are terms
    in z.

    They are built order by order. Those of order d are x times all of order d - 1, and y times the
    last of these.
    """
    out = np.empty((basis.derivatives.shape[2], *x.shape))
    out[0] = 1.0
    low = 0
    for order in range(1, basis.degree + 1):
        high = low + order
        np.multiply(out[low:high], x, out=out[high : high + order])
        np.multiply(out[high - 1], y, out=out[high + order])
        low = high
    if basis.has_z:
        out[-1] = power = z
        here = low + basis.degree + 1
        for k in range(1, basis.degree // 2 + 1):
            flat = basis.degree - 2 * k
            first, last = k == 1, (flat + 1) * (flat + 2) // 2
            np.multiply(out[first:last], power, out=out[here : here + last - first])
            here += last - first
            power = power * z
    return out


def derivative_coefficients(basis: Basis, coefficients: np.ndarray, which) -> np.ndarray:
    """(..., len(which), s) coefficients of the derivatives ``which`` of polynomials (..., t)."""
    source, factor = basis.sources
    # np.take keeps each polynomial contiguous in memory, unlike indexing.
    return np.take(coefficients, source[which], axis=-1) * factor[which]


def evaluate(
    basis: Basis, coefficients: np.ndarray, x, y, z=0.0, which: Sequence[int] = (VALUE,)
) -> np.ndarray:
    """(len(which), n) derivatives of phi at n scaled points.

    >>> evaluate(monge_basis(2), np.array([0, 0, 0, 1, 0, 0.5]), np.array([2.0]), np.array([2.0]))
    array([[6.]])
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    terms = monomials(basis, x, y, np.broadcast_to(np.asarray(z, dtype=float), x.shape))
    return derivative_coefficients(basis, coefficients, list(which)) @ terms


def evaluate_batch(basis: Basis, coefficients, terms, which=(VALUE,)) -> np.ndarray:
    """(len(which), m, n) derivatives of m polynomials (m, t), each at its monomials (s, m, n)."""
    rows = derivative_coefficients(basis, coefficients, list(which))
    return (rows @ terms.transpose(1, 0, 2)).transpose(1, 0, 2)


def graph_derivatives(px, py, pxx, pxy, pyy, pz, pxz, pyz, pzz):
    """fx, fy, fxx, fxy, fyy of the height z = f(x, y) that solves z = phi(x, y, z).

    Implicit differentiation of f = phi(x, y, f), once and twice. The arguments are the derivatives
    of phi in the order of ``SECOND_ORDER``. The height is not defined where phi_z = 1: there the
    tangent plane contains the z axis.
    """
    slope_of_f = 1.0 - pz
    fx, fy = px / slope_of_f, py / slope_of_f
    fxx = (pxx + 2.0 * pxz * fx + pzz * fx * fx) / slope_of_f
    fxy = (pxy + pxz * fy + pyz * fx + pzz * fx * fy) / slope_of_f
    fyy = (pyy + 2.0 * pyz * fy + pzz * fy * fy) / slope_of_f
    return fx, fy, fxx, fxy, fyy


def shape_operator(fx, fy, fxx, fxy, fyy) -> np.ndarray:
    """(..., 2, 2) shape operator of the graph z = f(x, y), upward normal, in the x, y basis.

    It is positive where the graph curves upward. I^-1 II with E = 1 + fx^2, F = fx fy,
    G = 1 + fy^2: do Carmo, section 3-3, example 5.
    """
    e, f, g = 1.0 + fx * fx, fx * fy, 1.0 + fy * fy
    scale = (e * g - f * f) ** -1.5
    shape = np.empty((*np.shape(scale), 2, 2))
    shape[..., 0, 0] = (g * fxx - f * fxy) * scale
    shape[..., 0, 1] = (g * fxy - f * fyy) * scale
    shape[..., 1, 0] = (e * fxy - f * fxx) * scale
    shape[..., 1, 1] = (e * fyy - f * fxy) * scale
    return shape


def gaussian_curvature(fx, fy, fxx, fxy, fyy):
    """Gaussian curvature K = (fxx fyy - fxy^2) / (1 + fx^2 + fy^2)^2 of a graph.

    do Carmo, section 3-3, example 5. Its unit is 1/length^2, in the length of the coordinates.
    """
    return (fxx * fyy - fxy * fxy) / (1.0 + fx * fx + fy * fy) ** 2


@dataclass(frozen=True, eq=False)
class LocalPolynomial:
    """Polynomial z/R = sum c x^i y^j z^k in scaled coordinates.

    Its methods raise ValueError for points of another shape than (n, 2) or not finite.

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
        """(n,) height over local points (n, 2), length. NaN where the surface has no height."""
        return self.scale * scaled_height(self.basis, self.coefficients, *self._scaled(xy_local))

    def gradient(self, xy_local) -> np.ndarray:
        """(n, 2) slopes dz/dx, dz/dy at local points (n, 2)."""
        return np.stack(self._graph(xy_local)[:2], axis=1)

    def hessian(self, xy_local) -> np.ndarray:
        """(n, 3) second derivatives zxx, zxy, zyy at local points (n, 2), 1/length."""
        return np.stack(self._graph(xy_local)[2:], axis=1) / self.scale

    def unscaled(self) -> np.ndarray:
        """(t,) coefficients of z = sum c x^i y^j z^k in unscaled coordinates."""
        return self.coefficients * self.scale ** (1.0 - self.basis.orders)

    def _scaled(self, xy_local):
        return frozen_array(xy_local, (None, 2), "local points").T / self.scale

    def _graph(self, xy_local):
        x, y = self._scaled(xy_local)
        z = scaled_height(self.basis, self.coefficients, x, y)
        return graph_derivatives(*evaluate(self.basis, self.coefficients, x, y, z, SECOND_ORDER))


def scaled_height(basis: Basis, coefficients, x, y) -> np.ndarray:
    """(n,) scaled height z = phi(x, y, z) over scaled points, by Newton's method from z = 0.

    NaN where it does not converge, or converges on a side that faces down.
    """
    z = np.zeros(np.shape(x))
    rows = derivative_coefficients(basis, coefficients, [VALUE, Z])
    if not basis.has_z:
        return rows[0] @ monomials(basis, x, y, z)
    # Each step doubles the digits; the first are limited to half a radius. Where dF/dz is below
    # 0.05 the surface is within 3 degrees of the normal direction.
    for _ in range(20):
        phi, phi_z = rows @ monomials(basis, x, y, z)
        step = (z - phi) / np.maximum(1.0 - phi_z, 0.05)
        z = z - np.clip(step, -0.5, 0.5)
    return np.where((np.abs(step) < 1e-9) & (phi_z < 1.0), z, np.nan)
