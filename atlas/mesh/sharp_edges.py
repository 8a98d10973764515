"""Sharp edges: triangles that run across a crease are cut along it.

Marching cubes chamfer an edge. Here every edge of the mesh between two sheets gets a vertex on
both polynomials, every triangle between three sheets one on all three; and vertices that lie so
near to the crease that slivers would arise are put on it instead.
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

# A vertex this near to the crease, as a share of its edge, or to a corner is put on it.
_SNAP = 0.2
_PROJECTIONS = 3
# A point of a crease this far from the edge that it cuts, in its lengths, is not taken.
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
        Old vertices that a vertex has its numbers from.
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
        Patches farther than this from a vertex are not considered there.
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
    """Vertices (v, 3) next to the creases moved onto the surface, and the patches (v,) they lie
    in."""
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
    """Edges of the mesh (e, 2) between two sheets, and creased patches (e, 2) of these."""
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
    """Creased patches of the sheets of two patches: these themselves, if they are."""
    for i in (first, *sorted(graph.neighbours[first])):
        for j in (second, *sorted(graph.neighbours[second])):
            if graph.creases.sign(i, j):
                return i, j
    return None


def _cut_edges(table: PatchTable, graph: SurfaceGraph, mesh: _Mesh, ends, pairs) -> dict:
    """Put a vertex on the crease on every edge (e, 2), or one of its ends where that is near.

    Returns
    -------
    dict of ascending pairs of vertices to the vertex between them
    """
    u, v = ends.T
    a, b = mesh.points[u], mesh.points[v]
    high = np.abs(_distance(table, pairs[:, 1], a))
    low = np.abs(_distance(table, pairs[:, 0], b))
    share = high / np.maximum(high + low, np.finfo(float).tiny)
    length = np.sqrt(((b - a) ** 2).sum(axis=1))
    points = _on_crease(table, graph.creases, pairs, a + share[:, None] * (b - a), length)
    # The nearest edge decides where a vertex goes that is put on the crease.
    near = np.minimum(share, 1.0 - share)
    snapped = np.where(share <= 0.5, u, v)
    cut: dict[tuple[int, int], int] = {}
    for e in np.argsort(near, kind="stable").tolist():
        one, other = ends[e].tolist()
        at = int(snapped[e])
        if near[e] < _SNAP and mesh.sheets[at, 1] < 0:
            mesh.points[at], mesh.sheets[at, :2] = points[e], pairs[e]
    fresh = [
        e
        for e, (one, other) in enumerate(ends)
        if not _have_common_sheet(graph.neighbours, mesh.sheets, one, other)
    ]
    size = len(mesh.points)
    for place, e in enumerate(fresh):
        cut[int(u[e]), int(v[e])] = size + place
    _append(mesh, points[fresh], pairs[fresh], ends[fresh])
    return cut


def _have_common_sheet(neighbours: SheetNeighbours, sheets, first: int, second: int) -> bool:
    """Whether two vertices lie on a common sheet."""
    mine, theirs = ([int(i) for i in sheets[v] if i >= 0] for v in (first, second))
    return any(i == j or i in neighbours[j] for i in mine for j in theirs)


def _distance(table: PatchTable, rows, points) -> np.ndarray:
    """(m,) signed distance of points (m, 3) from patches (m,)."""
    return patches_at(table, np.asarray(rows)[:, None], points).distance[:, 0]


def _on_crease(table: PatchTable, creases: Creases, pairs, points, length) -> np.ndarray:
    """Points (m, 3) moved onto both patches of pairs (m, 2), and to the corner where a third
    sheet cuts the crease off, or is near."""
    found = intersect(table, pairs, points).points
    out = np.where((_away(found, points) <= _FAR * length)[:, None], found, points)
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
    away = _away(corner.points, out[which])
    moves = (corner.across <= 1.0).all(axis=1) & (height > -_SNAP * length[which])
    moves &= away <= _FAR * length[which]
    out[which[moves]] = corner.points[moves]
    return out


def _away(a, b) -> np.ndarray:
    return np.sqrt(((a - b) ** 2).sum(axis=1))


def _append(mesh: _Mesh, points, pairs, parents) -> None:
    sheets = np.full((len(points), 3), -1)
    sheets[:, : pairs.shape[1]] = pairs
    mesh.points = np.concatenate([mesh.points, points])
    mesh.sheets = np.concatenate([mesh.sheets, sheets])
    mesh.parents = np.concatenate([mesh.parents, parents])


def _fill_middles(table: PatchTable, mesh: _Mesh, middles) -> None:
    """Add the vertices inside triangles between three sheets: on all three, if they meet."""
    if not middles:
        return
    corners = np.array([vertices for vertices, _ in middles])
    rows = np.array([sheets for _, sheets in middles])
    start = mesh.points[corners].mean(axis=1)
    length = np.sqrt(((mesh.points[corners] - start[:, None]) ** 2).sum(axis=2)).max(axis=1)
    found = intersect(table, rows, start).points
    points = np.where((_away(found, start) <= _FAR * length)[:, None], found, start)
    _append(mesh, points, rows, corners[:, :2])


def _finished(table: PatchTable, surface: Surface, mesh: _Mesh, faces) -> Surface:
    """The surface of the cut mesh, with its corners welded."""
    count = len(surface.vertices)
    edge = np.median(_away(mesh.points[faces[:, 0]], mesh.points[faces[:, 1]]))
    faces, kept = weld(mesh.points, faces, mesh.sheets[:, 1] >= 0, 1e-6 * float(edge))
    first, second = mesh.parents.T
    normals = surface.normals[first] + surface.normals[second]
    on_edge = np.flatnonzero(mesh.sheets[:, 1] >= 0)
    seen = _normals(table, mesh.sheets[on_edge], mesh.points[on_edge])
    normals[on_edge] = seen
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
    """(m, 3) sums of the unit normals of the sheets (m, 3), where not -1, at points (m, 3)."""
    rows = np.where(sheets >= 0, sheets, sheets[:, :1])
    normals = patches_at(table, rows, points).normals
    return (normals * (sheets >= 0)[..., None]).sum(axis=1)
