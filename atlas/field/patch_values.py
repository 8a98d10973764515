"""What each patch says at the points it reaches, many patches in one numpy call.

Pairs of a patch and a point are laid out in padded groups: lines of a patch's points, patches
with about as many points in one array, so that every product is a stack of matrix products.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.graph.power_diagram import CELL_MARGIN
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
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

# Where no kin has less power a patch is asked beyond its core, nearly as far as its contours
# reach (0.98 R for a core of 0.75 R): how sure it is there, its deviation says.
COVER_MARGIN = 0.7
# Points of a line, and pairs and patches of a group: what fits the caches.
_WIDTHS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256])
_PAIRS, _LINES = 2048, 512
_ALL = (*GRADIENT, XX, XY, YY, XZ, YZ, ZZ)


@dataclass(frozen=True, eq=False)
class PatchValues:
    """What patches say at points, a pair each (m,).

    Parameters
    ----------
    distance : (m,) float, length
        First order, signed, to the pair's patch.
    weight : (m,) float
        How near the patch's centre is and how sure it is; 0 where it has no say.
    numbers : (m, 6) float
        Distance, variance (length^2), Gaussian curvature (1/length^2), unit normal (3).
    own : (m,) bool
        Whether the foot of the point lies in the patch's own cell.
    covers : (m,) bool, optional
        Where there are creases: the same, but for those that the cell ends at.
    """

    distance: np.ndarray
    weight: np.ndarray
    numbers: np.ndarray
    own: np.ndarray
    covers: np.ndarray | None = None


def groups(rows: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Padded groups of equal rows: rows (m,) and indices (m, k) into ``rows``, lines filled up
    with their last index.

    >>> [(r.tolist(), i.tolist()) for r, i in groups(np.array([5, 2, 5, 5]))]
    [([2], [[1]]), ([5], [[0, 2, 3]])]
    """
    narrow = len(rows) and rows.max() < 1 << 16
    # numpy sorts integers of 16 bits in linear time.
    order = np.argsort(rows.astype(np.uint16) if narrow else rows, kind="stable")
    ordered = rows[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]][: len(rows)])
    counts = np.diff(np.r_[starts, len(rows)])
    lines = -(-counts // _WIDTHS[-1])
    part = np.arange(lines.sum()) - np.repeat(np.cumsum(lines) - lines, lines)
    starts = np.repeat(starts, lines) + part * _WIDTHS[-1]
    counts = np.minimum(np.repeat(counts, lines) - part * _WIDTHS[-1], _WIDTHS[-1])
    kind = np.searchsorted(_WIDTHS, counts)
    for k in np.unique(kind).tolist():
        of_kind, width = np.flatnonzero(kind == k), int(_WIDTHS[k])
        step = max(1, min(_LINES, _PAIRS // width))
        for i in range(0, len(of_kind), step):
            chosen = of_kind[i : i + step]
            inside = np.minimum(np.arange(width), counts[chosen, None] - 1)
            yield ordered[starts[chosen]], order[starts[chosen, None] + inside]


def patch_values(table: PatchTable, graph: SurfaceGraph, rows, points, reach: float) -> PatchValues:
    """What the patches ``rows`` (m,) say at world points (m, 3), a pair each.

    Patches farther than ``reach`` from a point have no say there.
    """
    count, lines = len(rows), graph.neighbours.lines()
    out = PatchValues(np.empty(count), np.empty(count), np.empty((count, 6)), np.empty(count, bool))
    for patches, index in groups(rows):
        _fill_values(table, lines, patches, index, points[index], reach, out)
    if graph.creases:
        seen = graph.visibility.sees(
            rows, points - out.distance[:, None] * out.numbers[:, 3:], out.own
        )
        return replace(out, own=seen, covers=out.own)
    return out


def distances(
    table: PatchTable,
    graph: SurfaceGraph,
    rows,
    points,
    reach: float,
    trimmed: bool = True,
    plain: bool = False,
):
    """Of the same pairs only the distance (m,), the unit normal (m, 3), and whether the foot is
    in the patch's own cell (m,): if ``trimmed``, as it ends at creases; if ``plain``, by the
    polynomials alone, which hold farther off the surface than those that residuals go with."""
    count, lines = len(rows), graph.neighbours.lines()
    distance, normals, own = np.empty(count), np.empty((count, 3)), np.empty(count, bool)
    for patches, index in groups(rows):
        here = _PatchesAtPoints(table, patches, points[index], GRADIENT, plain)
        distance[index], normals[index] = here.distance, here.normals
        own[index] = here.own(table, lines, patches, here.inside(reach))
    if graph.creases and trimmed:
        own = graph.visibility.sees(rows, points - distance[:, None] * normals, own)
    return distance, normals, own


def _fill_values(table: PatchTable, lines, rows, index, points, reach, out: PatchValues) -> None:
    """Fill in what the patches ``rows`` (m,) say at points (m, k, 3), pairs ``index`` (m, k)."""
    radius, here = table.radius[rows][:, None], _PatchesAtPoints(table, rows, points, _ALL)
    inside = here.inside(reach)
    terms = here.terms[:, : table.basis.size]
    variance = table.variance_at(rows, terms)
    beyond = left_out(table, rows, here.scaled)
    for i, rough, shared in here.residuals:
        here_only = terms[[i]].transpose(1, 0, 2)
        variance[i] = joint_variance(rough.residual, rough.covariance[None], here_only, shared)[0]
        # A residual leaves nothing out but what it says itself.
        beyond[i] = 0.0
    variance = (radius / here.stretch) ** 2 * variance + np.finfo(float).tiny
    closeness = np.where(inside, np.maximum(1.0 - here.sum_of_squares, 0.0), 0.0)
    out.distance[index] = here.distance
    out.weight[index] = closeness * closeness * closeness / variance
    beyond *= (radius / here.stretch) ** 2
    out.numbers[index, 0], out.numbers[index, 1] = here.distance, variance + beyond
    with np.errstate(all="ignore"):
        px, py, pz, *second = here.derivatives
        pxx, pxy, pyy, pxz, pyz, pzz = second
        graph = graph_derivatives(px, py, pxx, pxy, pyy, pz, pxz, pyz, pzz)
        curvature = gaussian_curvature(*graph) / radius**2
    out.numbers[index, 2] = np.where(closeness > 0.0, curvature, 0.0)
    out.numbers[index, 3:] = here.normals
    out.own[index] = here.own(table, lines, rows, inside)


class _PatchesAtPoints:
    """Points (m, k, 3) as seen from patches (m,): what several questions about them share."""

    def __init__(self, table: PatchTable, rows, points, which, plain: bool = False) -> None:
        self._radius = radius = table.radius[rows][:, None]
        self._offset = points - table.site[rows][:, None]
        self.scaled = table.scaled_local(rows, points)
        x, y, z = np.ascontiguousarray(np.moveaxis(self.scaled, -1, 0))
        self.terms = monomials(table.basis, x, y, z).transpose(1, 0, 2)
        is_rough = (
            np.isin(rows, list(table.residuals)) if table.residuals else np.zeros(len(rows), bool)
        )
        mean = table.mean[rows]
        if plain:
            mean[is_rough] = table.linearisation_point[rows[is_rough]]
        rows_of = derivative_coefficients(table.basis, mean, list(which))
        phi, *self.derivatives = np.ascontiguousarray(np.moveaxis(rows_of @ self.terms, 1, 0))
        px, py, pz = self.derivatives[:3]
        self.residuals = []
        for i in () if plain else np.flatnonzero(is_rough).tolist():
            rough = table.residuals[int(rows[i])]
            detail, slope, shared = residual_at(rough.residual, self.scaled[[i]])
            phi[i] += detail[0]
            px[i], py[i], pz[i] = (d[i] + s for d, s in zip((px, py, pz), slope[0].T, strict=True))
            self.residuals.append((i, rough, shared))
        upward = np.stack([-px, -py, 1.0 - pz], axis=-1)
        length = np.sqrt(_square(upward))
        self.stretch = np.maximum(length, np.finfo(float).tiny)
        self.distance = radius * (z - phi) / self.stretch
        self.normals = (upward / self.stretch[..., None]) @ table.axes[rows]
        self._across = x * x + y * y
        # Where f = z - phi falls with z the next zero is of another sheet than the samples'.
        self._rising = pz < 1.0
        self.sum_of_squares = self._across + z * z

    def inside(self, reach: float) -> np.ndarray:
        """(m, k) whether the patch has a say at all."""
        near = np.abs(self.distance) <= np.minimum(reach, 0.5 * self._radius)
        return near & (self._across <= 1.0) & self._rising

    def own(self, table: PatchTable, lines, rows, inside) -> np.ndarray:
        """(m, k) whether the feet of points ``inside`` lie in the patches' own cells."""
        power = table.weight[rows][:, None]
        feet = self._offset - self.distance[..., None] * self.normals
        own = inside & (_square(feet) <= (1.0 + COVER_MARGIN) * power)
        some = own.any(axis=1)
        own[some] &= _is_lowest(table, lines[rows[some]], rows[some], feet[some])
        return own


def _is_lowest(table: PatchTable, neighbours, rows, feet) -> np.ndarray:
    """(m, k) whether at feet (m, k, 3), from the patches' sites, no kin (m, w) of the rows (m,)
    has less power than they, or hardly less."""
    power = table.weight[rows]
    neighbours = neighbours[:, : max(1, int((neighbours != rows[:, None]).any(axis=0).sum()))]
    # What a rival's power is above one's own: linear in the foot.
    apart = table.site[neighbours] - table.site[rows][:, None]
    excess = _square(apart) - table.weight[neighbours] + power[:, None]
    above = excess[:, None] - 2.0 * (feet @ apart.transpose(0, 2, 1))
    return above.min(axis=-1) >= -CELL_MARGIN * power[:, None]


def _square(vectors) -> np.ndarray:
    """(m, k) squared lengths of vectors (m, k, 3)."""
    return np.einsum("mki,mki->mk", vectors, vectors)
