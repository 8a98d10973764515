"""Sharp edges: triangles that cross a crease are cut along it.

Marching cubes chamfer an edge. Here every mesh edge between two sheets gets a vertex on both
polynomials, and every triangle between three sheets gets a vertex on all three. A vertex so near to
the crease that slivers would arise is moved onto it instead.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.graph.crease_curves import side_of
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.sheets import SheetNeighbours, same_sheet
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
from touchatlas.atlas.mesh.cut_triangles import cut_faces, weld
from touchatlas.atlas.mesh.surface import Surface
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

# Distance from a crease or corner below which a vertex is moved onto it, as a fraction of its edge.
# Doubled, most vertices beside a crease are moved, and triangles become uneven.
_SNAP = 0.2
# First-order steps that move vertices beside a crease onto the surface. Each squares the error over
# the radius of curvature; doubled, nothing changes but the time.
_PROJECTIONS = 3
# Largest distance of a crease point from its estimate on the edge, in edge lengths: a farther one
# is of another part of the crease. Doubled, triangles may fold over.
_FAR = 1.5


@dataclass(eq=False)
class _Mesh:
    """A mesh that is being cut.

    Parameters
    ----------
    points : (v, 3) float, length, world
    sheets : (v, 3) int
        Patches of the sheets that a vertex lies on, filled up with -1.
    parents : (v, 2) int
        Two old vertices whose normals and deviations the vertex averages.
    """

    points: np.ndarray
    sheets: np.ndarray
    parents: np.ndarray


def sharpen(field: Field, surface: Surface, reach: float) -> Surface:
    """The surface with its triangles cut along the creases.

    Parameters
    ----------
    field : Field
    surface : Surface
    reach : float, length
        Distance from a vertex within which patches are evaluated.
    """
    table, graph = field.table, field.graph
    if not graph.creases:
        return surface
    points, patch = _projected(field, surface, reach)
    sheets = np.full((len(points), 3), -1)
    sheets[:, 0] = patch
    mesh = _Mesh(points, sheets, np.repeat(np.arange(len(points))[:, None], 2, axis=1))
    ends, pairs = _crossing(graph, surface.faces, patch)
    if not len(ends):
        return replace(surface, vertices=points, patch=patch)
    cut = _cut_edges(table, graph, mesh, ends, pairs)
    faces, middles = cut_faces(surface.faces, cut, mesh.sheets, graph.neighbours)
    _fill_middles(table, mesh, middles)
    return _finished(table, surface, mesh, faces)


def _projected(field: Field, surface: Surface, reach: float):
    """The vertices (v, 3), those beside creases moved onto the surface, and the patches (v,) in
    whose cells they lie."""
    points, patch = surface.vertices.copy(), surface.patch.copy()
    neighbours = field.graph.neighbours
    one, two, three = patch[surface.faces].T
    mixed = ~(
        same_sheet(neighbours, one, two)
        & same_sheet(neighbours, two, three)
        & same_sheet(neighbours, three, one)
    )
    zone = np.unique(surface.faces[mixed])
    for _ in range(_PROJECTIONS):
        seen = field.at(points[zone], reach)
        zone = zone[seen.known]
        step = np.clip(seen.distance[seen.known], -0.5 * reach, 0.5 * reach)
        points[zone] -= step[:, None] * seen.normal[seen.known]
        patch[zone] = seen.patch[seen.known]
    return points, patch


def _crossing(graph: SurfaceGraph, faces, patch):
    """Mesh edges (e, 2) between two sheets, and the two patches (e, 2) that are creased there."""
    ends = np.sort(np.concatenate([faces, np.roll(faces, -1, axis=1)], axis=0).reshape(2, -1).T)
    ends = np.unique(ends, axis=0)
    first, second = patch[ends].T
    ends = ends[~same_sheet(graph.neighbours, first, second)]
    found: dict[tuple[int, int], tuple[int, int] | None] = {}
    for pair in map(tuple, patch[ends].tolist()):
        if pair not in found:
            found[pair] = _creased(graph, *pair)
    pairs = [found[pair] for pair in map(tuple, patch[ends].tolist())]
    keep = np.array([pair is not None for pair in pairs], bool)
    both = np.array([pair for pair in pairs if pair is not None], int).reshape(-1, 2)
    return ends[keep], both


def _creased(graph: SurfaceGraph, first: int, second: int) -> tuple[int, int] | None:
    """Two creased patches, the first ones found among each of two patches and its neighbours."""
    for i in (first, *sorted(graph.neighbours[first])):
        for j in (second, *sorted(graph.neighbours[second])):
            if graph.creases.sign(i, j):
                return i, j
    return None


def _cut_edges(table: PatchTable, graph: SurfaceGraph, mesh: _Mesh, ends, pairs) -> dict:
    """Put a new vertex of every edge (e, 2) on the crease, or an end of the edge that is near.

    Returns
    -------
    dict
        Ascending pairs of vertices to the new vertex between them.
    """
    u, v = ends.T
    a, b = mesh.points[u], mesh.points[v]
    high = np.abs(_distance(table, pairs[:, 1], a))
    low = np.abs(_distance(table, pairs[:, 0], b))
    parameter = high / np.maximum(high + low, np.finfo(float).tiny)
    length = np.sqrt(((b - a) ** 2).sum(axis=1))
    points = _on_crease(table, graph.creases, pairs, a + parameter[:, None] * (b - a), length)
    # Of several crease points near to a vertex it is moved to the nearest.
    near = np.minimum(parameter, 1.0 - parameter)
    nearer_end = np.where(parameter <= 0.5, u, v)
    for e in np.argsort(near, kind="stable").tolist():
        at = int(nearer_end[e])
        if near[e] < _SNAP and mesh.sheets[at, 1] < 0:
            mesh.points[at], mesh.sheets[at, :2] = points[e], pairs[e]
    fresh = [
        e
        for e, (one, other) in enumerate(ends)
        if not _have_common_sheet(graph.neighbours, mesh.sheets, one, other)
    ]
    size = len(mesh.points)
    _append(mesh, points[fresh], pairs[fresh], ends[fresh])
    return {(int(u[e]), int(v[e])): size + place for place, e in enumerate(fresh)}


def _have_common_sheet(neighbours: SheetNeighbours, sheets, first: int, second: int) -> bool:
    """Whether two vertices lie on a common sheet."""
    mine, theirs = ([int(i) for i in sheets[v] if i >= 0] for v in (first, second))
    return any(i == j or i in neighbours[j] for i in mine for j in theirs)


def _distance(table: PatchTable, rows, points) -> np.ndarray:
    """(m,) signed distance of points (m, 3) from patches (m,)."""
    return patches_at(table, np.asarray(rows)[:, None], points).distance[:, 0]


def _on_crease(table: PatchTable, creases: Creases, pairs, points, length) -> np.ndarray:
    """Points (m, 3) moved onto both patches of pairs (m, 2), and on to the corner with a third
    sheet where that ends the crease before them, or nearly so."""
    out = _intersection(table, pairs, points, length)
    thirds = [sorted(creases.of(i) & creases.of(j)) for i, j in pairs.tolist()]
    which = np.repeat(np.arange(len(pairs)), [len(third) for third in thirds])
    if not len(which):
        return out
    third = np.concatenate([np.array(t, int) for t in thirds])
    corner = intersect(table, np.column_stack([pairs[which], third]), out[which])
    side = np.array(
        [
            side_of(creases.sign(i, k), creases.sign(j, k), creases.sign(i, j))
            for (i, j), k in zip(pairs[which].tolist(), third.tolist(), strict=True)
        ]
    )
    height = side * _distance(table, third, out[which])
    moves = (corner.across <= 1.0).all(axis=1) & (height > -_SNAP * length[which])
    moves &= _distances(corner.points, out[which]) <= _FAR * length[which]
    out[which[moves]] = corner.points[moves]
    return out


def _intersection(table: PatchTable, rows, points, length) -> np.ndarray:
    """Points (m, 3) moved onto all patches of rows (m, k), unless these meet too far away for an
    edge of ``length`` (m,)."""
    found = intersect(table, rows, points).points
    return np.where((_distances(found, points) <= _FAR * length)[:, None], found, points)


def _distances(a, b) -> np.ndarray:
    """(m,) distances between points (m, 3) and points (m, 3)."""
    return np.sqrt(((a - b) ** 2).sum(axis=1))


def _append(mesh: _Mesh, points, pairs, parents) -> None:
    """Add vertices (m, 3) with their sheets (m, k) and parents (m, 2)."""
    sheets = np.full((len(points), 3), -1)
    sheets[:, : pairs.shape[1]] = pairs
    mesh.points = np.concatenate([mesh.points, points])
    mesh.sheets = np.concatenate([mesh.sheets, sheets])
    mesh.parents = np.concatenate([mesh.parents, parents])


def _fill_middles(table: PatchTable, mesh: _Mesh, middles) -> None:
    """Add the vertices inside triangles between three sheets, on all three where they meet."""
    if not middles:
        return
    corners = np.array([vertices for vertices, _ in middles])
    rows = np.array([sheets for _, sheets in middles])
    start = mesh.points[corners].mean(axis=1)
    length = np.sqrt(((mesh.points[corners] - start[:, None]) ** 2).sum(axis=2)).max(axis=1)
    _append(mesh, _intersection(table, rows, start, length), rows, corners[:, :2])


def _finished(table: PatchTable, surface: Surface, mesh: _Mesh, faces) -> Surface:
    """The surface of the cut mesh, with vertices of one place welded."""
    count = len(surface.vertices)
    edge = np.median(_distances(mesh.points[faces[:, 0]], mesh.points[faces[:, 1]]))
    faces, kept = weld(mesh.points, faces, mesh.sheets[:, 1] >= 0, 1e-6 * float(edge))
    first, second = mesh.parents.T
    normals = surface.normals[first] + surface.normals[second]
    on_edge = np.flatnonzero(mesh.sheets[:, 1] >= 0)
    normals[on_edge] = _normals(table, mesh.sheets[on_edge], mesh.points[on_edge])
    normals /= np.maximum(np.sqrt((normals**2).sum(axis=1)), np.finfo(float).tiny)[:, None]
    patch = mesh.sheets[:, 0]
    patch[:count] = np.where(mesh.sheets[:count, 1] >= 0, surface.patch, patch[:count])
    return replace(
        surface,
        vertices=mesh.points[kept],
        faces=faces,
        normals=normals[kept],
        deviation=(0.5 * (surface.deviation[first] + surface.deviation[second]))[kept],
        patch=patch[kept],
        gaussian_curvature=surface.gaussian_curvature[first][kept],
    )


def _normals(table: PatchTable, sheets, points) -> np.ndarray:
    """(m, 3) sums of the unit normals of sheets (m, 3), where not -1, at points (m, 3)."""
    rows = np.where(sheets >= 0, sheets, sheets[:, :1])
    normals = patches_at(table, rows, points).normals
    return (normals * (sheets >= 0)[..., None]).sum(axis=1)
