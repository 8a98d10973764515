"""Gaussian curvature of a polynomial height on a grid over its domain, with its derivatives.

The domain D is the convex hull of the projected curves. p, q, r, s, t are Monge's names for
z_x, z_y, z_xx, z_xy, z_yy.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from touchatlas.patch.geometry.polynomial import monge_basis

# Degree of the polynomial in the paper.
DEGREE = 4


def domain_radius(points_local) -> float:
    """R: the largest distance of a projected sample from the reference point, length."""
    return float(np.sqrt((np.asarray(points_local)[:, :2] ** 2).sum(axis=1).max()))


def free_exponents():
    """Exponents i, j of the unknown coefficients: those of order 3 and 4."""
    basis = monge_basis(DEGREE)
    i, j = basis.exponents[basis.orders >= 3].T[:2]
    return i, j


def convex_hull(xy) -> ConvexHull:
    """The domain D of points (n, 2). ValueError when they span no area."""
    try:
        return ConvexHull(xy)
    except QhullError:
        raise ValueError(
            f"the {len(xy)} points project to one line or fewer than three places, so their hull "
            "has no area; give curves in two or more directions"
        ) from None


def hull_grid(hull: ConvexHull, spacing: float) -> np.ndarray:
    """(m, 2) centres of the cells of a square lattice about the origin that lie in the hull."""
    low, high = np.floor(hull.min_bound / spacing), np.ceil(hull.max_bound / spacing)
    x, y = ((np.arange(a, b) + 0.5) * spacing for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = grid @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0.0
    return grid[inside.all(axis=1)]


def grid_derivatives(uv, i, j, k1, k2):
    """p, q, r, s, t on a grid as functions of the free coefficients a: a @ first + second.

    Parameters
    ----------
    uv : (m, 2) float
        Grid, scaled.
    i, j : (t,) int
        Exponents of the free monomials.
    k1, k2 : float
        Scaled curvatures of the quadric (k1 u^2 + k2 v^2)/2.

    Returns
    -------
    (t, 5 m), (5 m,) float
        All p, then all q, r, s, t.
    """
    u, v = uv.T
    blocks = [
        (_falling(i, a) * _falling(j, b))[:, None]
        * u ** np.maximum(i - a, 0)[:, None]
        * v ** np.maximum(j - b, 0)[:, None]
        for a, b in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    ]
    one = np.ones(len(uv))
    quadric = np.concatenate([k1 * u, k2 * v, k1 * one, 0.0 * one, k2 * one])
    return np.concatenate(blocks, axis=1), quadric


def _falling(n, k: int):
    """Falling factorial n (n-1) ... (n-k+1): the factor of x^(n-k) after k derivatives of x^n."""
    return np.prod([n - step for step in range(k)], axis=0) if k else np.ones(len(n))


class GridCurvature(NamedTuple):
    """K - K0 on the grid, scaled, with the terms of its derivatives.

    ``pqrst`` (5, m); ``inverse`` (m,) is 1/(1 + p^2 + q^2); ``numerator`` (m,) is rt - s^2;
    ``excess`` (m,) is K - K0.
    """

    pqrst: np.ndarray
    inverse: np.ndarray
    numerator: np.ndarray
    excess: np.ndarray


def grid_curvature(derivatives, quadric, reference: float, coefficients) -> GridCurvature:
    """K - K0 on a grid: K = (rt - s^2) / (1 + p^2 + q^2)^2, do Carmo, section 3-3, example 5.

    Parameters
    ----------
    derivatives, quadric : (t, 5 m), (5 m,) float
        See ``grid_derivatives``.
    reference : float
        K0, scaled.
    coefficients : (t,) float
    """
    pqrst = (coefficients @ derivatives + quadric).reshape(5, -1)
    p, q, r, s, t = pqrst
    inverse = p * p
    inverse += q * q
    inverse += 1.0
    np.divide(1.0, inverse, out=inverse)
    numerator = r * t
    numerator -= s * s
    excess = numerator * inverse
    excess *= inverse
    excess -= reference
    return GridCurvature(pqrst, inverse, numerator, excess)


def weighted_slopes(grid: GridCurvature, weights) -> np.ndarray:
    """(5 m,) derivatives of sum_j w_j K_j with respect to p, q, r, s, t."""
    p, q, r, s, t = grid.pqrst
    w = weights * grid.inverse * grid.inverse
    by_slope = -4.0 * w * grid.inverse * grid.numerator
    return np.concatenate([by_slope * p, by_slope * q, w * t, -2.0 * w * s, w * r])


def curvature_derivatives(derivatives, grid: GridCurvature, first, second):
    """First derivatives of K on the grid, and a weighted sum of its second derivatives.

    Parameters
    ----------
    derivatives : (t, 5 m) float
        See ``grid_derivatives``.
    grid : GridCurvature
        At the coefficients in question.
    first, second : (m,) float
        Weights of K'' and of K' K'^t.

    Returns
    -------
    (t, m), (t, t) float, no unit
        K'_j, and sum_j first_j K''_j + second_j K'_j K'_j^t.

    Notes
    -----
    K = B / S^2 with B = rt - s^2 and S = 1 + p^2 + q^2, both quadratic in the coefficients:
    K' = B'/S^2 - 2 B S'/S^3 and
    K'' = B''/S^2 - 2 (B' S'^t + S' B'^t)/S^3 + 6 B S' S'^t/S^4 - 2 B S''/S^3.
    """
    m = len(first)
    p, q, r, s, t = grid.pqrst
    inverse, numerator = grid.inverse, grid.numerator
    d = derivatives.reshape(-1, 5, m)
    # B' and S'.
    db = d[:, 2] * t
    db += d[:, 4] * r
    db -= d[:, 3] * (2.0 * s)
    ds = d[:, 0] * (2.0 * p)
    ds += d[:, 1] * (2.0 * q)
    inverse2 = inverse * inverse
    inverse3 = inverse2 * inverse
    b_over_s3 = numerator * inverse3
    dk = db * inverse2
    dk -= ds * (2.0 * b_over_s3)
    hessian = (dk * second) @ dk.T
    # The terms in B' S'^t and S' S'^t, and their transposes.
    db *= -2.0 * first * inverse3
    db += ds * (3.0 * first * b_over_s3 * inverse)
    half = db @ ds.T
    hessian += half
    hessian += half.T
    # The term in S'', with S'' = 2 (p' p'^t + q' q'^t).
    d_pq = derivatives[:, : 2 * m]
    weights = -4.0 * first * b_over_s3
    hessian += (d_pq * np.concatenate([weights, weights])) @ d_pq.T
    # The term in B'', with B'' = r' t'^t + t' r'^t - 2 s' s'^t.
    weights = first * inverse2
    half = (d[:, 2] * weights) @ d[:, 4].T
    half -= (d[:, 3] * weights) @ d[:, 3].T
    hessian += half
    hessian += half.T
    return dk, hessian
