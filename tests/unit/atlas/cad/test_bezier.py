"""Bernstein form against the polynomials it stands for."""

import numpy as np
import pytest

from touchatlas.atlas.cad.bezier import (
    bernstein,
    bernstein_slopes,
    chebyshev_points,
    curve_poles,
    fitting_height,
    height_poles,
    tensor_height,
)
from touchatlas.patch.geometry.polynomial import LocalPolynomial, graded_basis, monge_basis


def test_bernstein_polynomials_sum_to_one_and_their_slopes_to_nothing():
    t = np.linspace(0.0, 1.0, 11)
    assert bernstein(8, t).sum(axis=1) == pytest.approx(np.ones(11), abs=1e-14)
    assert bernstein_slopes(8, t).sum(axis=1) == pytest.approx(np.zeros(11), abs=1e-12)


def test_bernstein_slopes_are_finite_differences():
    """Central differences err by h^2/6 of the third derivative, some 8^3 here."""
    t, h = np.linspace(0.1, 0.9, 7), 1e-4
    found = (bernstein(8, t + h) - bernstein(8, t - h)) / (2.0 * h)
    assert bernstein_slopes(8, t) == pytest.approx(found, abs=1e-6)


def test_curve_goes_through_its_points_and_keeps_its_ends():
    points = np.random.default_rng(0).normal(size=(9, 3))
    poles = curve_poles(points)
    assert (poles[[0, -1]] == points[[0, -1]]).all()
    assert bernstein(8, chebyshev_points(8)) @ poles == pytest.approx(points, abs=1e-12)


def test_monge_polynomial_is_its_bezier_surface():
    rng, scale = np.random.default_rng(1), 12.0
    polynomial = LocalPolynomial(monge_basis(4), rng.normal(size=15), scale)
    low, high = np.array([-3.0, 1.0]), np.array([8.0, 9.0])
    xy = rng.uniform(low, high, (50, 2))
    poles = height_poles(polynomial, low, high, 4)
    # To rounding, some hundred operations on numbers of the size of the scale.
    assert tensor_height(poles, low, high, xy) == pytest.approx(
        polynomial.height(xy), abs=1e-12 * scale
    )
    assert len(fitting_height(polynomial, low, high, xy, 1e-9 * scale)[0]) == 5


def ball(radius: float, scale: float) -> LocalPolynomial:
    """The top of a ball, exact: z = -(x^2 + y^2 + z^2) / (2 r)."""
    basis = graded_basis(4)
    coefficients = np.zeros(basis.size)
    for m, term in enumerate(basis.exponents.tolist()):
        if sorted(term) == [0, 0, 2]:
            coefficients[m] = -0.5 * scale / radius
    return LocalPolynomial(basis, coefficients, scale)


def test_height_with_terms_in_z_is_held_to_what_was_asked():
    """Against the ball's own height, a square root."""
    radius, reach = 33.0, 12.0
    polynomial = ball(radius, 20.0)
    corner = np.full(2, reach)
    xy = np.random.default_rng(2).uniform(-reach, reach, (400, 2))
    poles, error = fitting_height(polynomial, -corner, corner, xy, 1e-6)
    truth = np.sqrt(radius**2 - (xy * xy).sum(axis=1)) - radius
    off = np.abs(tensor_height(poles, -corner, corner, xy) - truth).max()
    assert error <= 1e-6 and off == pytest.approx(error, abs=1e-9)


def test_two_degrees_more_miss_less_by_the_square_of_one_ratio():
    """Chebyshev's interpolants of an analytic function miss by rho^-d, rho the sum of the axes
    of the largest ellipse about the interval where it has no singularity: Trefethen, 8.2.
    On the mid-line of the square the root is singular at +-33/12 reaches."""
    reach, polynomial = 12.0, ball(33.0, 20.0)
    corner = np.full(2, reach)
    xy = np.stack([np.linspace(-reach, reach, 101), np.zeros(101)], axis=1)
    wanted = polynomial.height(xy)
    errors = [
        np.abs(
            tensor_height(height_poles(polynomial, -corner, corner, d), -corner, corner, xy)
            - wanted
        ).max()
        for d in (4, 6, 8)
    ]
    singular = 33.0 / 12.0
    rho = singular + np.sqrt(singular**2 - 1.0)
    # An algebraic factor of the degree is beside the power.
    assert errors[0] / errors[1] == pytest.approx(rho**2, rel=0.7)
    assert errors[1] / errors[2] == pytest.approx(rho**2, rel=0.7)


def test_height_is_held_within_a_disc_though_the_ball_ends_within_the_square():
    """Least squares stand in; the corners of the square are off the ball."""
    radius, reach = 15.0, 11.0
    corner = np.full(2, reach)
    xy = np.random.default_rng(5).uniform(-reach, reach, (2000, 2))
    xy = xy[np.linalg.norm(xy, axis=1) < reach]
    poles, error = fitting_height(ball(radius, 20.0), -corner, corner, xy, 1e-3)
    truth = np.sqrt(radius**2 - (xy * xy).sum(axis=1)) - radius
    off = np.abs(tensor_height(poles, -corner, corner, xy) - truth).max()
    assert off == pytest.approx(error, abs=1e-9) and error <= 1e-3


def test_upright_patch_is_refused():
    polynomial = ball(10.0, 20.0)
    corner = np.full(2, 11.0)
    with pytest.raises(ValueError, match="stands upright"):
        fitting_height(polynomial, -corner, corner, corner[None], 1e-3)
