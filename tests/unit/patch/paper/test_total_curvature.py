"""Total curvature and the solvers of (5), against closed forms, differences and each other."""

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyder, polyval2d
from scipy.optimize import minimize

from touchatlas.patch.geometry.polynomial import gaussian_curvature, monge_basis
from touchatlas.patch.paper.gauss_map import gauss_map
from touchatlas.patch.paper.newton import newton_minimum
from touchatlas.patch.paper.steepest_descent import sign_frozen_descent
from touchatlas.patch.paper.total_curvature import (
    fold_problem,
    least_squares_coefficients,
    objective,
    objective_and_gradient,
    signs,
    squared_error,
    total_absolute_curvature,
)


def ball(x, y):
    return np.sqrt(33.0**2 - x * x - y * y) - 33.0


def ellipsoid(x, y):
    return 30.0 * np.sqrt(1.0 - (x / 80.0) ** 2 - (y / 50.0) ** 2) - 30.0


def torus_outside(x, y):
    return np.sqrt((40.0 + np.sqrt(225.0 - y * y)) ** 2 - x * x) - 55.0


def torus_inside(x, y):
    return 25.0 - np.sqrt((40.0 - np.sqrt(225.0 - y * y)) ** 2 - x * x)


def neck(x, y):
    return 0.009 * x**2 - 0.021 * y**2 + 2e-4 * x**3 - 1e-5 * y**4 - 6e-6 * x**2 * y**2


def monkey_saddle(x, y):
    return (x**3 - 3.0 * x * y * y) / 600.0


SURFACES = {
    ball: (-1 / 33, -1 / 33, 20.0),
    ellipsoid: (-30 / 80**2, -30 / 50**2, 20.0),
    torus_outside: (-1 / 55, -1 / 15, 11.0),
    torus_inside: (1 / 25, -1 / 15, 11.0),
    neck: (0.018, -0.042, 15.0),
    monkey_saddle: (0.0, 0.0, 12.0),
}


def curves(surface, noise=0.0, seed=0):
    """(57, 3) points of three concurrent curves, 60 degrees apart; millimetres."""
    rng = np.random.default_rng(seed)
    half_length = SURFACES[surface][2]
    angles = rng.uniform(0.0, np.pi) + np.pi / 3 * np.arange(3)
    t = np.linspace(-half_length, half_length, 19)
    x, y = np.outer(np.cos(angles), t).ravel(), np.outer(np.sin(angles), t).ravel()
    points = np.stack([x, y, surface(x, y)], axis=1)
    return points + noise * rng.normal(size=points.shape)


def problem_of(surface, multiplier=0.3, noise=0.0, seed=0, **options):
    k1, k2, _ = SURFACES[surface]
    return fold_problem(curves(surface, noise, seed), k1, k2, multiplier, **options)


def folds_of(problem, seed=0):
    return 0.05 * np.random.default_rng(seed).normal(size=problem.size)


def test_objective_is_the_papers_formula_in_the_callers_units():
    """Second route: numpy's polynomials in unscaled coordinates, summed as in (3) to (5)."""
    p = problem_of(torus_outside, noise=0.02)
    a = folds_of(p)
    basis, scale = monge_basis(4), p.radius
    c = p.scaled_polynomial(a) * scale ** (1.0 - basis.orders)
    table = np.zeros((5, 5))
    table[tuple(basis.exponents[:, :2].T)] = c
    x, y, z = p.points_local.T
    error = ((polyval2d(x, y, table) - z) ** 2).sum()
    slopes = [polyder(table, axis=0), polyder(table, axis=1)]
    seconds = [polyder(slopes[0], axis=0), polyder(slopes[0], axis=1), polyder(slopes[1], axis=1)]
    k = gaussian_curvature(*(polyval2d(*p.grid.T, d) for d in slopes + seconds))
    folding = p.spacing**2 * np.abs(k).sum()
    # Rounding of a few hundred terms.
    assert squared_error(p, a) == pytest.approx(error, rel=1e-10)
    assert total_absolute_curvature(p, a) == pytest.approx(folding, rel=1e-10)
    assert objective(p, a) == pytest.approx(error + 0.3 * 57 * folding, rel=1e-10)


