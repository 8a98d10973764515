"""Residuals of an atlas's patches: learned when its surface is wanted, gone when a patch learns."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.atlas.patches.normal_equations import solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership
from touchatlas.atlas.residual.binned_samples import SIDE, PatchSamples, merged
from touchatlas.atlas.residual.gaussian_process import Residual, solve_residual
from touchatlas.atlas.residual.hyperparameters import (
    ResidualScale,
    learn_residual_scale,
    residual_evidence,
)
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    scaled_noise,
)
from touchatlas.patch.geometry.polynomial import Basis, monomials

# The texture is learned from so many patches at most, and residuals so many at once.
_ASKED, _AT_ONCE = 12, 32
# A residual is solved from squares as wide as this share of the texture's length: wider ones would
# smooth what it is there for, narrower ones than the last make matrices too large.
_FINE, _FINEST = 1.0 / 3.0, SIDE / 2.0


@dataclass(frozen=True, eq=False)
class PatchResidual:
    """A patch with a residual: what it was solved from, and the solution. Stacks of one.

    Parameters
    ----------
    samples : PatchSamples
    shape : (4,) float
        Amplitude and length of the residual, scaled; turn and bend of the trend.
    mean : (t,) float
        Coefficients of the trend.
    covariance : (t, t) float
    residual : Residual
    """

    samples: PatchSamples
    shape: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    residual: Residual


def solve_patch_residual(basis: Basis, samples: PatchSamples, shape) -> PatchResidual:
    """Trend and residual of one patch (a stack of one) from its samples."""
    # Of one layout in memory, so that what is read from a file is solved to the last bit.
    samples = PatchSamples(
        *(np.ascontiguousarray(getattr(samples, field.name)) for field in fields(samples))
    )
    amplitude, length, length_ratio, z_scale = shape[:, None]
    precision = coefficient_precision(basis, length_ratio, z_scale)
    mean, covariance, residual = solve_residual(samples, amplitude, length, precision)
    return PatchResidual(samples, shape, mean[0], covariance[0], residual)


def learn_residuals(
    table: PatchTable, membership: SampleMembership, prior: SmoothnessPrior
) -> ResidualScale:
    """Give every patch a residual that the evidence asks for; returns the surface's texture.

    Parameters
    ----------
    table : Table
        Its ``rough`` is filled, and of these patches mean and variance become the trend's.
    membership : Learning
        The samples of each patch.
    prior : SmoothnessPrior
    """
    solve(table, np.array(sorted(table.residuals), int))
    rows = table.rows
    asked = rows[:: max(1, -(-len(rows) // _ASKED))]
    residual_scale = ResidualScale()
    if len(rows):
        samples = samples_of(table, membership, asked)
        residual_scale = learn_residual_scale(table.basis, samples, table.radius[asked], prior)
    if not residual_scale.amplitude > 0:
        return residual_scale
    for some in np.array_split(rows, -(-len(rows) // _AT_ONCE)):
        _learn(table, membership, some, residual_scale, prior)
    return residual_scale


def _learn(
    table: PatchTable, membership: SampleMembership, rows, residual_scale: ResidualScale, prior
) -> None:
    samples = samples_of(table, membership, rows)
    found = residual_evidence(table.basis, samples, residual_scale, table.radius[rows], prior)
    length = residual_scale.length / table.radius[rows]
    shapes = np.stack([found.amplitude, length, found.length_ratio, found.z_scale], axis=1)
    rows, shapes = rows[found.needed], shapes[found.needed]
    if len(rows):
        fine = samples_of(table, membership, rows, residual_scale)
        for i, row in enumerate(rows.tolist()):
            enter(table, row, solve_patch_residual(table.basis, fine.only(i), shapes[i]))


def enter(table: PatchTable, row: int, rough: PatchResidual) -> None:
    """Make a patch of the table a rough one."""
    table.residuals[row] = rough
    table.mean[row], table.variance[row] = (
        rough.mean,
        table.products.quadratic_forms(rough.covariance),
    )


def samples_of(
    table: PatchTable,
    membership: SampleMembership,
    rows,
    residual_scale: ResidualScale | None = None,
) -> PatchSamples:
    """What the rows' patches learned from, at its feet on them, merged: some 200 a patch, or as
    many as a texture asks for."""
    parts = [
        _feet(table, row, membership.pool.points[membership.fitted[row]]) for row in rows.tolist()
    ]
    width = max(len(lift) for _, lift, _ in parts)
    feet = np.zeros((len(parts), width, 3))
    lift, weight = np.zeros((2, len(parts), width))
    for i, part in enumerate(parts):
        for array, values in zip((feet, lift, weight), part, strict=True):
            array[i, : len(values)] = values
    terms = monomials(table.basis, *np.moveaxis(feet, -1, 0))[: table.basis.size]
    noise = scaled_noise(table.measurement_std[rows], table.radius[rows])
    side = np.full(len(rows), SIDE)
    if residual_scale is not None:
        side = np.clip(_FINE * residual_scale.length / table.radius[rows], _FINEST, SIDE)
    return merged(PatchSamples(feet, terms, feet[..., 2] + lift, weight, noise), side)


def _feet(table: PatchTable, row: int, points):
    """Feet (n, 3), F (n,) and weights (n,) of points (n, 3) on a patch, scaled."""
    scaled = table.scaled_local(np.array([row]), points)
    value, upward = (values[0] for values in table.surface(np.array([row]), scaled))
    square = (upward * upward).sum(axis=1)
    return scaled[0] - (value / square)[:, None] * upward, value, 1.0 / square
