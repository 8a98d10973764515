"""Resolution: how near triangles come to the surface, and the cubes that they start from."""

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.graph.outlines import Outlines
from touchatlas.atlas.graph.sheets import same_sheet
from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import real

# Largest sagitta of the edge that resolves the patches, the height of the arc over the chord, in
# tolerances. Doubled, rims are ragged by 1.4 times as much.
_SAGITTA = 0.15
# The same in predicted deviations, where that is more, and the number of patches for which the
# deviation is predicted. With either doubled, half as many triangles or twice the time of that.
_DEVIATION_FRACTION, _SAMPLED_PATCHES = 0.1, 64
# Quantile of the patches' curvatures that sets the edge, so that single patches do not. With twice
# the rest left out, 0.8, edges of objects with a few curved places are longer.
_CURVATURE_QUANTILE = 0.9
# Largest distance of the surface from an edge, over that from a triangle: between the places where
# it is predicted it is a little farther. Doubled, one triangle in a thousand is beyond the option.
_MARGIN = 0.8
# Largest edge of the cubes: in edges that resolve the patches, and over the smallest patch radius.
# Doubled, features of the size of a patch fall between the corners.
_MOST_PARTS, _RADIUS_FRACTION = 6, 0.5
# Most squares of the smallest patch's edge on all cores, no unit. Doubled, a large body with tiny
# patches takes twice the time, and fewer of them fall between the corners of cubes.
_MOST_CUBES = 5e5
# Memory per triangle while a surface is made, bytes, as measured, and its limit: 16 GB; doubled,
# few computers hold the surface.
_BYTES, _MOST_BYTES = 100.0, 2.0**34
# Cosine between normals below which two sheets are the two sides of a wall or of a slit, no unit:
# 120 degrees. Doubled, none are.
OPPOSED = -0.5
# Quantile of the distances between sheets that sets the edge, because at a rim sheets come as near
# as one likes. And the largest number of squares of the edge on all cores, beyond which sheets are
# not separated. Doubled, the first leaves out more thin walls, the second fewer.
_GAP_QUANTILE, _MOST_SQUARES = 0.02, 2e5


def resolution(state: AtlasState, gaps) -> float:
    """Edge that resolves the patches, length: short enough to separate sheets that are ``gaps``
    (m,) apart."""
    return separating_edge(state.table, patch_resolution(state), gaps)


def separating_edge(table: PatchTable, edge: float, gaps) -> float:
    """``edge``, or the longest edge of cubes that no two sheets ``gaps`` (m,) apart can both pass,
    if that is shorter, length."""
    diagonal = gaps / np.sqrt(3.0)
    diagonal = diagonal[np.pi * table.weight[table.rows].sum() <= _MOST_SQUARES * diagonal**2]
    return min(edge, float(np.quantile(diagonal, _GAP_QUANTILE))) if len(diagonal) else edge


def patch_resolution(state: AtlasState) -> float:
    """Edge that resolves the patches, without regard to other sheets, length.

    It is the chord with a sagitta of 0.15 tolerances, or of a tenth of the predicted deviation if
    that is more, at the 90 % quantile of the patches' curvatures. It is no more than half the
    smallest core radius.
    """
    table, rows = state.table, state.table.rows
    second = 2.0 * np.abs(table.mean[rows, 3:6]).max(axis=1) / table.radius[rows]
    if table.residuals:
        # The second derivative of a Matern process of smoothness 5/2 has the standard deviation
        # 5 a / l^2.
        has_residual, scale = np.isin(rows, list(table.residuals)), state.residual_scale
        second[has_residual] = np.hypot(
            second[has_residual], 5.0 * scale.amplitude / scale.length**2
        )
    curvature = np.quantile(second, _CURVATURE_QUANTILE)
    sagitta = max(_SAGITTA * state.tolerance, _DEVIATION_FRACTION * usual_deviation(state))
    chord = np.sqrt(8.0 * sagitta / max(curvature, np.finfo(float).tiny))
    core = table.core * table.radius[rows].min()
    # A few tiny patches do not make the triangles of a large body tiny.
    least = np.sqrt(np.pi * table.weight[rows].sum() / _MOST_CUBES)
    return float(min(chord, max(0.5 * core, least)))


