"""Triangles of the blended surface: marching cubes along it, then halved edges.

The cubes are as large as the patches and the distance between sheets allow. Their vertices are
moved onto the zero set, and edges are halved where the surface is too far from them. So a flat
surface has few triangles. The surface is closed where the patches cover it, and open where they do
not.
"""

import igl
import numpy as np

from touchatlas.atlas.known_surface import whole_field
from touchatlas.atlas.mesh.close_holes import close_holes
from touchatlas.atlas.mesh.close_slits import close_slits
from touchatlas.atlas.mesh.coarse_mesh import CoarseMesh, coarse_mesh
from touchatlas.atlas.mesh.coincident_vertices import without_coincident_vertices
from touchatlas.atlas.mesh.lawful_surface import fine_edge, lawful_surface
from touchatlas.atlas.mesh.refine import edges_of, refine, vertex_heights
from touchatlas.atlas.mesh.resolution import (
    OPPOSED,
    check_edge,
    cube_edge,
    facet_bound,
    gaps_of,
    resolution,
)
from touchatlas.atlas.mesh.rim_vertices import ended_at_rims
from touchatlas.atlas.mesh.small_handles import without_small_handles
from touchatlas.atlas.mesh.stray_pieces import without_stray_pieces
from touchatlas.atlas.mesh.surface import Surface
from touchatlas.atlas.mesh.unsure_rims import without_unsure_rims
from touchatlas.atlas.state import AtlasState

# Least cosine between a triangle and the axis of a patch at one of its corners, whose core turns by
# 45 degrees: 70 degrees. Doubled, 47 degrees, the rims of strongly curved patches are left out.
_FACING = 0.34


def extract_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """Triangulated zero set of the atlas's blended signed distance, its small and narrow holes
    closed, and without handles that are smaller than the smallest patch or four tolerances.

    Parameters
    ----------
    state : AtlasState
    edge : float, length, optional
        Typical edge of the triangles everywhere. Without it they are as large as
        ``AtlasOptions.facets`` allows.

    Raises
    ------
    ValueError
        When the argument is no Atlas, or has no patch, or the edge is no length, longer than the
        patches span, or too short for the memory.
    """
    if isinstance(state, AtlasState) and state.body is not None:
        sagitta = state.options.facets * state.tolerance
        return lawful_surface(
            state.body, check_edge(state, edge) if edge else fine_edge(state.body, sagitta)
        )
    closed = close_holes(without_unsure_rims(state, open_surface(state, edge)), state.rims)
    closed = close_slits(closed, state.rims)
    least = max(state.options.least_radius * state.scale, 2.0 * state.tolerance)
    return without_coincident_vertices(without_small_handles(closed, state.rims, least))


def open_surface(state: AtlasState, edge: float | None = None) -> Surface:
    """The surface as ``extract_surface`` gives it, with its holes."""
    if not isinstance(state, AtlasState):
        raise ValueError(f"got {type(state).__name__}; a surface is drawn of an Atlas")
    if not len(state):
        raise ValueError(
            "the atlas has no patch yet, so it has no surface; add a touch with three contours, or "
            "see in planner.stop why no touch gave a patch"
        )
    gaps = gaps_of(whole_field(state), state.surface_graph.outlines, state.table.rows)
    fine = check_edge(state, resolution(state, gaps) if edge is None else edge)
    cubes = cube_edge(whole_field(state), fine, gaps)
    if edge is None:
        coarse = coarse_mesh(whole_field(state), cubes)
        return smooth_surface(state, coarse, facet_bound(state), fine)
    # Cubes that are halved some times have the edge that is wished.
    halvings = int(np.log2(cubes / fine))
    coarse = coarse_mesh(whole_field(state), fine * 2**halvings)
    return smooth_surface(state, coarse, np.inf, np.inf, halvings)


def smooth_surface(
    state: AtlasState, coarse: CoarseMesh, bound: float, edge: float, halvings: int = 0
) -> Surface:
    """A coarse mesh refined (see ``refine``), cut off at its ends.

    The surface is kept where patches reach it and where samples support it (see ``supported``).
    """
    field = whole_field(state)
    mesh, drawn = refine(state, coarse, bound, edge, halvings)
    old, faces, patch = mesh.vertices, mesh.faces, mesh.vertices.patch
    height = vertex_heights(old, edges_of(faces)[0], bound)
    points = old.points + height[:, None] * old.normals
    points, drawn = ended_at_rims(state, faces, points, field.table.axes[patch, 2], drawn)
    # The triangles lie off the patches by as much as the vertices were moved.
    deviation = np.hypot(np.sqrt(old.variance), height)
    kept = _without_bridging_triangles(faces, old.normals)
    kept = kept[_faces_outward(kept, points, field.table.axes[patch, 2])]
    whole = Surface(points, kept, old.normals, deviation, patch, old.curvature)
    if not drawn.all() or len(whole.faces) < len(faces):
        whole = whole.only(drawn)
    faces, index = igl.split_nonmanifold(whole.faces)
    return without_stray_pieces(state, whole.taken(index, faces))


def _without_bridging_triangles(faces, normals) -> np.ndarray:
    """The triangles (f, 3) without those that join two sheets of opposed normals. They arise at the
    rim of a thin wall that is known on one side only."""
    return np.asarray(faces[_least_cosine(faces, normals) > OPPOSED])


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
