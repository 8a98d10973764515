"""Residuals of an atlas's patches: learned when its surface is wanted, gone when a patch learns."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.atlas.moments import SHEET_COSINE, facing, solve
from touchatlas.atlas.patch_samples import PatchSamples, merged
from touchatlas.atlas.residual import Residual, solve_residual
from touchatlas.atlas.table import Table
from touchatlas.atlas.texture import Texture, learn_texture, roughness
from touchatlas.patch.polynomial import Basis, monomials
from touchatlas.patch.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    scaled_noise,
)

# The texture is learned from so many patches at most, and residuals so many at once.
_ASKED, _AT_ONCE = 12, 32


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


def learn_residuals(table: Table, kin: list[set[int]], samples, prior: SmoothnessPrior) -> Texture:
    """Give every patch a residual that the evidence asks for; returns the surface's texture.

    Parameters
    ----------
    table : Table
        Its ``rough`` is filled, and of these patches mean and covariance become the trend's.
    kin : list of set of int
    samples : list of (points (n, 3), normals (n, 3))
        Of each patch.
    prior : SmoothnessPrior
    """
    solve(table, np.array(sorted(table.rough), int))
    rows = np.arange(table.size)
    asked = rows[:: max(1, -(-table.size // _ASKED))]
    texture = Texture()
    if len(rows):
        some = samples_of(table, kin, samples, asked)
        texture = learn_texture(table.basis, some, table.radius[asked], prior)
    if not texture.amplitude > 0:
        return texture
    for some in np.array_split(rows, -(-len(rows) // _AT_ONCE)):
        _learn(table, some, samples_of(table, kin, samples, some), texture, prior)
    return texture


def _learn(table: Table, rows, samples: PatchSamples, texture: Texture, prior) -> None:
    found = roughness(table.basis, samples, texture, table.radius[rows], prior)
    length = texture.length / table.radius[rows]
    shapes = np.stack([found.amplitude, length, found.turn, found.bend], axis=1)
    for i in np.flatnonzero(found.rough).tolist():
        enter(table, int(rows[i]), rough_patch(table.basis, samples.only(i), shapes[i]))


def enter(table: Table, row: int, rough: RoughPatch) -> None:
    """Make a patch of the table a rough one."""
    table.rough[row] = rough
    table.mean[row], table.covariance[row] = rough.mean, rough.covariance


def samples_of(table: Table, kin: list[set[int]], samples, rows) -> PatchSamples:
    """What the rows' patches and their kin touched of their sheets within their radius."""
    parts = []
    for row in rows.tolist():
        members = sorted(kin[row] | {row})
        points = np.concatenate([samples[i][0] for i in members])
        normals = np.concatenate([samples[i][1] for i in members])
        parts.append(_feet(table, row, points, normals))
    width = max(len(lift) for _, lift, _ in parts)
    feet = np.zeros((len(parts), width, 3))
    lift, weight = np.zeros((2, len(parts), width))
    for i, part in enumerate(parts):
        for array, values in zip((feet, lift, weight), part, strict=True):
            array[i, : len(values)] = values
    terms = monomials(table.basis, *np.moveaxis(feet, -1, 0))[: table.basis.size]
    noise = scaled_noise(table.sensor[rows], table.radius[rows])
    return merged(PatchSamples(feet, terms, feet[..., 2] + lift, weight, noise))


def _feet(table: Table, row: int, points, normals):
    """Feet (n, 3), F (n,) and weights (n,) of the points that belong to a patch, scaled."""
    rows = np.array([row])
    scaled = table.scaled_local(rows, points)
    inside = facing(table, rows, scaled, normals, SHEET_COSINE)[0]
    inside &= (scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0
    scaled = scaled[0, inside]
    value, upward = (values[0] for values in table.surface(rows, scaled[None]))
    square = (upward * upward).sum(axis=1)
    return scaled - (value / square)[:, None] * upward, value, 1.0 / square
