"""Accumulated normal equations: a patch learns new samples without forgetting the old.

A sample enters the equations of a patch at its foot on the patch's anchor, the polynomial as it
was when the patch was last framed: Gauss-Newton for orthogonal distances, linearised once. So
what a sample adds does not depend on when it came, and the sums equal those made from scratch.
"""

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_pool import SamplePool
from touchatlas.patch.fit.smoothness import (
    coefficient_precision,
    effective_parameters,
    leftover,
    posterior,
    residual_square,
)
from touchatlas.patch.geometry.polynomial import GRADIENT, evaluate_batch, monomials

# A sample is of a patch's sheet when it lies this near to it, in patch radii, and its own
# normal is within 60 degrees of the patch's there.
SHEET_GAP = 0.25
SHEET_COSINE = 0.5
# Squared gradients in a sample's plane are not taken for less: there the plane is near tangent.
_LEAST_STRETCH = 0.05
# Where a patch says how sure it is, in radii: half-way to the rim.
_HALF_WAY = 0.5


def on_sheet_of_each(table: PatchTable, rows: np.ndarray, points, normals) -> np.ndarray:
    """(m,) whether samples (m, 3) may be of the sheets of rows (m,): near and facing as they do.

    Weaker than what it takes to be learned from: samples far from their own patch know their
    normals only within one contour.
    """
    height, upward = table.surface(rows, table.scaled_local(rows, points[:, None]))
    return _faces(table, rows, height, upward, normals[:, None], 0.0)[:, 0]


def _faces(table: PatchTable, rows, height, upward, normals, cosine) -> np.ndarray:
    normals_local = normals @ table.axes[rows].transpose(0, 2, 1)
    length = np.sqrt((upward**2).sum(axis=-1))
    return (np.abs(height) <= SHEET_GAP * length) & (
        (normals_local * upward).sum(axis=-1) >= cosine * length
    )


def of_patch(
    table: PatchTable, rows: np.ndarray, points, normals, reach: float = 1.0
) -> np.ndarray:
    """(m, n) whether each row may learn from samples (n, 3) with outward normals (n, 3): those
    of its sheet within ``reach`` patch radii."""
    scaled = table.scaled_local(rows, points)
    height, upward = table.surface(rows, scaled)
    near = scaled[..., 0] ** 2 + scaled[..., 1] ** 2 <= reach * reach
    return near & _faces(table, rows, height, upward, normals, SHEET_COSINE)


def absorb(table: PatchTable, rows: np.ndarray, pool: SamplePool, index, member) -> None:
    """Add samples ``index`` (n,) of the pool to the equations of the rows (m,) that ``member``
    (m, n) says they belong to."""
    moments, right, square = sums_of(table, rows, pool, index, member)
    table.moments[rows] += moments
    table.rhs[rows] += right
    table.sum_of_squares[rows] += square
    table.count[rows] += member.sum(axis=1)


def sums_of(table: PatchTable, rows, pool: SamplePool, index, member):
    """Sums over the members: of w phi phi^t its moments (m, p), of w phi z (m, t), and of
    w z^2 (m,)."""
    scaled = table.scaled_local(rows, pool.points[index])
    terms = monomials(table.basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
    phi, px, py, pz = evaluate_batch(table.basis, table.linearisation_point[rows], terms, GRADIENT)
    value = scaled[..., 2] - phi
    gradient = np.empty_like(scaled)
    gradient[..., 0], gradient[..., 1], gradient[..., 2] = -px, -py, 1.0 - pz
    # A sample is off within its plane, so its foot lies in it too.
    across = pool.across[index] @ table.axes[rows].transpose(0, 2, 1)
    gradient -= np.einsum("mni,mni->mn", gradient, across)[..., None] * across
    stretch = np.maximum(np.einsum("mni,mni->mn", gradient, gradient), _LEAST_STRETCH)
    feet = scaled - (value / stretch)[..., None] * gradient
    terms = monomials(table.basis, feet[..., 0], feet[..., 1], feet[..., 2])
    terms = terms[: table.basis.size].transpose(1, 0, 2)
    z = feet[..., 2] + value
    # What the degree leaves out grows with the distance, and counts as noise.
    beyond = left_out(table, rows, feet)
    weight = member / stretch / (1.0 + beyond / table.noise_scaled(rows)[:, None] ** 2)
    return (
        table.products.moments(terms, weight),
        (terms @ (weight * z)[..., None])[..., 0],
        (weight * z * z).sum(axis=1),
    )


def left_out(table: PatchTable, rows, scaled) -> np.ndarray:
    """(m, n) variance, scaled, of what the degree of the rows leaves out at points (m, n, 3)."""
    square = (scaled[..., :2] ** 2).sum(axis=-1)
    rim = leftover(table.basis, table.length_ratio[rows])
    return (rim * rim)[:, None] * square ** (table.basis.degree + 1)


def solve(table: PatchTable, rows: np.ndarray) -> None:
    """Coefficients, variance and residual of the rows from their equations.

    Where the residuals exceed the noise the variance grows with them: lack of fit is
    uncertainty too. What residuals the rows had is out of date, and dropped.
    """
    mean, covariance, residual = _solution(table, rows)
    table.mean[rows] = mean
    table.variance[rows] = table.products.quadratic_forms(covariance)
    table.residual[rows] = residual * table.radius[rows]
    for row in rows.tolist():
        table.residuals.pop(row, None)


def covariance_of(table: PatchTable, row: int) -> np.ndarray:
    """(t, t) covariance of a row's coefficients, as they were last solved for."""
    if row in table.residuals:
        return table.residuals[row].covariance
    return _solution(table, np.array([row]))[1][0]


def _solution(table: PatchTable, rows):
    """Means (m, t), covariances (m, t, t) and scaled residuals (m,) of the rows' equations."""
    noise = table.noise_scaled(rows)
    precision = coefficient_precision(table.basis, table.length_ratio[rows], table.z_scale[rows])
    equations = table.equations(rows)
    mean, covariance = posterior(equations.gram, equations.rhs, noise, precision)
    freedom = equations.count - effective_parameters(covariance, precision)
    residual = np.sqrt(residual_square(equations, mean) / np.maximum(freedom, 1.0))
    covariance *= np.maximum(1.0, (residual / noise) ** 2)[:, None, None]
    return mean, covariance, residual


def half_way_deviation(table: PatchTable, rows: np.ndarray) -> float:
    """Root mean square over rows of their standard deviation half-way to the rim, length."""
    angles = np.pi / 4.0 * np.arange(8) + 0.2
    x, y = _HALF_WAY * np.cos(angles), _HALF_WAY * np.sin(angles)
    # The height by its curvature alone: it matters little here.
    z = np.stack([x * x, x * y, y * y]).T @ table.mean[rows, 3:6, None]
    x, y, z = np.broadcast_arrays(x, y, z[..., 0])
    terms = monomials(table.basis, x, y, z)[: table.basis.size].transpose(1, 0, 2)
    variance = table.variance_at(rows, terms).mean(axis=1)
    return float(np.sqrt(np.mean(table.radius[rows] ** 2 * variance)))
