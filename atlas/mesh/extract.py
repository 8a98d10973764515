"""Triangles of the blended surface: marching cubes along it, then curved triangles.

The cubes are as large as the patches and the distance between sheets allow. Their vertices are
moved onto the zero set, and the triangles are cut into small ones that follow the normals there.
So the field is evaluated at few points. The surface is closed where the patches cover it, and open
where they do not.
"""

import igl
import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.mesh.close_holes import close_holes
from touchatlas.atlas.mesh.coarse_mesh import CoarseMesh, coarse_mesh
from touchatlas.atlas.mesh.narrow_band import REACH
from touchatlas.atlas.mesh.pn_triangles import Subdivision
from touchatlas.atlas.mesh.resolution import OPPOSED, check_edge, cube_edge, gaps_of, resolution
from touchatlas.atlas.mesh.rim_vertices import ended_at_rims
from touchatlas.atlas.mesh.sharp_edges import sharpen
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces
from touchatlas.atlas.mesh.surface import Surface
from touchatlas.atlas.mesh.trim import supported
from touchatlas.atlas.mesh.unsure_rims import without_unsure_rims
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState

# A patch clearly covers within this fraction of the power up to which it is evaluated: beyond it
# the foot of a vertex may be out, and the field is asked.
_CLEARLY = 0.95
# Least cosine between a triangle and the axis of a patch at one of its corners, whose core turns by
# 45 degrees: 70 degrees. Doubled, 47 degrees, the rims of strongly curved patches are left out.
_FACING = 0.34


def extract_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """Triangulated zero set of the atlas's blended signed distance, its small holes closed.

    Parameters
    ----------
    state : AtlasState
    edge : float, length, optional
        Typical edge of the triangles; see ``resolution`` for what is used without it.

    Raises
    ------
    ValueError
        When the argument is no Atlas, or has no patch, or the edge is no length, longer than the
        patches span, or too short for the memory.
    """
    return close_holes(without_unsure_rims(state, open_surface(state, edge)), state.rims)


def open_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """The surface as ``extract_surface`` gives it, with its holes."""
    if not isinstance(state, AtlasState):
        raise ValueError(f"got {type(state).__name__}; a surface is drawn of an Atlas")
    if not len(state):
        raise ValueError("the atlas has no patch yet; add a touch with three contours first")
    gaps = gaps_of(state.field, state.surface_graph.outlines, state.table.rows)
    edge = check_edge(state, resolution(state, gaps) if edge is None else edge)
    coarse = coarse_mesh(state.field, cube_edge(state.field, edge, gaps))
    return smooth_surface(state, coarse, round(coarse.edge / edge))


def smooth_surface(state: AtlasState, coarse: CoarseMesh, count: int) -> Surface:
    """Each triangle of a coarse mesh cut into ``count`` x ``count`` curved ones.

    The surface is kept where patches reach it and where samples support it (see ``supported``).
    """
    field, old = state.field, coarse.vertices
    cut = Subdivision(len(old.keys), coarse.faces, count)
    points, faces = cut.points(old.points, old.normals), cut.faces()
    patch = _nearest(field.table, cut, old.patch, points)
    known = _known(field, patch, points, REACH * coarse.edge)
    normals: np.ndarray = cut.linear(old.normals)
    normals /= np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    height = np.zeros(len(points))
    if not field.graph.creases:
        height = cut.linear(mean_height(cut.edges, old.points, old.normals, count))
        points += height[:, None] * normals
    deviation, curvature = np.sqrt(cut.linear(old.variance)), cut.linear(old.curvature)
    known &= supported(state, patch, points, deviation)
    points, known = ended_at_rims(state, faces, points, field.table.axes[patch, 2], known)
    # The triangles lie off the patches by as much as the vertices were moved.
    deviation = np.hypot(deviation, height)
    kept = _without_bridging_triangles(faces, normals, coarse.faces, old.normals)
    if not field.graph.creases:
        # Across a crease triangles lean from one face to the other, until they are cut along it.
        kept = kept[_faces_outward(kept, points, field.table.axes[patch, 2])]
    whole = Surface(points, kept, normals, deviation, patch, curvature)
    if not known.all() or len(whole.faces) < len(faces):
        whole = whole.only(known)
    faces, old = igl.split_nonmanifold(whole.faces)
    whole = without_stray_pieces(state, whole.taken(old, faces))
    return sharpen(field, whole, REACH * coarse.edge)


