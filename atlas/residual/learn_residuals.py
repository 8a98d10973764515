"""Learning the residuals of all patches of an atlas."""

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
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    Basis,
    evaluate_batch,
    monomials,
    scaled_height,
)

# Largest number of patches from which amplitude and length are learned. Doubled, that takes twice
# the time.
_ASKED = 12
# Number of patches in one numpy call. Doubled, it takes twice the memory.
_AT_ONCE = 32
# Side of the squares over which samples are averaged for a residual, as a fraction of the
# correlation length. Doubled, the detail that the residual is for is smoothed.
_FINE = 1.0 / 3.0
# Least side of these squares, in patch radii: smaller ones make matrices too large. Doubled,
# residuals shorter than a third of the radius are smoothed.
_FINEST = SIDE / 2.0

# Cosine of the largest angle between the normals of a patch with and without its trend: 30 degrees.
# Residuals are small beside patches. With the angle doubled, folded trends are entered. And the
# points of the core at which it is taken, in core radii and directions.
_LEAST_COSINE, _RADII = np.cos(np.pi / 6.0), (0.0, 0.5, 1.0)
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_CIRCLE = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(frozen=True, eq=False)
class PatchResidual:
    """The residual of one patch, with the trend and the samples that it was solved from.

    Parameters
    ----------
    samples : PatchSamples
        A stack of one.
    shape : (4,) float
        Amplitude and length of the residual, scaled; length ratio and z scale of the trend's prior.
    mean : (t,) float, scaled
        Coefficients of the trend.
    covariance : (t, t) float, scaled^2
        Covariance of these coefficients.
    residual : Residual
        A stack of one.
    """

    samples: PatchSamples
    shape: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    residual: Residual


def solve_patch_residual(basis: Basis, samples: PatchSamples, shape) -> PatchResidual:
    """Trend and residual of one patch from its samples (a stack of one) and ``shape`` (4,): see
    PatchResidual."""
    # One memory layout gives the same bytes for samples from a file.
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
    """Give a residual to every patch with strong evidence for one.

    Parameters
    ----------
    table : PatchTable
        Changed in place: ``residuals`` is filled, and ``mean`` and ``variance`` of these patches
        become those of their trends.
    membership : SampleMembership
    prior : SmoothnessPrior

    Returns
    -------
    ResidualScale
        Amplitude and correlation length of the surface; amplitude 0 where no patch has a residual.
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
    """Give a residual to those of rows (m,) that have strong evidence for one."""
    samples = samples_of(table, membership, rows)
    found = residual_evidence(table.basis, samples, residual_scale, table.radius[rows], prior)
    length = residual_scale.length / table.radius[rows]
    shapes = np.stack([found.amplitude, length, found.length_ratio, found.z_scale], axis=1)
    rows, shapes = rows[found.needed], shapes[found.needed]
    if len(rows):
        fine = samples_of(table, membership, rows, residual_scale)
        for i, row in enumerate(rows.tolist()):
            solved = solve_patch_residual(table.basis, fine.only(i), shapes[i])
            if _keeps_normals(table, row, solved.mean):
                enter(table, row, solved)


def _keeps_normals(table: PatchTable, row: int, mean) -> bool:
    """Whether a trend (t,) has nearly the normals of a patch all over its core: where little is
    measured a trend may fold, because a multiple of F is zero at the same points."""
    x, y = table.core * np.concatenate([radius * _CIRCLE for radius in _RADII]).T
    z = scaled_height(table.basis, table.mean[row], x, y)
    points = np.column_stack([x, y, z])[np.isfinite(z)]
    terms = np.repeat(monomials(table.basis, *points.T)[:, None], 2, axis=1)
    _, px, py, pz = evaluate_batch(table.basis, np.stack([table.mean[row], mean]), terms, GRADIENT)
    upward = np.stack([-px, -py, 1.0 - pz], axis=-1)
    before, after = upward / np.sqrt((upward * upward).sum(axis=-1))[..., None]
    return bool(((before * after).sum(axis=-1) >= _LEAST_COSINE).all())


def enter(table: PatchTable, row: int, solved: PatchResidual) -> None:
    """Give a patch of the table its residual, and the mean and variance of the trend."""
    table.residuals[row] = solved
    table.mean[row] = solved.mean
    table.variance[row] = table.products.quadratic_forms(solved.covariance)


def samples_of(
    table: PatchTable,
    membership: SampleMembership,
    rows,
    residual_scale: ResidualScale | None = None,
) -> PatchSamples:
    """Samples of rows at their feet on the patches, averaged over squares.

    Parameters
    ----------
    table : PatchTable
    membership : SampleMembership
    rows : (m,) int
    residual_scale : ResidualScale, optional
        Makes the squares fine enough for its correlation length. Without, a patch has about 200.
    """
    parts = [
        _feet(table, row, membership.pool.points[membership.fitted[row]]) for row in rows.tolist()
    ]
    width = max(len(value) for _, value, _ in parts)
    feet = np.zeros((len(parts), width, 3))
    value, weight = np.zeros((2, len(parts), width))
    for i, part in enumerate(parts):
        for array, values in zip((feet, value, weight), part, strict=True):
            array[i, : len(values)] = values
    terms = monomials(table.basis, *np.moveaxis(feet, -1, 0))[: table.basis.size]
    noise = scaled_noise(table.measurement_std[rows], table.radius[rows])
    side = np.full(len(rows), SIDE)
    if residual_scale is not None:
        side = np.clip(_FINE * residual_scale.length / table.radius[rows], _FINEST, SIDE)
    return merged(PatchSamples(feet, terms, feet[..., 2] + value, weight, noise), side)


def _feet(table: PatchTable, row: int, points):
    """Feet (n, 3) of points (n, 3) on a patch, F at the points (n,) and weights (n,), scaled."""
    scaled = table.scaled_local(np.array([row]), points)
    value, upward = (values[0] for values in table.surface(np.array([row]), scaled))
    square = (upward * upward).sum(axis=1)
    return scaled[0] - (value / square)[:, None] * upward, value, 1.0 / square
