"""Coarse mesh: marching cubes on the cubes that the surface passes."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.mesh.marching_cubes import corners_of, ends_of, key, triangles, unkey
from touchatlas.atlas.mesh.narrow_band import REACH, Corners, complete, core_cubes, find_cubes

# Distance from the surface above which a vertex is moved a second time, in edges: below it the
# error of the first-order distance is less than a sixth of the sagitta. Doubled, a third less time.
_NEAR = 0.02
# Least distance of a vertex from the ends of its edge before it is moved, as a fraction of the
# edge: nearer vertices make slivers. Doubled, vertices are moved farther along the surface.
_CLEAR = 0.1


@dataclass(frozen=True, eq=False)
class Vertices:
    """Vertices on the surface.

    Parameters
    ----------
    points : (v, 3) float, length, world
    normals : (v, 3) float, unit, world
    variance : (v,) float, length^2
    curvature : (v,) float, 1/length^2
        Gaussian curvature.
    patch : (v,) int
        Patch in whose cell the vertex lies; where the surface is unknown, the owner of the nearer
        end of the edge.
    known : (v,) bool
        Whether the surface is known there.
    """

    points: np.ndarray
    normals: np.ndarray
    variance: np.ndarray
    curvature: np.ndarray
    patch: np.ndarray
    known: np.ndarray

    def joined(self, other: "Vertices") -> "Vertices":
        """These vertices, then others."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Vertices(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, eq=False)
class CoarseMesh:
    """Coarse triangles of the surface.

    Parameters
    ----------
    edge : float, length
        Edge of the cubes.
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
    first = core_cubes(table, table.rows, start, edge)
    if field.gaps is not None:
        first = np.union1d(first, key(np.floor((field.gaps.samples - start) / edge).astype(int)))
    found, corners = find_cubes(field, first, start, edge)
    found, corners = complete(field, found, corners, start, edge)
    inside = corners.values[corners.at(corners_of(found))] < 0.0
    crossed = inside.any(axis=1) & ~inside.all(axis=1)
    keys, faces = np.unique(triangles(found[crossed], inside[crossed]), return_inverse=True)
    low, high = (corners.at(end) for end in ends_of(keys))
    points, owners = _crossings(corners, low, high, start, edge)
    vertices = project(field, points, owners, edge)
    return CoarseMesh(edge, vertices, faces.reshape(-1, 3))


def _crossings(corners: Corners, low, high, start, edge: float):
    """Points (e, 3) where the values change sign along edges, by linear interpolation, and the
    owner (e,) of the nearer end."""
    a, b = corners.values[low], corners.values[high]
    parameter = np.clip(a / (a - b), _CLEAR, 1.0 - _CLEAR)[:, None]
    first, second = (unkey(corners.keys[i]) * edge + start for i in (low, high))
    nearer = np.where(np.abs(a) <= np.abs(b), corners.owners[low], corners.owners[high])
    return first + parameter * (second - first), nearer


def project(field: Field, points, owners, edge: float) -> Vertices:
    """Vertices moved onto the zero set, with the values of the field there; where the field is
    unknown, onto the patch that owns the nearer end of the edge."""
    columns = _values(field, points, owners, edge)
    far = np.abs(columns[0]) > _NEAR * edge
    points = points - np.clip(columns[0], -edge, edge)[:, None] * columns[1]
    again = _values(field, points[far], owners[far], edge)
    points[far] -= np.clip(again[0], -edge, edge)[:, None] * again[1]
    for column, new in zip(columns, again, strict=True):
        column[far] = new
    return Vertices(points, *columns[1:])


def _values(field: Field, points, owners, edge: float):
    """Distance, normal, variance, curvature, patch and known at points (n, 3): of the field, or
    of the owners (n,) alone where the field is unknown."""
    seen = field.at(points, REACH * edge)
    out = seen.distance, seen.normal, seen.deviation**2, seen.gaussian_curvature, seen.patch
    unknown = np.flatnonzero(~seen.known)
    if len(unknown):
        alone = field.of_patches(owners[unknown], points[unknown])
        _, variance, curvature = alone.numbers[:, :3].T
        found = alone.distance, alone.numbers[:, 3:], variance, curvature, owners[unknown]
        for column, value in zip(out, found, strict=True):
            column[unknown] = value
    return *out, seen.known
