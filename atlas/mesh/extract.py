"""Triangles of the blended surface: marching cubes along it, then curved triangles.

The cubes are as large as the patches and the distance between sheets let them be; their
vertices are put on the zero set, and triangles that know the normals there are cut into small
ones that follow the curve. So the patches are asked at few points, the surface is closed as
far as the patches cover, and open exactly where they do not.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas, AtlasChange
from touchatlas.atlas.field.blend import blend
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.mesh.coarse_mesh import CoarseMesh, grow_coarse_mesh, update_coarse_mesh
from touchatlas.atlas.mesh.narrow_band import REACH
from touchatlas.atlas.mesh.pn_triangles import Subdivision
from touchatlas.atlas.mesh.resolution import (
    OPPOSED,
    check_edge,
    cube_edge,
    gaps_of,
    parting_edge,
    patch_resolution,
    resolution,
    usual_deviation,
)
from touchatlas.atlas.mesh.sharp_edges import sharpen
from touchatlas.atlas.mesh.trim import supported
from touchatlas.atlas.patches.patch_table import PatchTable

# Cosine of normals above which two neighbours are of one sheet.
_ALIKE = 0.5
# A surface is renewed, not begun anew, while the resolution is within these times its own.
_HOLDS = 0.7, 2.0


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of an atlas, and what is known at each vertex.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    normals : (v, 3) float, unit, world
    deviation : (v,) float, length
        Predicted standard deviation along the normal.
    patch : (v,) int
        Patch in whose cell the vertex lies.
    gaussian_curvature : (v,) float, 1/length^2
        Of the patches, not of the triangles.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    patch: np.ndarray
    gaussian_curvature: np.ndarray

    def total_curvature(self) -> float:
        """Integral of the patches' Gaussian curvature over the triangles.

        2 pi times the Euler characteristic on a closed surface (Gauss-Bonnet; do Carmo,
        section 4-5), up to the error of the patches: a check that needs no truth.
        """
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        areas = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
        return float(areas @ self.gaussian_curvature[self.faces].mean(axis=1))


def extract_surface(atlas: Atlas, edge: float | None = None) -> Surface:
    """Triangulated zero set of the atlas's blended signed distance.

    Parameters
    ----------
    atlas : Atlas
    edge : float, length, optional
        Of the triangles, about; see ``resolution``.

    Raises
    ------
    ValueError
        When the atlas has no patch, or the edge is no length or absurdly short.
    """
    return grow_surface(atlas, edge).surface


@dataclass(frozen=True, eq=False)
class GrownSurface:
    """A surface, and what it takes to renew it.

    Parameters
    ----------
    surface : Surface
    edge : float, length
        Of its triangles, about.
    borne : float, length
        The edge that the patches bore, wherever other sheets were.
    coarse : Skin
        Its coarse triangles.
    deviation : float, length
        What its patches usually expected to be off when it was begun.
    """

    surface: Surface
    edge: float
    borne: float
    coarse: CoarseMesh
    deviation: float


def grow_surface(atlas: Atlas, edge: float | None = None) -> GrownSurface:
    """The same surface as ``extract_surface``, to be renewed with every change of the atlas."""
    if not len(atlas.table.index):
        raise ValueError("the atlas has no patch yet; add a touch with three contours first")
    table, neighbours, deviation = atlas.table, atlas.neighbours, usual_deviation(atlas)
    borne, gaps = patch_resolution(atlas, deviation), gaps_of(table, neighbours, table.rows)
    edge = check_edge(atlas, parting_edge(table, borne, gaps) if edge is None else edge)
    coarse = grow_coarse_mesh(table, neighbours, cube_edge(table, neighbours, edge, gaps))
    surface = smooth_surface(atlas, coarse, round(coarse.edge / edge))
    return GrownSurface(surface, edge, borne, coarse, deviation)


def renew_surface(grown: GrownSurface, atlas: Atlas, change: AtlasChange) -> GrownSurface:
    """The surface after one more change of the atlas: as if it were extracted anew, with triangles
    of ``grown.edge`` while that holds.

    Only where a changed patch reaches is anything asked; all is, where the resolution no
    longer holds.

    Parameters
    ----------
    grown : GrownSurface
        Of the atlas before the change.
    atlas : Atlas
        As it is after the change.
    change : AtlasChange
    """
    table, neighbours = atlas.table, atlas.neighbours
    ids = change.added + change.changed + change.merged + change.split + change.removed
    rows = sorted(set(ids))
    left = [row for row in rows if row in table.index]
    deviation, gaps = usual_deviation(atlas, grown.deviation), gaps_of(table, neighbours, left)
    same_cubes = cube_edge(table, neighbours, grown.edge, gaps, left) >= grown.coarse.edge
    if not (same_cubes and _holds(grown, atlas, deviation, gaps)):
        return grow_surface(atlas)
    coarse = update_coarse_mesh(table, neighbours, grown.coarse, rows)
    surface = smooth_surface(atlas, coarse, round(coarse.edge / grown.edge))
    return GrownSurface(surface, grown.edge, grown.borne, coarse, deviation)


def _holds(grown: GrownSurface, atlas: Atlas, deviation: float, gaps) -> bool:
    """Whether the resolution of a surface still holds, when its patches usually expect to be off by
    ``deviation`` and the sheets about changed ones are ``gaps`` (m,) apart."""
    (low, high), borne = _HOLDS, patch_resolution(atlas, deviation)
    if not low <= borne / grown.borne <= high:
        return False
    least = low * grown.edge
    # Few places may be nearer, of all as of some.
    return parting_edge(atlas.table, borne, gaps) >= least or resolution(atlas, deviation) >= least


def smooth_surface(atlas: Atlas, coarse: CoarseMesh, count: int) -> Surface:
    """The skin's triangles cut into ``count`` x ``count`` curved ones, where they are known: where
    patches reach, among their samples, and expect to be off by no more than is trusted."""
    table, neighbours, old = atlas.table, atlas.neighbours, coarse.vertices
    cut = Subdivision(len(old.keys), coarse.faces, count)
    points, faces = cut.points(old.points, old.normals), cut.faces()
    patch = _nearest(table, cut, old.patch, points)
    known = _known(table, neighbours, patch, points, REACH * coarse.edge)
    normals: np.ndarray = cut.linear(old.normals)
    normals /= np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    if not neighbours.creases:
        points += (
            cut.linear(mean_height(cut.edges, old.points, old.normals, count))[:, None] * normals
        )
    deviation, curvature = np.sqrt(cut.linear(old.variance)), cut.linear(old.curvature)
    known &= supported(atlas, patch, points, deviation)
    kept = _without_bridging_triangles(faces, normals, coarse.faces, old.normals)
    whole = Surface(points, kept, normals, deviation, patch, curvature)
    if not known.all() or len(whole.faces) < len(faces):
        whole = _only(whole, known)
    return sharpen(table, neighbours, whole, REACH * coarse.edge)


def mean_height(edges, points, normals, count: int) -> np.ndarray:
    """(v,) by how much the surface is above small triangles about the vertices, in the mean.

    Over a triangle with its corners on the surface that is the mean of the sagittas k l^2 / 8 of
    its sides (second order), and k l^2 = (n_2 - n_1) (p_2 - p_1). Vertices that are moved out by
    as much make triangles that lie as much above the surface as below.

    Parameters
    ----------
    edges : (e, 2) int
        Of large triangles, whose sides are cut into ``count``.
    points, normals : (v, 3) float
    """
    first, second = edges.T
    bend = np.einsum("ij,ij->i", normals[second] - normals[first], points[second] - points[first])
    bend *= np.einsum("ij,ij->i", normals[first], normals[second]) > _ALIKE
    total, times = (
        np.bincount(edges.T.ravel(), np.tile(each, 2), len(points))
        for each in (bend, np.ones(len(bend)))
    )
    return total / np.maximum(times, 1.0) / (8.0 * count * count)


def _without_bridging_triangles(faces, normals, coarse, coarse_normals) -> np.ndarray:
    """Those of the triangles (f, 3) that do not join two sheets which turn their backs, or faces,
    to each other: at the rim of a thin wall that is known on one side only.

    They were cut, in equal numbers, from triangles ``coarse`` (c, 3), and their normals are between
    those there: where these are at right angles at most, so are they.
    """
    doubt = np.flatnonzero(_least_cosine(coarse, coarse_normals) < 0.0)
    if not len(doubt):
        return faces
    parts = len(faces) // len(coarse)
    doubt = (doubt[:, None] * parts + np.arange(parts)).ravel()
    keep = np.ones(len(faces), bool)
    keep[doubt] = _least_cosine(faces[doubt], normals) > OPPOSED
    return faces[keep]


def _least_cosine(faces, normals) -> np.ndarray:
    """(f,) the least cosine between two of the normals (v, 3) at each triangle."""
    a, b, c = (normals[corner] for corner in faces.T)
    pairs = (a, b), (b, c), (c, a)
    return np.minimum.reduce([np.einsum("ij,ij->i", p, q) for p, q in pairs])


def _only(surface: Surface, known) -> Surface:
    """The triangles between known vertices (v,), and the vertices they need."""
    faces = surface.faces[known[surface.faces].all(axis=1)]
    used = np.zeros(len(known), bool)
    used[faces] = True
    columns = {name: column[used] for name, column in vars(surface).items() if name != "faces"}
    return Surface(faces=(np.cumsum(used) - 1)[faces], **columns)


def _nearest(table: PatchTable, cut: Subdivision, patch, points) -> np.ndarray:
    """(w,) at points (w, 3) the patch with least power of those (v,) of the old vertices next to
    them."""
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


def _known(
    table: PatchTable, neighbours: SheetNeighbours, patch, points, reach: float
) -> np.ndarray:
    """(w,) whether the surface is known at points (w, 3) of it, which lie with the patches (w,):
    as ``blend`` says, which is asked only where the patch does not cover."""
    offset = points - table.site[patch]
    square = np.einsum("ij,ij->i", offset, offset)
    known = square <= (1.0 + COVER_MARGIN) * table.weight[patch]
    if neighbours.creases:
        known = neighbours.creases.sees(patch, points, known)
    doubt = np.flatnonzero(~known)
    known[doubt] = blend(table, neighbours, points[doubt], reach).known
    return known
