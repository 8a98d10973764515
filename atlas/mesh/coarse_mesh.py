"""A coarse triangulation of the zero set: marching cubes on the cubes that the surface passes."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.mesh.marching_cubes import corners_of, ends_of, triangles, unkey
from touchatlas.atlas.mesh.narrow_band import REACH, Corners, core_cubes, extend, find_cubes

# A vertex is moved a second time when it was farther off than this, in edges: then what the
# first-order distance errs is less than a sixth of the sagitta. Doubled, a third less time.
_NEAR = 0.02
# Vertices keep this fraction of their edge from its ends, before they are moved: else triangles
# are slivers. Doubled, vertices are moved farther along the surface.
_CLEAR = 0.1
# The origin of the lattice, in edges from a patch: no plane of it lies in a flat face. Any numbers
# without a small common multiple do.
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
        Patch in whose cell the vertex lies, or the owner of the corner next to it.
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
    """Coarse triangles of the surface.

    Parameters
    ----------
    edge : float, length
        Of the cubes.
    vertices : Vertices
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    """

    edge: float
    vertices: Vertices
    faces: np.ndarray


def coarse_mesh(field: Field, edge: float) -> CoarseMesh:
    """The coarse mesh of all patches on a lattice of a given edge, length."""
    table = field.table
    start = table.origin[table.rows[0]].copy()
    if field.graph.creases:
        start += _ASIDE * edge
    found, corners = find_cubes(field, core_cubes(table, table.rows, start, edge), start, edge)
    at = corners.at(corners_of(found))
    corners = extend(field, at, corners, start, edge)
    inside = corners.values[at] < 0.0
    crossed = inside.any(axis=1) & ~inside.all(axis=1)
    keys, faces = np.unique(triangles(found[crossed], inside[crossed]), return_inverse=True)
    low, high = (corners.at(end) for end in ends_of(keys))
    points, owners = _crossings(corners, low, high, start, edge)
    vertices = _project(field, keys, points, owners, edge)
    return CoarseMesh(edge, vertices, faces.reshape(-1, 3))


def _crossings(corners: Corners, low, high, start, edge: float):
    """Where the values at the ends of edges change sign (e, 3), and the owner (e,) of the nearer
    end."""
    a, b = corners.values[low], corners.values[high]
    parameter = np.clip(a / (a - b), _CLEAR, 1.0 - _CLEAR)[:, None]
    first, second = (unkey(corners.keys[i]) * edge + start for i in (low, high))
    nearer = np.where(np.abs(a) <= np.abs(b), corners.owners[low], corners.owners[high])
    return first + parameter * (second - first), nearer


def _project(field: Field, keys, points, owners, edge: float) -> Vertices:
    """Vertices moved onto the zero set, with what is known there; where nothing is, onto the
    owner of the corner next to it."""
    columns = _look_up(field, points, owners, edge)
    far = np.abs(columns[0]) > _NEAR * edge
    points = points - np.clip(columns[0], -edge, edge)[:, None] * columns[1]
    again = _look_up(field, points[far], owners[far], edge)
    points[far] -= np.clip(again[0], -edge, edge)[:, None] * again[1]
    for column, new in zip(columns, again, strict=True):
        column[far] = new
    return Vertices(keys, points, *columns[1:])


def _look_up(field: Field, points, owners, edge: float):
    """Distance, normal, variance, curvature, patch, known at points (n, 3)."""
    seen = field.at(points, REACH * edge)
    out = seen.distance, seen.normal, seen.deviation**2, seen.gaussian_curvature, seen.patch
    blind = np.flatnonzero(~seen.known)
    if len(blind):
        alone = field.of_patches(owners[blind], points[blind])
        _, variance, curvature = alone.numbers[:, :3].T
        found = alone.distance, alone.numbers[:, 3:], variance, curvature, owners[blind]
        for column, value in zip(out, found, strict=True):
            column[blind] = value
    return *out, seen.known
