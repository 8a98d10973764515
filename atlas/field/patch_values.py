"""Patch values: distance, normal, variance and curvature of single patches at points.

Pairs of a patch and a point are put into padded groups, so that every product is a stack of matrix
products.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.padded_groups import groups
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
from touchatlas.atlas.patches.intersect import HEIGHT_LIMIT
from touchatlas.atlas.patches.normal_equations import left_out
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.residual.gaussian_process import joint_variance, residual_at
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    derivative_coefficients,
    gaussian_curvature,
    graph_derivatives,
    monomials,
)

# Power up to which a patch is evaluated where no sheet neighbour has less, as a fraction of the
# weight: nearly as far as its contours reach, 0.98 R for a core of 0.75 R. Its deviation tells how
# uncertain it is there. Doubled, patches are extrapolated to 1.16 R.
COVER_MARGIN = 0.7
# Largest rise of a patch over the way from its origin: a circle that turns by 60 degrees, the most
# that a core may turn, rises by tan 30 degrees. Doubled, points nearer to the axis are taken for
# outside that are inside.
_STEEPEST = np.tan(np.pi / 6.0)
# Height below which the side is not asked, in patch radii: an origin lies off its patch by less.
# Doubled, zeros nearer to the patch are taken for its surface.
_LEAST_HEIGHT = 0.1
# Derivatives for distance, normal and curvature.
_ALL = (*GRADIENT, XX, XY, YY, XZ, YZ, ZZ)


@dataclass(frozen=True, eq=False)
class PatchValues:
    """Values of patches at points, for m pairs of a patch and a point.

    Parameters
    ----------
    distance : (m,) float, length
        First-order distance to the patch, positive outside.
    weight : (m,) float, 1/length^2
        Weight in the blend: (1 - r^2)^3 over the variance, with the scaled distance r of the point
        from the origin; 0 where the patch is not evaluated.
    numbers : (m, 6) float
        Distance, variance (length^2), Gaussian curvature (1/length^2), unit normal (3).
    own : (m,) bool
        Whether the foot of the point lies in the patch's cell.
    """

    distance: np.ndarray
    weight: np.ndarray
    numbers: np.ndarray
    own: np.ndarray


def patch_values(
    table: PatchTable, graph: SurfaceGraph, rows, points, reach: float, curved: bool = True
) -> PatchValues:
    """Values of patches ``rows`` (m,) at world points (m, 3), one patch for each point.

    Patches farther than ``reach`` (length) from a point are not evaluated there. Without
    ``curved`` the curvatures are NaN.
    """
    count, lines = len(rows), graph.neighbours.lines()
    out = PatchValues(np.empty(count), np.empty(count), np.empty((count, 6)), np.empty(count, bool))
    for patches, index in groups(rows):
        here = _PatchesAtPoints(table, patches, points[index], _ALL if curved else GRADIENT)
        _fill_values(table, lines, patches, index, here, reach, out)
    return out


def distances(
    table: PatchTable,
    graph: SurfaceGraph,
    rows,
    points,
    reach: float,
    plain: bool = False,
):
    """Distances and normals only, of patches ``rows`` (m,) at world points (m, 3).

    Parameters
    ----------
    table : PatchTable
    graph : SurfaceGraph
    rows : (m,) int
    points : (m, 3) float, length, world
    reach : float, length
        Patches farther than this from a point are not evaluated there.
    plain : bool
        Whether to evaluate polynomials without residuals: they hold farther from the surface.

    Returns
    -------
    distance : (m,) float, length
    normals : (m, 3) float, unit, world
    own : (m,) bool
        Whether the foot of the point lies in the patch's cell.
    """
    count, lines = len(rows), graph.neighbours.lines()
    distance, normals, own = np.empty(count), np.empty((count, 3)), np.empty(count, bool)
    for patches, index in groups(rows):
        here = _PatchesAtPoints(table, patches, points[index], GRADIENT, plain)
        distance[index], normals[index] = here.distance, here.normals
        own[index] = here.own(table, lines, patches, here.inside(reach))
    return distance, normals, own


def _fill_values(table: PatchTable, lines, rows, index, here, reach, out: PatchValues) -> None:
    """Fill in the values of patches ``rows`` (m,) at their points, as they are evaluated ``here``,
    at pairs ``index`` (m, k)."""
    radius, inside = table.radius[rows][:, None], here.inside(reach)
    variance, beyond = _variances(table, rows, here)
    scale = (radius / here.stretch) ** 2
    variance = scale * variance + np.finfo(float).tiny
    closeness = np.where(inside, np.maximum(1.0 - here.square, 0.0), 0.0)
    out.distance[index] = here.distance
    out.weight[index] = closeness * closeness * closeness / variance
    out.numbers[index, 0], out.numbers[index, 1] = here.distance, variance + beyond * scale
    out.numbers[index, 2] = np.where(closeness > 0.0, here.curvature(), 0.0)
    out.numbers[index, 3:] = here.normals
    out.own[index] = here.own(table, lines, rows, inside)


def _variances(table: PatchTable, rows, here: "_PatchesAtPoints") -> tuple[np.ndarray, np.ndarray]:
    """Variances (m, k) of phi of patches ``rows`` (m,), scaled, and of the terms above their
    degree."""
    terms = here.terms[:, : table.basis.size]
    variance = table.variance_at(rows, terms)
    beyond = left_out(table, rows, here.scaled)
    for i, own, shared in here.residuals:
        own_terms = terms[[i]].transpose(1, 0, 2)
        variance[i] = joint_variance(own.residual, own.covariance[None], own_terms, shared)[0]
        # The variance of a residual contains the terms above the degree.
        beyond[i] = 0.0
    return variance, beyond


class _PatchesAtPoints:
    """Patches (m,) evaluated at points (m, k, 3), with their residuals unless ``plain``."""

    def __init__(self, table: PatchTable, rows, points, which, plain: bool = False) -> None:
        self._radius = radius = table.radius[rows][:, None]
        self._offset = points - table.site[rows][:, None]
        self.scaled = table.scaled_local(rows, points)
        x, y, z = np.ascontiguousarray(np.moveaxis(self.scaled, -1, 0))
        self.terms = monomials(table.basis, x, y, z).transpose(1, 0, 2)
        with_residual = [i for i, row in enumerate(rows.tolist()) if row in table.residuals]
        mean = table.mean[rows]
        if plain:
            mean[with_residual] = table.linearisation_point[rows[with_residual]]
        coefficients = derivative_coefficients(table.basis, mean, list(which))
        phi, *self.derivatives = np.ascontiguousarray(np.moveaxis(coefficients @ self.terms, 1, 0))
        px, py, pz = self.derivatives[:3]
        self.residuals = []
        for i in () if plain else with_residual:
            own = table.residuals[int(rows[i])]
            detail, slope, shared = residual_at(own.residual, self.scaled[[i]])
            phi[i] += detail[0]
            px[i], py[i], pz[i] = (d[i] + s for d, s in zip((px, py, pz), slope[0].T, strict=True))
            self.residuals.append((i, own, shared))
        upward = np.stack([-px, -py, 1.0 - pz], axis=-1)
        length = np.sqrt(_square(upward))
        self.stretch = np.maximum(length, np.finfo(float).tiny)
        self.distance = radius * (z - phi) / self.stretch
        self.normals = (upward / self.stretch[..., None]) @ table.axes[rows]
        self._across = x * x + y * y
        # Where F = z - phi decreases with z, its next zero is not the sheet of the samples.
        self._rising = pz < 1.0
        self.square = self._across + z * z

    def inside(self, reach: float) -> np.ndarray:
        """(m, k) whether the patch is evaluated at the point: it is within reach and radius."""
        near = np.abs(self.distance) <= np.minimum(reach, HEIGHT_LIMIT * self._radius)
        near &= ~on_wrong_side(self.scaled, self.distance)
        return near & (self._across <= 1.0) & self._rising

    def curvature(self) -> np.ndarray:
        """(m, k) Gaussian curvature, 1/length^2; NaN without second derivatives."""
        px, py, pz, *second = self.derivatives
        if not second:
            return np.full_like(px, np.nan)
        pxx, pxy, pyy, pxz, pyz, pzz = second
        with np.errstate(all="ignore"):
            graph = graph_derivatives(px, py, pxx, pxy, pyy, pz, pxz, pyz, pzz)
            found: np.ndarray = gaussian_curvature(*graph) / self._radius**2
        return found

    def own(self, table: PatchTable, lines, rows, inside) -> np.ndarray:
        """(m, k) whether the feet of points ``inside`` (m, k) lie in the patches' cells. ``lines``
        are the sheet neighbours of all rows."""
        weight = table.weight[rows][:, None]
        feet = self._offset - self.distance[..., None] * self.normals
        own = inside & (_square(feet) <= (1.0 + COVER_MARGIN) * weight)
        some = own.any(axis=1)
        own[some] &= _is_lowest(table, lines[rows[some]], rows[some], feet[some])
        return own


def on_wrong_side(scaled, distance) -> np.ndarray:
    """(...) whether distances of points (..., 3), scaled, are to another zero than that of the
    samples: the points lie steeply above or below a patch, where its side is known."""
    z = scaled[..., 2]
    steep = np.abs(z) > _LEAST_HEIGHT + _STEEPEST * np.hypot(scaled[..., 0], scaled[..., 1])
    return np.asarray(steep & (z * distance < 0.0))


def _is_lowest(table: PatchTable, neighbours, rows, feet) -> np.ndarray:
    """(m, k) whether no neighbour (m, w) of rows (m,) has less power than the row by more than
    CELL_MARGIN, at feet (m, k, 3) given from the row's site."""
    weight = table.weight[rows]
    neighbours = neighbours[:, : max(1, int((neighbours != rows[:, None]).any(axis=0).sum()))]
    # The power of a neighbour less that of the row is linear in the foot.
    apart = table.site[neighbours] - table.site[rows][:, None]
    excess = _square(apart) - table.weight[neighbours] + weight[:, None]
    above = excess[:, None] - 2.0 * (feet @ apart.transpose(0, 2, 1))
    return above.min(axis=-1) >= -CELL_MARGIN * weight[:, None]


def _square(vectors) -> np.ndarray:
    """(m, k) squared lengths of vectors (m, k, 3)."""
    return np.einsum("mki,mki->mk", vectors, vectors)
