"""Accumulated normal equations: a patch learns new samples without forgetting the old."""

import numpy as np

from touchatlas.atlas.table import Table
from touchatlas.patch.polynomial import monomials
from touchatlas.patch.smoothness import (
    coefficient_precision,
    effective_parameters,
    posterior,
    residual_square,
)

# A sample is of a patch's sheet when it lies this near to it, in patch radii, and its own
# normal is within 60 degrees of the patch's there.
SHEET_GAP = 0.25
SHEET_COSINE = 0.5


def on_sheet(table: Table, rows: np.ndarray, points, normals) -> np.ndarray:
    """(m, n) whether samples (n, 3) may be of each row's sheet: near it and facing as it does.

    Weaker than what it takes to be learned from: samples far from their own patch know their
    normals only within one contour.
    """
    scaled = table.scaled_local(rows, points)
    return facing(table, rows, scaled, normals, 0.0)


def facing(table: Table, rows, scaled, normals, cosine, terms=None) -> np.ndarray:
    """``on_sheet`` of points (m, n, 3) in the rows' frames, normals that agree to a cosine."""
    height, upward = table.surface(rows, scaled, terms)
    normals_local = normals @ table.axes[rows].transpose(0, 2, 1)
    length = np.sqrt((upward**2).sum(axis=-1))
    return (np.abs(height) <= SHEET_GAP * length) & (
        (normals_local * upward).sum(axis=-1) >= cosine * length
    )


def absorb(table: Table, rows: np.ndarray, points: np.ndarray, normals: np.ndarray) -> None:
    """Add samples (n, 3) with unit normals (n, 3) to the equations of every row they fall in."""
    scaled = table.scaled_local(rows, points)
    terms = monomials(table.basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
    inside = facing(table, rows, scaled, normals, SHEET_COSINE, terms)
    inside &= scaled[..., 0] ** 2 + scaled[..., 1] ** 2 <= 1.0
    weight = inside.astype(float)
    terms = terms[: table.basis.size].transpose(1, 0, 2)
    weighted = terms * weight[:, None, :]
    z = scaled[..., 2]
    table.gram[rows] += weighted @ terms.transpose(0, 2, 1)
    table.right[rows] += (weighted @ z[..., None])[..., 0]
    table.square[rows] += (weight * z * z).sum(axis=1)
    table.count[rows] += weight.sum(axis=1)


def solve(table: Table, rows: np.ndarray) -> None:
    """Coefficients, covariance and residual of the rows from their equations.

    Where the residuals exceed the noise the covariance grows with them: lack of fit is
    uncertainty too. What residuals the rows had is out of date, and dropped.
    """
    noise = table.noise_scaled(rows)
    precision = coefficient_precision(table.basis, table.turn[rows], table.bend[rows])
    equations = table.equations(rows)
    mean, covariance = posterior(equations.gram, equations.right, noise, precision)
    freedom = equations.count - effective_parameters(covariance, precision)
    residual = np.sqrt(residual_square(equations, mean) / np.maximum(freedom, 1.0))
    table.mean[rows] = mean
    table.covariance[rows] = covariance * np.maximum(1.0, (residual / noise) ** 2)[:, None, None]
    table.residual[rows] = residual * table.radius[rows]
    for row in rows.tolist():
        table.rough.pop(row, None)
