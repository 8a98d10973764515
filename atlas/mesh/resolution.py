"""How fine a surface is to be: edges of its triangles, and of the cubes that they start from."""

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.field.patch_values import distances
from touchatlas.atlas.graph.sheets import SheetNeighbours, same_sheet
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import real

# Height of the arc over its chord that the triangles may have, in tolerances.
_SAGITTA = 0.02
# Or, where that is more, in deviations of the surface; asked of so many patches.
_UNSURE, _ASKED = 0.1, 64
_CURVATURE_QUANTILE = 0.9
# Of the cubes: in edges of the triangles, and of the smallest patch radius.
_MOST, _SHARE = 6, 0.5
# Triangles along a crease, over its length.
_CREASE_SHARE = 0.125
# Memory that a triangle takes while a surface is made, as measured: without and with creases,
# which bear no large cubes. And what a surface may take: more is a mistake, or no computer's.
_BYTES, _BYTES_CREASED, _MOST_BYTES = 100.0, 1200.0, 2.0**34
# Cosine of normals below which two sheets turn their backs to each other.
OPPOSED = -0.5
# Triangles are finer where sheets are near, but for the nearest of places (at a rim sheets come as
# near as one likes), and for what takes more squares than this on all cores.
_NEAREST, _MOST_SQUARES = 0.02, 2e5


def resolution(atlas: Atlas, deviation: float | None = None) -> float:
    """Edge of the triangles: as long as the patches bear, and short enough to part sheets."""
    gaps = gaps_of(atlas.table, atlas.neighbours, atlas.table.rows)
    return parting_edge(atlas.table, patch_resolution(atlas, deviation), gaps)


def parting_edge(table: PatchTable, edge: float, gaps) -> float:
    """An edge, or the one whose cubes are passed by one of two sheets at most, where these are
    ``gaps`` (m,) apart, if that is shorter."""
    parting = gaps / np.sqrt(3.0)
    parting = parting[np.pi * table.weight[table.rows].sum() <= _MOST_SQUARES * parting**2]
    return min(edge, float(np.quantile(parting, _NEAREST))) if len(parting) else edge


def patch_resolution(atlas: Atlas, deviation: float | None = None) -> float:
    """Edge of the triangles that the patches bear, wherever other sheets are.

    It is the chord that leaves a sagitta of 0.02 tolerance, or a tenth of what the patches expect
    to be off (``usual_deviation``, if not given), on all but the most curved tenth of the patches,
    and no more than half the smallest core.
    """
    deviation = usual_deviation(atlas) if deviation is None else deviation
    table, rows = atlas.table, atlas.table.rows
    second = 2.0 * np.abs(table.mean[rows, 3:6]).max(axis=1) / table.radius[rows]
    if table.residuals:
        # Of residuals, too: the second derivative of a Matern process of smoothness 5/2 has the
        # standard deviation 5 a / l^2.
        rough, residual_scale = np.isin(rows, list(table.residuals)), atlas.residual_scale
        second[rough] = np.hypot(
            second[rough], 5.0 * residual_scale.amplitude / residual_scale.length**2
        )
    curvature = np.quantile(second, _CURVATURE_QUANTILE)
    sagitta = max(_SAGITTA * atlas.tolerance, _UNSURE * deviation)
    chord = np.sqrt(8.0 * sagitta / max(curvature, np.finfo(float).tiny))
    core = table.core * table.radius[rows].min()
    return float(min(chord, 0.5 * core, _CREASE_SHARE * atlas.creases.usual_length()))


def check_edge(atlas: Atlas, edge: float) -> float:
    """The edge of the triangles, if a surface of them can be made.

    Raises
    ------
    ValueError
        No length, longer than all patches together, or so short that the triangles would fill
        the memory. Equilateral ones are counted on the area of all cores, which overlap: about
        half of them come to be.
    """
    table, rows = atlas.table, atlas.table.rows
    radius = table.radius[rows, None]
    high, low = (table.origin[rows] + radius).max(0), (table.origin[rows] - radius).min(0)
    most = float((high - low).max())
    if not 0.0 < real(edge) <= most:
        raise ValueError(
            f"edge is {edge}; it must be a length > 0 and no more than the {most:.4g} that the "
            "patches span: leave it out for a fitting one"
        )
    area = np.pi * table.weight[rows].sum()
    need = (_BYTES_CREASED if atlas.creases else _BYTES) * area / (0.25 * np.sqrt(3.0))
    least = float(np.sqrt(need / _MOST_BYTES))
    if edge < least:
        raise ValueError(
            f"edge is {edge:.4g}: triangles so small would take more than "
            f"{_MOST_BYTES / 2**30:.0f} GB of memory; give one of {1.1 * least:.2g} or more"
        )
    return float(edge)


def usual_deviation(atlas: Atlas, before: float = np.inf) -> float:
    """Median of the predicted deviation half-way to the rims of some of the patches, length; what
    it was ``before``, where that is too little to matter: touches make it less."""
    if _UNSURE * before <= _SAGITTA * atlas.tolerance:
        return before
    rows = atlas.table.rows
    some = rows[:: max(1, len(rows) // _ASKED)]
    points = 0.5 * (atlas.table.outline[some] + atlas.table.origin[some, None])
    # Off the surface patches are less sure than on it.
    seen = atlas.blend(_on_surface(atlas, points[:, ::4].reshape(-1, 3)))
    return float(np.median(seen.deviation[seen.known])) if seen.known.any() else 0.0


def _on_surface(atlas: Atlas, points) -> np.ndarray:
    """Feet on the surface, to first order, of those of the points (n, 3) where it is known."""
    seen = atlas.blend(points)
    return (points - seen.distance[:, None] * seen.normal)[seen.known]


def cube_edge(
    table: PatchTable, neighbours: SheetNeighbours, edge: float, gaps, rows=None
) -> float:
    """Edge of the cubes: a multiple of the triangles', as many as the patches, or some of them,
    bear, and the ``gaps`` (m,) between their sheets; with creases the triangles' own."""
    if neighbours.creases:
        return edge
    rows = table.rows if rows is None else np.array(rows, int)
    most = _SHARE * table.radius[rows].min(initial=np.inf) / edge
    # Sheets nearer to each other than a cube of the triangles' own edge stay unparted anyway.
    gaps = gaps / (np.sqrt(3.0) * edge)
    apart = gaps[gaps >= 1.0].min(initial=np.inf)
    return edge * max(1, int(min(_MOST, most, apart)))


def gaps_of(table: PatchTable, neighbours: SheetNeighbours, rows) -> np.ndarray:
    """(m,) distances between two sheets that turn their backs, or faces, to each other: from
    outlines and centres of the patches ``rows`` to the cores of strangers that they lie under or
    over."""
    rows = np.array(rows, int)
    places = np.concatenate([table.outline[rows], table.origin[rows][:, None]], axis=1)
    home = np.repeat(rows, places.shape[1])
    places = places.reshape(-1, 3)
    who, which = table.index.near(places)
    mine = home[which]
    opposed = (table.axes[who, 2] * table.axes[mine, 2]).sum(axis=1) < OPPOSED
    opposed[opposed] &= ~same_sheet(neighbours, mine[opposed], who[opposed])
    who, which = who[opposed], which[opposed]
    distance, _, own = distances(table, neighbours, who, places[which], np.inf)
    return np.abs(distance[own])
