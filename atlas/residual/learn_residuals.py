"""Residuals of an atlas's patches: learned when its surface is wanted, gone when a patch learns."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.atlas.patches.normal_equations import solve
from touchatlas.atlas.patches.patch_table import Table
from touchatlas.atlas.patches.sample_membership import Learning
from touchatlas.atlas.residual.binned_samples import SIDE, PatchSamples, merged
from touchatlas.atlas.residual.gaussian_process import Residual, solve_residual
from touchatlas.atlas.residual.hyperparameters import Texture, learn_texture, roughness
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
class RoughPatch:
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


def rough_patch(basis: Basis, samples: PatchSamples, shape) -> RoughPatch:
    """Trend and residual of one patch (a stack of one) from its samples."""
    # Of one layout in memory, so that what is read from a file is solved to the last bit.
    samples = PatchSamples(
        *(np.ascontiguousarray(getattr(samples, field.name)) for field in fields(samples))
    )
    amplitude, length, turn, bend = shape[:, None]
    precision = coefficient_precision(basis, turn, bend)
    mean, covariance, residual = solve_residual(samples, amplitude, length, precision)
    return RoughPatch(samples, shape, mean[0], covariance[0], residual)


def learn_residuals(table: Table, learning: Learning, prior: SmoothnessPrior) -> Texture:
    """Give every patch a residual that the evidence asks for; returns the surface's texture.

    Parameters
    ----------
    table : Table
        Its ``rough`` is filled, and of these patches mean and variance become the trend's.
    learning : Learning
        The samples of each patch.
    prior : SmoothnessPrior
    """
    solve(table, np.array(sorted(table.rough), int))
    rows = table.rows
    asked = rows[:: max(1, -(-len(rows) // _ASKED))]
    texture = Texture()
    if len(rows):
        some = samples_of(table, learning, asked)
        texture = learn_texture(table.basis, some, table.radius[asked], prior)
    if not texture.amplitude > 0:
        return texture
    for some in np.array_split(rows, -(-len(rows) // _AT_ONCE)):
        _learn(table, learning, some, texture, prior)
    return texture


def _learn(table: Table, learning: Learning, rows, texture: Texture, prior) -> None:
    samples = samples_of(table, learning, rows)
    found = roughness(table.basis, samples, texture, table.radius[rows], prior)
    length = texture.length / table.radius[rows]
    shapes = np.stack([found.amplitude, length, found.turn, found.bend], axis=1)
    rows, shapes = rows[found.rough], shapes[found.rough]
    if len(rows):
        fine = samples_of(table, learning, rows, texture)
        for i, row in enumerate(rows.tolist()):
            enter(table, row, rough_patch(table.basis, fine.only(i), shapes[i]))


def enter(table: Table, row: int, rough: RoughPatch) -> None:
    """Make a patch of the table a rough one."""
    table.rough[row] = rough
    table.mean[row], table.variance[row] = rough.mean, table.products.folded(rough.covariance)


def samples_of(
    table: Table, learning: Learning, rows, texture: Texture | None = None
) -> PatchSamples:
    """What the rows' patches learned from, at its feet on them, merged: some 200 a patch, or as
    many as a texture asks for."""
    parts = [
        _feet(table, row, learning.pool.points[learning.members[row]]) for row in rows.tolist()
    ]
    width = max(len(lift) for _, lift, _ in parts)
    feet = np.zeros((len(parts), width, 3))
    lift, weight = np.zeros((2, len(parts), width))
    for i, part in enumerate(parts):
        for array, values in zip((feet, lift, weight), part, strict=True):
            array[i, : len(values)] = values
    terms = monomials(table.basis, *np.moveaxis(feet, -1, 0))[: table.basis.size]
    noise = scaled_noise(table.sensor[rows], table.radius[rows])
    side = np.full(len(rows), SIDE)
    if texture is not None:
        side = np.clip(_FINE * texture.length / table.radius[rows], _FINEST, SIDE)
    return merged(PatchSamples(feet, terms, feet[..., 2] + lift, weight, noise), side)


def _feet(table: Table, row: int, points):
    """Feet (n, 3), F (n,) and weights (n,) of points (n, 3) on a patch, scaled."""
    scaled = table.scaled_local(np.array([row]), points)
    value, upward = (values[0] for values in table.surface(np.array([row]), scaled))
    square = (upward * upward).sum(axis=1)
    return scaled[0] - (value / square)[:, None] * upward, value, 1.0 / square
