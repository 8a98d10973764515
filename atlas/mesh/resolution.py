"""How fine a surface is to be: edges of its triangles, and of the cubes that they start from."""

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.graph.outlines import Outlines
from touchatlas.atlas.graph.sheets import same_sheet
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import real

# Height of the arc over its chord that the triangles may have, in tolerances.
_SAGITTA = 0.02
# Or, where that is more, in deviations of the surface; asked of so many patches.
_UNSURE, _ASKED = 0.1, 64
_CURVATURE_QUANTILE = 0.9
# Of the cubes: in edges of the triangles, and of the smallest patch radius.
_MOST, _FRACTION = 6, 0.5
# Triangles along a crease, over its length.
_CREASE_FRACTION = 0.125
# Memory that a triangle takes while a surface is made, as measured: without and with creases,
# which bear no large cubes. And what a surface may take: more is a mistake, or no computer's.
_BYTES, _BYTES_CREASED, _MOST_BYTES = 100.0, 1200.0, 2.0**34
# Cosine of normals below which two sheets turn their backs to each other.
OPPOSED = -0.5
# Triangles are finer where sheets are near, but for the nearest of places (at a rim sheets come as
# near as one likes), and for what takes more squares than this on all cores.
_NEAREST, _MOST_SQUARES = 0.02, 2e5


def resolution(state: AtlasState, gaps) -> float:
    """Edge of the triangles: as long as the patches bear, and short enough to part sheets that are
    ``gaps`` (m,) apart."""
    return parting_edge(state.table, patch_resolution(state), gaps)


def parting_edge(table: PatchTable, edge: float, gaps) -> float:
    """An edge, or the one whose cubes are passed by one of two sheets at most, where these are
    ``gaps`` (m,) apart, if that is shorter."""
    parting = gaps / np.sqrt(3.0)
    parting = parting[np.pi * table.weight[table.rows].sum() <= _MOST_SQUARES * parting**2]
    return min(edge, float(np.quantile(parting, _NEAREST))) if len(parting) else edge


def patch_resolution(state: AtlasState) -> float:
    """Edge of the triangles that the patches bear, wherever other sheets are.

    It is the chord that leaves a sagitta of 0.02 tolerance, or a tenth of what the patches expect
    to be off, on all but the most curved tenth of the patches, and no more than half the smallest
    core.
    """
    table, rows = state.table, state.table.rows
    second = 2.0 * np.abs(table.mean[rows, 3:6]).max(axis=1) / table.radius[rows]
    if table.residuals:
        # Of residuals, too: the second derivative of a Matern process of smoothness 5/2 has the
        # standard deviation 5 a / l^2.
        rough, residual_scale = np.isin(rows, list(table.residuals)), state.residual_scale
        second[rough] = np.hypot(
            second[rough], 5.0 * residual_scale.amplitude / residual_scale.length**2
        )
    curvature = np.quantile(second, _CURVATURE_QUANTILE)
    sagitta = max(_SAGITTA * state.tolerance, _UNSURE * usual_deviation(state))
    chord = np.sqrt(8.0 * sagitta / max(curvature, np.finfo(float).tiny))
    core = table.core * table.radius[rows].min()
    along_creases = _CREASE_FRACTION * state.surface_graph.curves.typical_length()
    return float(min(chord, 0.5 * core, along_creases))


def check_edge(state: AtlasState, edge: float) -> float:
    """The edge of the triangles, if a surface of them can be made.

    Raises
    ------
    ValueError
        No length, longer than all patches together, or so short that the triangles would fill
        the memory. Equilateral ones are counted on the area of all cores, which overlap: about
        half of them come to be.
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
    need = (_BYTES_CREASED if state.creases else _BYTES) * area / (0.25 * np.sqrt(3.0))
    least = float(np.sqrt(need / _MOST_BYTES))
    if edge < least:
        raise ValueError(
            f"edge is {edge:.4g}: triangles so small would take more than "
            f"{_MOST_BYTES / 2**30:.0f} GB of memory; give one of {1.1 * least:.2g} or more"
        )
    return float(edge)


def usual_deviation(state: AtlasState) -> float:
    """Median of the predicted deviation half-way to the rims of some of the patches, length."""
    rows = state.table.rows
    some = rows[:: max(1, len(rows) // _ASKED)]
    outlines = state.surface_graph.outlines.points(some)
    points = 0.5 * (outlines + state.table.origin[some, None])
    # Off the surface patches are less sure than on it.
    seen = state.blend(_on_surface(state, points[:, ::4].reshape(-1, 3)))
    return float(np.median(seen.deviation[seen.known])) if seen.known.any() else 0.0


def _on_surface(state: AtlasState, points) -> np.ndarray:
    """Feet on the surface, to first order, of those of the points (n, 3) where it is known."""
    seen = state.blend(points)
    return (points - seen.distance[:, None] * seen.normal)[seen.known]


def cube_edge(field: Field, edge: float, gaps) -> float:
    """Edge of the cubes: as many of the triangles' edges as the patches bear, and the ``gaps`` (m,)
    between their sheets; with creases one."""
    if field.graph.creases:
        return edge
    most = _FRACTION * field.table.radius[field.table.rows].min() / edge
    # Sheets nearer to each other than a cube of the triangles' own edge stay unparted anyway.
    gaps = gaps / (np.sqrt(3.0) * edge)
    apart = gaps[gaps >= 1.0].min(initial=np.inf)
    return edge * max(1, int(min(_MOST, most, apart)))


def gaps_of(field: Field, outlines: Outlines, rows) -> np.ndarray:
    """(m,) distances between two sheets that turn their backs, or faces, to each other: from
    outlines and centres of the patches ``rows`` to the cores of patches of other sheets that they
    lie under or over."""
    table, rows = field.table, np.array(rows, int)
    places = np.concatenate([outlines.points(rows), table.origin[rows][:, None]], axis=1)
    home = np.repeat(rows, places.shape[1])
    places = places.reshape(-1, 3)
    who, which = table.index.near(places)
    mine = home[which]
    opposed = (table.axes[who, 2] * table.axes[mine, 2]).sum(axis=1) < OPPOSED
    opposed[opposed] &= ~same_sheet(field.graph.neighbours, mine[opposed], who[opposed])
    who, which = who[opposed], which[opposed]
    distance, _, own = field.distances(who, places[which])
    return np.abs(distance[own])