def facet_bound(state: AtlasState) -> float:
    """Largest distance of the surface from edges of triangles, length."""
    return _MARGIN * state.options.facets * state.tolerance


def check_edge(state: AtlasState, edge: float) -> float:
    """The edge of the triangles, if a surface of them can be made.

    Raises
    ------
    ValueError
        No length, longer than the patches span, or so short that the triangles would fill the
        memory. The estimate counts equilateral triangles on the area of all cores. Because cores
        overlap it is about twice the true number.
    """
    table, rows = state.table, state.table.rows
    radius = table.radius[rows, None]
    high, low = (table.origin[rows] + radius).max(0), (table.origin[rows] - radius).min(0)
    most = float((high - low).max())
    if not 0.0 < real(edge) <= most:
        raise ValueError(
            f"edge is {edge}; it must be a length > 0 and no more than the {most:.4g} that the "
            "patches span: leave it out for a fitting one"
        )
    area = np.pi * table.weight[rows].sum()
    need = _BYTES * area / (0.25 * np.sqrt(3.0))
    least = float(np.sqrt(need / _MOST_BYTES))
    if edge < least:
        raise ValueError(
            f"edge is {edge:.4g}: triangles so small would take more than "
            f"{_MOST_BYTES / 2**30:.0f} GB of memory; give one of {1.1 * least:.2g} or more"
        )
    return float(edge)


def usual_deviation(state: AtlasState) -> float:
    """Median predicted deviation half-way to the rims of some of the patches, length."""
    rows = state.table.rows
    some = rows[:: max(1, len(rows) // _SAMPLED_PATCHES)]
    outlines = state.surface_graph.outlines.points(some)
    points = 0.5 * (outlines + state.table.origin[some, None])
    points = points[:, ::4].reshape(-1, 3)
    # The deviation is larger off the surface, so it is predicted at first-order feet on it.
    seen = blend_of_patches(state, points)
    feet = (points - seen.distance[:, None] * seen.normal)[seen.known]
    seen = blend_of_patches(state, feet)
    return float(np.median(seen.deviation[seen.known])) if seen.known.any() else 0.0


def cube_edge(field: Field, edge: float, gaps) -> float:
    """Edge of the cubes, length: as large as the patches and the ``gaps`` (m,) between their sheets
    allow, up to six times the ``edge`` that resolves the patches."""
    most = _RADIUS_FRACTION * field.table.radius[field.table.rows].min()
    # Even the smallest cubes do not separate sheets that are nearer than their diagonal.
    apart = gaps / np.sqrt(3.0)
    apart = apart[apart >= edge].min(initial=np.inf)
    return float(max(edge, min(_MOST_PARTS * edge, most, apart)))


def gaps_of(field: Field, outlines: Outlines, rows) -> np.ndarray:
    """(m,) distances between sheets of opposed normals, length.

    They are measured from the outlines and origins of the patches ``rows`` to patches of other
    sheets, where the foot lies in the cell of that patch.
    """
    table, rows = field.table, np.array(rows, int)
    points = np.concatenate([outlines.points(rows), table.origin[rows][:, None]], axis=1)
    home = np.repeat(rows, points.shape[1])
    points = points.reshape(-1, 3)
    others, which = table.index.near(points)
    mine = home[which]
    opposed = (table.axes[others, 2] * table.axes[mine, 2]).sum(axis=1) < OPPOSED
    opposed[opposed] &= ~same_sheet(field.graph.neighbours, mine[opposed], others[opposed])
    others, which = others[opposed], which[opposed]
    distance, _, own = field.distances(others, points[which])
    return np.abs(distance[own])
