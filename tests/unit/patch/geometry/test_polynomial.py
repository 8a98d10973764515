"""Polynomials against finite differences and closed forms of differential geometry."""

import numpy as np
import pytest

from touchatlas.patch.geometry.curvature import principal_directions
from touchatlas.patch.geometry.polynomial import (
    VALUE,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    LocalPolynomial,
    X,
    Y,
    Z,
    evaluate,
    gaussian_curvature,
    graded_basis,
    monge_basis,
    monomials,
    shape_operator,
)


@pytest.mark.parametrize("degree", [2, 4, 6])
@pytest.mark.parametrize("make", [monge_basis, graded_basis])
def test_derivatives_match_finite_differences(degree, make):
    rng = np.random.default_rng(degree)
    basis = make(degree)
    c = rng.normal(size=basis.size)
    x, y, z = rng.uniform(-1, 1, size=(3, 50))
    h = 1e-4

    def f(dx, dy, dz=0.0):
        return evaluate(basis, c, x + dx, y + dy, z + dz)[0]

    got = evaluate(basis, c, x, y, z, (X, Y, XX, XY, YY, Z, XZ, YZ, ZZ))
    want = [
        (f(h, 0) - f(-h, 0)) / (2 * h),
        (f(0, h) - f(0, -h)) / (2 * h),
        (f(h, 0) - 2 * f(0, 0) + f(-h, 0)) / h**2,
        (f(h, h) - f(h, -h) - f(-h, h) + f(-h, -h)) / (4 * h * h),
        (f(0, h) - 2 * f(0, 0) + f(0, -h)) / h**2,
        (f(0, 0, h) - f(0, 0, -h)) / (2 * h),
        (f(h, 0, h) - f(h, 0, -h) - f(-h, 0, h) + f(-h, 0, -h)) / (4 * h * h),
        (f(0, h, h) - f(0, h, -h) - f(0, -h, h) + f(0, -h, -h)) / (4 * h * h),
        (f(0, 0, h) - 2 * f(0, 0) + f(0, 0, -h)) / h**2,
    ]
    # Central differences: h^2 times a fourth derivative, plus rounding eps/h^2.
    assert got == pytest.approx(np.array(want), abs=2e-5 * degree**4 / 16)


def test_monomials_are_the_powers_they_claim():
    basis = monge_basis(5)
    x, y = np.array([0.7, -1.3]), np.array([2.0, 0.4])
    i, j = basis.exponents[:, 0, None], basis.exponents[:, 1, None]
    assert monomials(basis, x, y, 0.0 * x) == pytest.approx(x**i * y**j, rel=1e-14)


@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
def test_graded_monomials_are_the_powers_they_claim_with_z_last(degree):
    basis = graded_basis(degree)
    x, y, z = np.random.default_rng(degree).normal(size=(3, 7))
    i, j, k = basis.exponents.T[:, :, None]
    got = monomials(basis, x, y, z)
    assert got[: basis.size] == pytest.approx(x**i * y**j * z**k, rel=1e-13)
    assert (i + j + 2 * k <= degree).all() and not basis.exponents.tolist().count([0, 0, 1])
    if basis.has_z:
        assert (got[-1] == z).all()


def test_quadric_is_exact_in_the_graded_basis():
    """A ball: z = -(x^2 + y^2 + z^2)/(2 r), its height, slopes and curvature from the terms."""
    r, basis = 2.0, graded_basis(4)
    c = np.zeros(basis.size)
    for exponents in ([2, 0, 0], [0, 2, 0], [0, 0, 2]):
        c[basis.exponents.tolist().index(exponents)] = -0.5 / r
    polynomial = LocalPolynomial(basis, c, 1.0)
    xy = np.random.default_rng(1).uniform(-1.2, 1.2, size=(20, 2))
    z = np.sqrt(r * r - (xy**2).sum(axis=1)) - r
    # Newton's method ends at 1e-9.
    assert polynomial.height(xy) == pytest.approx(z, abs=1e-8)
    assert polynomial.gradient(xy) == pytest.approx(-xy / (z + r)[:, None], abs=1e-7)
    zxx, zxy, zyy = polynomial.hessian(xy).T
    fx, fy = polynomial.gradient(xy).T
    assert gaussian_curvature(fx, fy, zxx, zxy, zyy) == pytest.approx(np.full(20, 0.25), abs=1e-6)


def test_height_beyond_the_surface_is_nan():
    basis = graded_basis(4)
    c = np.zeros(basis.size)
    for exponents in ([2, 0, 0], [0, 2, 0], [0, 0, 2]):
        c[basis.exponents.tolist().index(exponents)] = -0.25
    heights = LocalPolynomial(basis, c, 1.0).height(np.array([[0.0, 0.0], [3.0, 0.0]]))
    assert heights[0] == 0.0 and np.isnan(heights[1])


def test_shape_operator_of_a_ball_is_umbilic_everywhere():
    """Upward normal of the upper half ball: both curvatures are -1/r at every point."""
    r, x, y = 2.0, np.array([0.0, 0.5, 1.1]), np.array([0.0, -0.3, 0.9])
    z = np.sqrt(r * r - x * x - y * y)
    fx, fy = -x / z, -y / z
    fxx, fxy, fyy = -(z * z + x * x) / z**3, -x * y / z**3, -(z * z + y * y) / z**3
    shapes = shape_operator(fx, fy, fxx, fxy, fyy)
    assert shapes == pytest.approx(np.broadcast_to(-np.eye(2) / r, (3, 2, 2)), abs=1e-14)
    assert gaussian_curvature(fx, fy, fxx, fxy, fyy) == pytest.approx(np.full(3, 0.25))


def test_gaussian_curvature_is_the_determinant_of_the_shape_operator():
    rng = np.random.default_rng(7)
    derivatives = rng.normal(size=(5, 40))
    assert np.linalg.det(shape_operator(*derivatives)) == pytest.approx(
        gaussian_curvature(*derivatives), rel=1e-10
    )


def test_unscaled_coefficients_give_the_same_height():
    basis = monge_basis(4)
    rng = np.random.default_rng(8)
    polynomial = LocalPolynomial(basis, rng.normal(size=15), 20.0)
    xy = rng.uniform(-15, 15, size=(30, 2))
    i, j, _ = basis.exponents.T
    direct = (polynomial.unscaled() * xy[:, :1] ** i * xy[:, 1:] ** j).sum(axis=1)
    assert polynomial.height(xy) == pytest.approx(direct, rel=1e-11)


def test_hessian_at_the_origin_holds_the_principal_curvatures():
    basis = monge_basis(2)
    polynomial = LocalPolynomial(basis, np.array([0, 0, 0, 0.3, 0.0, -0.2]), 10.0)
    zxx, zxy, zyy = polynomial.hessian(np.zeros((1, 2)))[0]
    k1, k2, angle = principal_directions(np.array([[zxx, zxy], [zxy, zyy]]))
    assert (k1, k2, angle) == pytest.approx((0.06, -0.04, 0.0), abs=1e-15)
    assert evaluate(basis, polynomial.coefficients, [0.5], [0.5], which=(VALUE,))[
        0
    ] == pytest.approx(0.025)
