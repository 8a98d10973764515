"""Total absolute Gaussian curvature as a measure of folding: the paper's objective (5).

Three concurrent curves do not determine a quartic: it can fold between them. The paper adds to the
squared error f(a) of the heights the integral of |K| over the convex hull D of the projected
curves, summed on a grid: f(a) + lam n g(a). With a reference curvature K0 = k1 k2 the sum is of
|K - K0| instead, which does not flatten the patch.

The unknowns are the coefficients of order 3 and 4 in scaled coordinates (x/R, y/R, z/R). Every
returned value is in the caller's units. K dx dy decreases on a steep graph, so a steeper fold can
have a smaller sum. Where the curves do not determine a fold at all, (5) has local minima but no
least value, and solvers find the minima near their start.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from touchatlas.patch.geometry.arrays import check_points, frozen_array
from touchatlas.patch.geometry.polynomial import monge_basis
from touchatlas.patch.paper.curvature_on_grid import (
    DEGREE,
    GridCurvature,
    convex_hull,
    domain_radius,
    free_exponents,
    grid_curvature,
    grid_derivatives,
    hull_grid,
    weighted_slopes,
)


@dataclass(frozen=True, eq=False)
class FoldProblem:
    """The paper's problem (5): samples, Darboux quadric, grid and multiplier.

    Parameters
    ----------
    points_local : (n, 3) float, length, Darboux frame
    k1, k2 : float, 1/length
    multiplier : float, length^2
        lam of (5).
    reference_curvature : float, 1/length^2
        K0 of |K - K0|. The paper's own measure has 0.
    radius : float, length
        R of the scaled coordinates.
    grid : (m, 2) float, length, Darboux frame
    spacing : float, length
        h of the grid.
    design, target : (n, t), (n,) float, no unit
        f = R^2 |design a - target|^2.
    derivatives, quadric : (t, 5 m), (5 m,) float, no unit
        p, q, r, s, t on the grid are a @ derivatives + quadric, in scaled coordinates.
    coarse : FoldProblem or None
        The same problem with twice the grid spacing.
    """

    points_local: np.ndarray
    k1: float
    k2: float
    multiplier: float
    reference_curvature: float
    radius: float
    grid: np.ndarray
    spacing: float
    design: np.ndarray
    target: np.ndarray
    derivatives: np.ndarray
    quadric: np.ndarray
    coarse: "FoldProblem | None" = None

    @property
    def size(self) -> int:
        """Number t of unknown coefficients: nine."""
        return self.design.shape[1]

    @property
    def exponents(self) -> tuple[np.ndarray, np.ndarray]:
        """Exponents i, j (t,) of the unknown coefficients."""
        return free_exponents()

    @property
    def weight(self) -> float:
        """lam n h^2 / R^4: the factor of sum |K| in scaled coordinates, where f is over R^2."""
        return self.multiplier * len(self.target) * self.spacing**2 / self.radius**4

    def curvature(self, coefficients) -> GridCurvature:
        """(K - K0) R^2 on the grid, with the terms of its derivatives."""
        reference = self.reference_curvature * self.radius**2
        return grid_curvature(self.derivatives, self.quadric, reference, coefficients)

    def scaled_polynomial(self, coefficients) -> np.ndarray:
        """All coefficients of z/R over ``monge_basis(DEGREE)``: the quadric and the unknowns."""
        basis = monge_basis(DEGREE)
        out = np.zeros(len(basis.orders))
        out[basis.orders >= 3] = coefficients
        i, j = basis.exponents[:, 0], basis.exponents[:, 1]
        out[(i == 2) & (j == 0)] = 0.5 * self.k1 * self.radius
        out[(i == 0) & (j == 2)] = 0.5 * self.k2 * self.radius
        return out


def fold_problem(points_local, k1, k2, multiplier, *, reference_curvature=0.0) -> FoldProblem:
    """The problem (5) of samples along concurrent curves.

    Parameters
    ----------
    points_local : (n, 3) float, length, Darboux frame
        Origin at the reference point, axes e1, e2, n.
    k1, k2 : float, 1/length
        Principal curvatures. They fix the quadric, equation (1).
    multiplier : float, length^2
        lam. The paper takes 0.3 in millimetres. See ``scale_free_multiplier``.
    reference_curvature : float, 1/length^2
        K0. It is k1 k2 for the excess curvature.

    Raises
    ------
    ValueError
        Points on one line or nearly so, or a negative multiplier.

    Notes
    -----
    The paper, section 2.2.

    Examples
    --------
    >>> t = np.linspace(-2.0, 2.0, 5)
    >>> lines = [np.outer(t, [np.cos(a), np.sin(a), 0.0]) for a in (0.0, 1.0, 2.0)]
    >>> problem = fold_problem(np.concatenate(lines), 0.0, 0.0, 0.3)
    >>> problem.size, problem.radius, objective(problem, np.zeros(9))
    (9, 2.0, 0.0)
    """
    points = check_points(points_local, "points_local")
    k1, k2, multiplier, reference = frozen_array(
        [k1, k2, multiplier, reference_curvature], (4,), "k1, k2, multiplier, reference_curvature"
    ).tolist()
    if multiplier < 0:
        raise ValueError(f"the multiplier is {multiplier}; it must be 0 or more")
    radius = domain_radius(points)
    hull = convex_hull(points[:, :2])
    # ``volume`` is the area of a hull in the plane.
    # Curves about one degree apart: a narrower hull has too few rows of grid points.
    if hull.volume < 0.04 * radius**2:
        raise ValueError(
            f"the hull of the points has an area of {hull.volume:.4g} at a radius of {radius:.4g}, "
            "too narrow for a grid; give curves in two or more directions"
        )
    # Of 400 cells a fold of a quartic is about five wide.
    spacing = float(np.sqrt(hull.volume / 400))
    i, j = free_exponents()
    x, y, z = points.T / radius
    design = x[:, None] ** i * y[:, None] ** j
    target = z - 0.5 * radius * (k1 * x * x + k2 * y * y)

    of_points = partial(FoldProblem, points, k1, k2, multiplier, reference, radius)

    def on_grid(h: float, coarse: FoldProblem | None) -> FoldProblem:
        grid = hull_grid(hull, h)
        derivatives, quadric = grid_derivatives(grid / radius, i, j, k1 * radius, k2 * radius)
        for array in (grid, design, target, derivatives, quadric):
            array.flags.writeable = False
        return of_points(grid, h, design, target, derivatives, quadric, coarse)

    return on_grid(spacing, on_grid(2.0 * spacing, None))


def scale_free_multiplier(fraction: float, points_local) -> float:
    """lam = fraction R^2, length^2: it makes the fit independent of the object's size.

    >>> scale_free_multiplier(0.001, np.array([[0.0, 20.0, 1.0]]))
    0.4
    """
    return fraction * domain_radius(points_local) ** 2


def squared_error(problem: FoldProblem, coefficients) -> float:
    """f(a) = sum of (z(x_k, y_k) - z_k)^2, length^2: the paper's (3)."""
    residual = problem.design @ coefficients - problem.target
    return float(residual @ residual) * problem.radius**2


