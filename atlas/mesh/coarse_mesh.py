"""The skin: a coarse triangulation of the zero set that can be renewed where patches change."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.blend import blend
from touchatlas.atlas.field.patch_values import patch_values
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.mesh.marching_cubes import corners_of, ends_of, triangles, unkey
from touchatlas.atlas.mesh.narrow_band import (
    NO_CORNERS,
    REACH,
    Corners,
    core_cubes,
    extend,
    find_cubes,
)
from touchatlas.atlas.patches.patch_table import PatchTable

# A vertex is moved a second time when it was farther off than this, in edges: then what the
# first-order distance errs is less than a sixth of the sagitta.
_NEAR = 0.02
# Vertices keep this share of their edge from its ends, before they are moved: else triangles
# are slivers.
_CLEAR = 0.1
_ASIDE = np.array([0.31, 0.43, 0.37])


@dataclass(frozen=True, eq=False)
class Vertices:
    """Vertices on edges of the lattice.

    Parameters
    ----------
    keys : (v,) int
        Of the edges, ascending.
    points : (v, 3) float, length, world
    normals : (v, 3) float, unit, world
    variance : (v,) float, length^2
    curvature : (v,) float, 1/length^2
        Gaussian.
    patch : (v,) int
        Patch in whose cell the vertex lies, or which leads next to it.
    known : (v,) bool
        Whether the surface is known there.
    """

    keys: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    variance: np.ndarray
    curvature: np.ndarray
    patch: np.ndarray
    known: np.ndarray


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """Coarse triangles of the surface, and what it takes to renew them.

    Parameters
    ----------
    start : (3,) float, length, world
        Origin of the lattice.
    edge : float, length
        Of its cubes.
    cubes : dict
        Row to the keys of the cubes that the patch's core passes.
    balls : dict
        Row to the centre and radius, four numbers, with which the patch was seen.
    corners : Corners
        As asked; what was ``extend``-ed is not among them.
    vertices : Vertices
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    """

    start: np.ndarray
    edge: float
    cubes: dict[int, np.ndarray]
    balls: dict[int, tuple[float, ...]]
    corners: Corners
    vertices: Vertices
    faces: np.ndarray


def grow_coarse_mesh(table: PatchTable, neighbours: SheetNeighbours, edge: float) -> CoarseMesh:
    """The skin of all patches on a lattice of a given edge."""
    rows = table.rows
    start = table.origin[rows[0]].copy()
    if neighbours.creases:
        # No plane of the lattice lies in a flat face.
        start += _ASIDE * edge
    return _triangulate(
        table, neighbours, CoarseMesh(start, edge, {}, {}, NO_CORNERS, NO_VERTICES, NO_FACES), rows
    )


def update_coarse_mesh(
    table: PatchTable, neighbours: SheetNeighbours, coarse: CoarseMesh, rows
) -> CoarseMesh:
    """The skin after the patches ``rows`` have come, changed or gone: the same as one that is
    grown anew from the same start."""
    now = _balls(table, [row for row in rows if row in table.index])
    # Most that changed are where they were.
    balls = {coarse.balls[i] for i in rows if i in coarse.balls} | set(now.values())
    stale = _within(
        balls, unkey(coarse.corners.keys) * coarse.edge + coarse.start, REACH * coarse.edge
    )
    gone = set(rows) - set(now)
    kept = CoarseMesh(
        coarse.start,
        coarse.edge,
        {i: c for i, c in coarse.cubes.items() if i not in gone},
        {i: b for i, b in coarse.balls.items() if i not in gone},
        coarse.corners.only(~stale),
        coarse.vertices,
        coarse.faces,
    )
    return _triangulate(table, neighbours, kept, sorted(now))


def _balls(table: PatchTable, rows) -> dict[int, tuple[float, ...]]:
    return {int(i): (*table.origin[i].tolist(), float(table.radius[i])) for i in rows}


def _within(balls, points, margin: float) -> np.ndarray:
    """(n,) whether points (n, 3) are within ``margin`` of any of the balls."""
    out = np.zeros(len(points), bool)
    for *centre, radius in balls:
        offset = points - centre
        out |= np.einsum("ij,ij->i", offset, offset) <= (radius + margin) ** 2
    return out


def _triangulate(
    table: PatchTable, neighbours: SheetNeighbours, old: CoarseMesh, rows
) -> CoarseMesh:
    """The skin when the patches ``rows`` are new, and the old corners still hold."""
    start, edge = old.start, old.edge
    cubes = old.cubes | core_cubes(table, rows, start, edge)
    balls = old.balls | _balls(table, rows)
    first = np.unique(np.concatenate([NO_CORNERS.keys, *cubes.values()]))
    found, corners = find_cubes(table, neighbours, first, start, edge, old.corners)
    at = corners.at(corners_of(found))
    whole = extend(table, neighbours, at, corners, start, edge)
    inside = whole.values[at] < 0.0
    crossed = inside.any(axis=1) & ~inside.all(axis=1)
    keys, faces = np.unique(triangles(found[crossed], inside[crossed]), return_inverse=True)
    low, high = (whole.at(end) for end in ends_of(keys))
    # A vertex between two corners that still hold, holds.
    held = np.isin(keys, old.vertices.keys)
    held &= old.corners.has(whole.keys[low]) & old.corners.has(whole.keys[high])
    held &= (corners.owners[low] >= 0) & (corners.owners[high] >= 0)
    points, owners = _crossings(whole, low[~held], high[~held], start, edge)
    fresh = _project(table, neighbours, keys[~held], points, owners, edge)
    vertices = _merged(old.vertices, fresh, keys, held)
    return CoarseMesh(start, edge, cubes, balls, corners, vertices, faces.reshape(-1, 3))


def _merged(old: Vertices, fresh: Vertices, keys, held) -> Vertices:
    """Vertices of ascending keys, those ``held`` from the old and the others fresh."""
    at = np.searchsorted(old.keys, keys[held])
    columns = []
    for name, new in vars(fresh).items():
        column = np.empty((len(keys), *new.shape[1:]), new.dtype)
        column[held], column[~held] = getattr(old, name)[at], new
        columns.append(column)
    return Vertices(*columns)


def _crossings(corners: Corners, low, high, start, edge: float):
    """Where the values at the ends of edges change sign (e, 3), and the leader (e,) of the
    nearer end."""
    a, b = corners.values[low], corners.values[high]
    share = np.clip(a / (a - b), _CLEAR, 1.0 - _CLEAR)[:, None]
    ends = (unkey(corners.keys[i]) * edge + start for i in (low, high))
    first, second = ends
    nearer = np.where(np.abs(a) <= np.abs(b), corners.owners[low], corners.owners[high])
    return first + share * (second - first), nearer


def _project(
    table: PatchTable, neighbours: SheetNeighbours, keys, points, owners, edge: float
) -> Vertices:
    """Vertices moved onto the zero set, with what is known there; where nothing is, onto the
    patch that leads next to it."""
    columns = _look(table, neighbours, points, owners, edge)
    far = np.abs(columns[0]) > _NEAR * edge
    points = points - np.clip(columns[0], -edge, edge)[:, None] * columns[1]
    again = _look(table, neighbours, points[far], owners[far], edge)
    points[far] -= np.clip(again[0], -edge, edge)[:, None] * again[1]
    for column, new in zip(columns, again, strict=True):
        column[far] = new
    return Vertices(keys, points, *columns[1:])


def _look(table: PatchTable, neighbours: SheetNeighbours, points, owners, edge: float):
    """Distance, normal, variance, curvature, patch, known at points (n, 3)."""
    seen = blend(table, neighbours, points, REACH * edge)
    out = seen.distance, seen.normal, seen.deviation**2, seen.gaussian_curvature, seen.patch
    blind = np.flatnonzero(~seen.known)
    if len(blind):
        alone = patch_values(table, neighbours, owners[blind], points[blind], np.inf)
        _, variance, curvature = alone.numbers[:, :3].T
        found = alone.distance, alone.numbers[:, 3:], variance, curvature, owners[blind]
        for column, value in zip(out, found, strict=True):
            column[blind] = value
    return *out, seen.known


NO_FACES = np.zeros((0, 3), np.int64)
NO_VERTICES = Vertices(
    np.zeros(0, np.int64),
    np.zeros((0, 3)),
    np.zeros((0, 3)),
    np.zeros(0),
    np.zeros(0),
    np.zeros(0, np.int64),
    np.zeros(0, bool),
)