def mean_height(edges, points, normals, count: int) -> np.ndarray:
    """(v,) mean height of the surface above the small triangles at each vertex, length.

    Over a triangle with its corners on the surface the mean height is the mean of the sagittas
    k l^2 / 8 of its sides (second order), and k l^2 = (n_2 - n_1) (p_2 - p_1). Vertices that are
    moved out by as much make triangles that lie above the surface as much as below it.

    Parameters
    ----------
    edges : (e, 2) int
        Edges of the large triangles.
    points : (v, 3) float, length, world
    normals : (v, 3) float, unit, world
    count : int
        Parts into which each edge is cut.
    """
    first, second = edges.T
    sagitta = np.einsum(
        "ij,ij->i", normals[second] - normals[first], points[second] - points[first]
    )
    sagitta *= np.einsum("ij,ij->i", normals[first], normals[second]) > SHEET_COSINE
    total, times = (
        np.bincount(edges.T.ravel(), np.tile(each, 2), len(points))
        for each in (sagitta, np.ones(len(sagitta)))
    )
    return total / np.maximum(times, 1.0) / (8.0 * count * count)


def _without_bridging_triangles(faces, normals, coarse, coarse_normals) -> np.ndarray:
    """The triangles (f, 3) without those that join two sheets of opposed normals. They arise at the
    rim of a thin wall that is known on one side only.

    The triangles were cut in equal numbers from triangles ``coarse`` (c, 3), and their normals are
    between those there. Where the coarse normals differ by a right angle at most, so do theirs.
    """
    doubt = np.flatnonzero(_least_cosine(coarse, coarse_normals) < 0.0)
    if not len(doubt):
        return faces
    parts = len(faces) // len(coarse)
    doubt = (doubt[:, None] * parts + np.arange(parts)).ravel()
    keep = np.ones(len(faces), bool)
    keep[doubt] = _least_cosine(faces[doubt], normals) > OPPOSED
    return faces[keep]


def _faces_outward(faces, points, axes) -> np.ndarray:
    """(f,) whether triangles face as one of the axes (v, 3) of the patches at their corners does.
    Others are folds, where cells of patches that disagree meet, or follow a second zero of a
    polynomial."""
    a, b, c = (points[corner] for corner in faces.T)
    across = np.cross(b - a, c - a)
    least = _FACING * np.sqrt(np.einsum("ij,ij->i", across, across))
    along = [np.einsum("ij,ij->i", across, axes[corner]) for corner in faces.T]
    return np.asarray(np.maximum.reduce(along) >= least)


def _least_cosine(faces, normals) -> np.ndarray:
    """(f,) the least cosine between two of the normals (v, 3) at each triangle."""
    a, b, c = (normals[corner] for corner in faces.T)
    pairs = (a, b), (b, c), (c, a)
    return np.minimum.reduce([np.einsum("ij,ij->i", p, q) for p, q in pairs])


def _nearest(table: PatchTable, cut: Subdivision, patch, points) -> np.ndarray:
    """(w,) the patch of least power at points (w, 3), among the patches (v,) of the old vertices
    of the same edge or triangle."""
    out = cut.shared(patch)
    mixed = np.flatnonzero(out < 0)
    some, here = patch[cut.parents(mixed)].T, points[mixed]
    least, out[mixed] = np.full(len(mixed), np.inf), some[0]
    for rows in some:
        offset = here - table.site[rows]
        power = np.einsum("ij,ij->i", offset, offset) - table.weight[rows]
        out[mixed] = np.where(power < least, rows, out[mixed])
        least = np.minimum(power, least)
    return out


def _known(field: Field, patch, points, reach: float) -> np.ndarray:
    """(w,) whether the surface is known at points (w, 3) of it, which lie in the cells of patches
    (w,). The field is evaluated only where that patch does not
    clearly cover the point."""
    table, graph = field.table, field.graph
    offset = points - table.site[patch]
    square = np.einsum("ij,ij->i", offset, offset)
    known = square <= _CLEARLY * (1.0 + COVER_MARGIN) * table.weight[patch]
    if graph.creases:
        known = graph.visibility.sees(patch, points, known)
    doubt = np.flatnonzero(~known)
    known[doubt] = field.at(points[doubt], reach).known
    return known
