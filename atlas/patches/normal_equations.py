"""Accumulated normal equations: a patch is fitted to new samples without reading the old ones.

A sample is added to the equations at its foot on the patch's linearisation point, which is the
polynomial of the last refit. This is Gauss-Newton for orthogonal distances, linearised once. So
the sums do not depend on the order of the samples, and equal those made from all at once.
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

# Largest distance from a patch, in patch radii, of a sample of its sheet. Doubled, the faces of
# a step half a radius high pass for one sheet.
SHEET_GAP = 0.25
# Least cosine of the angle between a patch's normal and that of a sample of its sheet: 60 degrees.
# Doubled to 1, no sample is accepted.
SHEET_COSINE = 0.5
# Least squared gradient of F in a sampling plane, scaled: below it the plane is nearly tangent.
# Doubled, samples of such planes weigh half as much.
_LEAST_STRETCH = 0.05
# Distance from the origin at which a patch's deviation is quoted, in patch radii. Doubled, it would
# be quoted at the rim.
_HALF_WAY = 0.5


def on_sheet_of_each(table: PatchTable, rows: np.ndarray, points, normals) -> np.ndarray:
    """(m,) whether samples (m, 3) may belong to the sheets of rows (m,): they are near, and their
    normals (m, 3) are within 90 degrees of the patches' normals.

    A fit asks for 60 degrees (``of_patch``). The limit is weaker here because the normal of a
    sample far from its own patch is known only within one contour.
    """
    height, upward = table.surface(rows, table.scaled_local(rows, points[:, None]))
    return _faces(table, rows, height, upward, normals[:, None], 0.0)[:, 0]


def _faces(table: PatchTable, rows, height, upward, normals, cosine) -> np.ndarray:
    """(m, n) whether samples are within SHEET_GAP of patches, and their normals (m, n, 3) within
    an angle of given cosine; F and its gradient at the samples are ``height`` and ``upward``."""
    normals_local = normals @ table.axes[rows].transpose(0, 2, 1)
    length = np.sqrt((upward**2).sum(axis=-1))
    return (np.abs(height) <= SHEET_GAP * length) & (
        (normals_local * upward).sum(axis=-1) >= cosine * length
    )


def of_patch(
    table: PatchTable, rows: np.ndarray, points, normals, reach: float = 1.0
) -> np.ndarray:
    """(m, n) whether each row may be fitted to samples (n, 3) with outward normals (n, 3): they
    are of its sheet and within ``reach`` patch radii of its origin, along the tangent plane."""
    scaled = table.scaled_local(rows, points)
    height, upward = table.surface(rows, scaled)
    near = scaled[..., 0] ** 2 + scaled[..., 1] ** 2 <= reach * reach
    return near & _faces(table, rows, height, upward, normals, SHEET_COSINE)


def absorb(table: PatchTable, rows: np.ndarray, pool: SamplePool, index, member) -> None:
    """Add samples ``index`` (n,) or (m, n) of the pool to the equations of rows (m,), where
    ``member`` (m, n) is true."""
    moments, rhs, sum_of_squares = sums_of(table, rows, pool, index, member)
    table.moments[rows] += moments
    table.rhs[rows] += rhs
    table.sum_of_squares[rows] += sum_of_squares
    table.count[rows] += member.sum(axis=1)


def sums_of(table: PatchTable, rows, pool: SamplePool, index, member):
    """Sums over the samples where ``member`` (m, n) is true, scaled: the moments (m, p) of
    w phi phi^t, w phi z (m, t) and w z^2 (m,)."""
    scaled = table.scaled_local(rows, pool.points[index])
    terms = monomials(table.basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
    phi, px, py, pz = evaluate_batch(table.basis, table.linearisation_point[rows], terms, GRADIENT)
    value = scaled[..., 2] - phi
    gradient = np.empty_like(scaled)
    gradient[..., 0], gradient[..., 1], gradient[..., 2] = -px, -py, 1.0 - pz
    # The noise of a sample lies in its sampling plane, so its foot lies there too.
    across = pool.across[index] @ table.axes[rows].transpose(0, 2, 1)
    gradient -= np.einsum("mni,mni->mn", gradient, across)[..., None] * across
    stretch = np.maximum(np.einsum("mni,mni->mn", gradient, gradient), _LEAST_STRETCH)
    feet = scaled - (value / stretch)[..., None] * gradient
    terms = monomials(table.basis, feet[..., 0], feet[..., 1], feet[..., 2])
    terms = terms[: table.basis.size].transpose(1, 0, 2)
    z = feet[..., 2] + value
    # The terms above the degree grow with the distance from the origin, and count as noise.
    beyond = left_out(table, rows, feet)
    weight = member / stretch / (1.0 + beyond / table.noise_scaled(rows)[:, None] ** 2)
    return (
        table.products.moments(terms, weight),
        (terms @ (weight * z)[..., None])[..., 0],
        (weight * z * z).sum(axis=1),
    )


def left_out(table: PatchTable, rows, scaled) -> np.ndarray:
    """(m, n) variance, scaled, of the terms above the degree, at points (m, n, 3), scaled."""
    square = (scaled[..., :2] ** 2).sum(axis=-1)
    rim = leftover(table.basis, table.length_ratio[rows])
    return (rim * rim)[:, None] * square ** (table.basis.degree + 1)


def solve(table: PatchTable, rows: np.ndarray) -> None:
    """Set mean, variance and residual of rows from their equations, and drop their Gaussian
    processes, which no longer fit.

    Where the residual exceeds the noise, the variance is scaled by their squared ratio: lack of
    fit is uncertainty too.
    """
    mean, covariance, residual = _solution(table, rows)
    table.mean[rows] = mean
    table.variance[rows] = table.products.quadratic_forms(covariance)
    table.residual[rows] = residual * table.radius[rows]
    for row in rows.tolist():
        table.residuals.pop(row, None)


def covariance_of(table: PatchTable, row: int) -> np.ndarray:
    """(t, t) covariance of a row's coefficients, scaled, from the last solution."""
    if row in table.residuals:
        return table.residuals[row].covariance
    return _solution(table, np.array([row]))[1][0]


def _solution(table: PatchTable, rows):
    """Means (m, t), covariances (m, t, t) and residuals (m,) of rows (m,), scaled."""
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
    # Second-order terms give the height well enough for the monomials in z.
    z = np.stack([x * x, x * y, y * y]).T @ table.mean[rows, 3:6, None]
    x, y, z = np.broadcast_arrays(x, y, z[..., 0])
    terms = monomials(table.basis, x, y, z)[: table.basis.size].transpose(1, 0, 2)
    variance = table.variance_at(rows, terms).mean(axis=1)
    return float(np.sqrt(np.mean(table.radius[rows] ** 2 * variance)))
