"""Doubts about the triangles of an atlas: pieces, holes, and a surface that is not closed."""

import igl
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.check.doubt import NOWHERE, Doubt, some_apart
from touchatlas.atlas.mesh.refine import edges_of
from touchatlas.atlas.mesh.winding import winding_numbers
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.patch.words import count_of


def surface_doubts(surface: Surface | None, atlas: AtlasState) -> list[Doubt]:
    """Pieces, holes, closed or not, an odd Euler characteristic and the side of the triangles."""
    if surface is None or not len(surface.faces):
        return [Doubt("no surface", "Nowhere is the surface known.", NOWHERE)]
    return [*_pieces(surface), *_closed_holes(surface, atlas), *_openings(surface, atlas)]


def _pieces(surface: Surface) -> list[Doubt]:
    """One doubt where the triangles are of several bodies."""
    pieces = int(igl.vertex_components(surface.faces).max()) + 1
    words = f"The surface has {pieces} pieces; touch between them, or check for a second body."
    return [Doubt("pieces", words, NOWHERE)] if pieces > 1 else []


def _closed_holes(surface: Surface, atlas: AtlasState) -> list[Doubt]:
    """One doubt where holes were closed across that are not known to the tolerance."""
    if not len(surface.closed_holes):
        return []
    nearest = cKDTree(surface.vertices).query(surface.closed_holes)[1]
    unsure = surface.closed_holes[SURE * surface.deviation[nearest] > atlas.tolerance]
    if not len(unsure):
        return []
    words = (
        f"{count_of(len(unsure), 'hole was', 'holes were')} closed across without a sample, and "
        "the surface may be off there by more than the tolerance; touch there."
    )
    return [Doubt("closed holes", words, some_apart(unsure, box_diagonal(surface.vertices)))]


def _openings(surface: Surface, atlas: AtlasState) -> list[Doubt]:
    """One doubt where the surface is open though no rim is known there, no closed surface, or
    inside out."""
    edges, sides = edges_of(surface.faces)
    triangles = np.bincount(sides.ravel())
    if (triangles == 1).any():
        middle = surface.vertices[edges[triangles == 1]].mean(axis=1)
        middle = middle[~atlas.rims.at(middle, atlas.tolerance)]
        words = "The surface is not closed; touch at the rims, unless the object is open there."
        places = some_apart(middle, box_diagonal(surface.vertices))
        return [Doubt("holes", words, places)] if len(middle) else []
    characteristic = len(np.unique(surface.faces)) - len(edges) + len(surface.faces)
    if (triangles == 2).all() and characteristic % 2 == 0:
        return _inside_out(surface.vertices, surface.faces)
    words = (
        f"The triangles do not make a closed surface (Euler characteristic {characteristic}); "
        "extract it with a shorter edge."
    )
    return [Doubt("topology", words, NOWHERE)]


def _inside_out(vertices, faces) -> list[Doubt]:
    """One doubt where pieces of a closed surface enclose air: their volume is negative, and no
    other piece is about them, as about a cavity."""
    corners, piece = vertices[faces] - vertices[0], igl.vertex_components(faces)[faces[:, 0]]
    # Six times the volume of the tetrahedron from one point to each triangle.
    six = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    inverted = np.flatnonzero(np.bincount(piece, six) < 0.0)
    solid = faces[~np.isin(piece, inverted)]
    at = vertices[[faces[(piece == k).argmax(), 0] for k in inverted]]
    if len(solid):
        at = at[winding_numbers(vertices, solid, at) < 0.5]
    if not len(at):
        return []
    words = (
        "The surface, or a piece of it, is inside out: it encloses air. The approach of a touch "
        "must point from the surface to where the probe came from; turn it round, unless the probe "
        "was in a hollow."
    )
    return [Doubt("inside out", words, at)]
