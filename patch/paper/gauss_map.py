"""The Gauss map of a patch: where its normals lie on the unit sphere (the paper's figure 4)."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.paper.total_curvature import FoldProblem


@dataclass(frozen=True, eq=False)
class GaussMap:
    """Unit normals of a patch over its domain, and the area that they cover on the sphere.

    Parameters
    ----------
    points_local : (m, 3) float, length, Darboux frame
        Points of the patch over the grid.
    normals : (m, 3) float, unit, Darboux frame
        Upward.
    curvature : (m,) float, 1/length^2
        Gaussian curvature K.
    algebraic_area : float, steradian
        Integral of K over the patch. Folds of opposite sign cancel.
    absolute_area : float, steradian
        Integral of |K| over the patch. It equals |algebraic_area| where K does not change sign.
    """

    points_local: np.ndarray
    normals: np.ndarray
    curvature: np.ndarray
    algebraic_area: float
    absolute_area: float


def gauss_map(problem: FoldProblem, coefficients) -> GaussMap:
    """Gauss map of the patch z(x, y) with given coefficients, over the grid of a problem.

    Parameters
    ----------
    problem : FoldProblem
    coefficients : (t,) float, no unit
        In the scaled coordinates of the problem.

    Returns
    -------
    GaussMap

    Notes
    -----
    dA = sqrt(1 + p^2 + q^2) dx dy, and K dA is the area on the sphere: do Carmo, section 3-3.
    The paper's (4) integrates |K| dx dy instead, which is smaller on slopes.

    Examples
    --------
    The lower cap of a parabolic bowl, nearly half a cap of the unit sphere:

    >>> from touchatlas.patch.paper.total_curvature import fold_problem
    >>> a = np.linspace(0.0, 2.0 * np.pi, 60)
    >>> rim = np.stack([np.cos(a), np.sin(a), 0.5 + 0.0 * a], axis=1)
    >>> bowl = gauss_map(fold_problem(rim, 1.0, 1.0, 0.0), np.zeros(9))
    >>> bool(abs(bowl.algebraic_area / (2.0 * np.pi * (1.0 - np.sqrt(0.5))) - 1.0) < 0.02)
    True
    """
    coefficients = np.asarray(coefficients, dtype=float)
    grid = problem.curvature(coefficients)
    scale = problem.radius
    curvature = grid.excess / scale**2 + problem.reference_curvature
    area_ratio = 1.0 / np.sqrt(grid.inverse)
    p, q = grid.pqrst[:2]
    normals = np.stack([-p, -q, np.ones_like(p)], axis=1) / area_ratio[:, None]
    x, y = problem.grid.T
    i, j = problem.exponents
    higher = coefficients @ ((x / scale) ** i[:, None] * (y / scale) ** j[:, None])
    height = 0.5 * (problem.k1 * x * x + problem.k2 * y * y) + scale * higher
    area = curvature * area_ratio * problem.spacing**2
    return GaussMap(
        np.stack([x, y, height], axis=1),
        normals,
        curvature,
        float(area.sum()),
        float(np.abs(area).sum()),
    )