@pytest.mark.parametrize("reference", [0.0, 1e-3])
def test_gradient_matches_finite_differences_away_from_kinks(reference):
    p = problem_of(neck, reference_curvature=reference)
    a, h = folds_of(p), 1e-6
    value, gradient, excess = objective_and_gradient(p, a)
    assert value == pytest.approx(objective(p, a), rel=1e-12)
    ends = [[a - h * e, a + h * e] for e in np.eye(p.size)]
    for end in np.concatenate(ends):
        assert np.array_equal(signs(objective_and_gradient(p, end)[2]), signs(excess))
    differences = [(objective(p, high) - objective(p, low)) / (2.0 * h) for low, high in ends]
    # Central differences: h^2 and rounding 1e-16 / h.
    assert gradient == pytest.approx(np.array(differences), abs=1e-8 * np.abs(gradient).max())


def test_plain_fit_finds_a_cubic_that_more_curves_determine():
    points = np.concatenate([curves(monkey_saddle, seed=s) for s in range(3)])
    p = fold_problem(points, 0.0, 0.0, 0.0)
    c = p.scaled_polynomial(least_squares_coefficients(p)) * p.radius ** (
        1.0 - monge_basis(4).orders
    )
    # Condition of the design, about 1e3, times rounding, over coefficients of 1/600.
    assert c[6:10] == pytest.approx([1 / 600, 0.0, -3 / 600, 0.0], abs=1e-12)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_newton_ends_no_higher_than_the_papers_descent(surface, noise):
    for lam in (0.03, 0.3):
        p = problem_of(surface, lam, noise)
        slow, fast = sign_frozen_descent(p, limit=2000), newton_minimum(p)
        assert fast.converged
        # The accuracy asked of the fast solver.
        assert fast.objective <= slow.objective * (1.0 + 1e-6)
        assert fast.objective == pytest.approx(objective(p, fast.coefficients), rel=1e-12)


def test_newton_finds_a_lower_minimum_than_a_descent_from_zeros_alone():
    """On a ball the minimum near zeros is one of several. Second route: scipy's L-BFGS-B."""
    p = problem_of(ball)
    near = minimize(
        lambda a: objective_and_gradient(p, a)[:2], np.zeros(p.size), jac=True, method="L-BFGS-B"
    )
    assert newton_minimum(p).objective < 0.8 * near.fun


def test_gauss_map_of_a_saddle_is_negative_and_quadrants_cancel():
    p = problem_of(torus_inside)
    found = gauss_map(p, np.zeros(p.size))
    assert found.algebraic_area == pytest.approx(-found.absolute_area, rel=1e-12)
    assert np.linalg.norm(found.normals, axis=1) == pytest.approx(np.ones(len(p.grid)), abs=1e-14)
    p = problem_of(monkey_saddle)
    folded = gauss_map(p, 0.3 * np.eye(p.size)[0] + 0.3 * np.eye(p.size)[3])
    # z = x^3 + y^3 has K of the sign of xy: quadrants cancel, but for the rotation of the hexagon.
    assert abs(folded.algebraic_area) < 0.2 * folded.absolute_area


def test_descent_says_how_it_ended():
    p = problem_of(ellipsoid, noise=0.02)
    start, long = objective(p, np.zeros(p.size)), sign_frozen_descent(p)
    assert long.converged and long.reason == "no sign changed"
    short = sign_frozen_descent(p, limit=5)
    assert not short.converged and short.reason == "the iteration limit was reached"
    assert short.iterations == 5 and long.objective < short.objective < start


def test_caller_errors_say_what_to_try():
    points = curves(ball)
    line = points[:19]
    with pytest.raises(ValueError, match="two or more directions"):
        fold_problem(line, 0.0, 0.0, 0.3)
    with pytest.raises(ValueError, match="NaN or infinity"):
        fold_problem(np.full((9, 3), np.nan), 0.0, 0.0, 0.3)
    with pytest.raises(ValueError, match="0 or more"):
        fold_problem(points, 0.0, 0.0, -1.0)
    strip = np.concatenate([line, line + [0.0, 1e-5, 0.0]])
    with pytest.raises(ValueError, match="too narrow"):
        fold_problem(strip, 0.0, 0.0, 0.3)