def least_squares_coefficients(problem: FoldProblem) -> np.ndarray:
    """(t,) minimiser of f, the paper's (3). It folds between the curves."""
    return np.linalg.lstsq(problem.design, problem.target, rcond=None)[0]


def total_absolute_curvature(problem: FoldProblem, coefficients) -> float:
    """g(a) = h^2 sum |K - K0|, no unit: the paper's (4) on its grid."""
    excess = problem.curvature(coefficients).excess
    return float(np.abs(excess).sum()) * (problem.spacing / problem.radius) ** 2


def objective(problem: FoldProblem, coefficients) -> float:
    """f(a) + lam n g(a), length^2: the paper's (5)."""
    folding = total_absolute_curvature(problem, coefficients)
    count = len(problem.target)
    return squared_error(problem, coefficients) + problem.multiplier * count * folding


def signs(excess) -> np.ndarray:
    """The paper's delta_j: 1 where K >= 0, -1 where K < 0."""
    return np.where(excess >= 0.0, 1.0, -1.0)


def objective_and_gradient(problem: FoldProblem, coefficients):
    """(5), length^2, its gradient (t,), and (K - K0) R^2 on the grid (m,).

    With the signs delta_j of K_j - K0, (5) is f + lam n h^2 sum delta_j (K_j - K0). The gradient
    treats delta_j as constants, as the paper does.
    """
    grid = problem.curvature(coefficients)
    delta = signs(grid.excess)
    residual = problem.design @ coefficients - problem.target
    value = residual @ residual + problem.weight * (delta @ grid.excess)
    gradient = 2.0 * (residual @ problem.design)
    gradient += problem.weight * (problem.derivatives @ weighted_slopes(grid, delta))
    unit = problem.radius**2
    return float(value) * unit, gradient * unit, grid.excess
