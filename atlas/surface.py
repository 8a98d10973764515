"""Triangles of the blended surface: marching cubes in a narrow band that follows the surface.

Only cubes near the patches are looked at. Wherever the surface leaves a cube through a face
the neighbour is taken in too, so the triangles are closed as far as the patches cover, and
open exactly where they do not.
"""

from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.blend import blend
from touchatlas.atlas.boundary import power_at
from touchatlas.patch.polynomial import scaled_height

# Height of the arc over its chord that the triangles may have, in tolerances.
_SAGITTA = 0.02
_CURVATURE_QUANTILE = 0.9
_CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
_FACES = tuple(
    (axis, side, np.flatnonzero(_CORNERS[:, axis] == side)) for axis in range(3) for side in (0, 1)
)


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


def resolution(atlas: Atlas) -> float:
    """Edge of the cubes: the chord that leaves a sagitta of 0.02 tolerance on all but the
    most curved tenth of the patches, and no more than half the smallest core."""
    table = atlas.table
    second = 2.0 * np.abs(table.mean[:, 3:6]).max(axis=1) / table.radius
    if table.rough:
        # Of residuals, too: the second derivative of a Matern process of smoothness 5/2 has the
        # standard deviation 5 a / l^2.
        rough, texture = list(table.rough), atlas.texture
        second[rough] = np.hypot(second[rough], 5.0 * texture.amplitude / texture.length**2)
    curvature = np.quantile(second, _CURVATURE_QUANTILE)
    chord = np.sqrt(8.0 * _SAGITTA * atlas.tolerance / max(curvature, np.finfo(float).tiny))
    return float(min(chord, 0.5 * table.core * table.radius.min()))


def extract_surface(atlas: Atlas, edge: float | None = None) -> Surface:
    """Triangulated zero set of the atlas's blended signed distance.

    Parameters
    ----------
    atlas : Atlas
    edge : float, length, optional
        Of the cubes; see ``resolution``.

    Raises
    ------
    ValueError
        When the atlas has no patch.
    """
    if len(atlas) == 0:
        raise ValueError("the atlas has no patch yet; add a touch with three contours first")
    edge = resolution(atlas) if edge is None else edge
    start = (atlas.table.origin - atlas.table.radius[:, None]).min(axis=0) - 2.0 * edge
    cubes, keys, values = _follow(atlas, start, edge)
    grid = _unkey(keys) * edge + start
    corners = np.searchsorted(keys, _key(cubes[:, None] + _CORNERS))
    vertices, faces, _ = igl.marching_cubes(values, grid, corners)
    return _finish(atlas, vertices, faces, edge)


def _finish(atlas: Atlas, vertices, faces, edge) -> Surface:
    """Move the vertices onto the zero set, orient the faces, ask the atlas about each vertex."""
    for _ in range(2):
        seen = blend(atlas.table, atlas.kin, vertices, 4.0 * edge)
        step = np.clip(seen.distance, -edge, edge)[:, None] * seen.normal
        vertices = np.where(seen.known[:, None], vertices - step, vertices)
    seen = blend(atlas.table, atlas.kin, vertices, 4.0 * edge)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    outward = np.nansum(np.cross(b - a, c - a) * seen.normal[faces[:, 0]])
    if outward < 0:
        faces = faces[:, ::-1]
    return Surface(
        vertices,
        np.ascontiguousarray(faces),
        np.nan_to_num(seen.normal),
        np.nan_to_num(seen.deviation),
        seen.patch,
        np.nan_to_num(seen.gaussian_curvature),
    )


def _key(indices) -> np.ndarray:
    """One integer for each grid index (..., 3); ascending with the index."""
    return (indices[..., 0] << 42) | (indices[..., 1] << 21) | indices[..., 2]


def _unkey(keys) -> np.ndarray:
    mask = (1 << 21) - 1
    return np.stack([keys >> 42, (keys >> 21) & mask, keys & mask], axis=-1)


def _follow(atlas: Atlas, start, edge):
    """Cubes (c, 3) that the surface passes with all corners known, corner keys (g,) ascending,
    and their signed distances (g,)."""
    keys, values = np.zeros(0, np.int64), np.zeros(0)
    seen = np.zeros(0, np.int64)
    fresh = np.unique(_key(np.floor((_seeds(atlas, edge) - start) / edge).astype(np.int64)))
    while len(fresh):
        seen = np.union1d(seen, fresh)
        corners = np.unique(_key(_unkey(fresh)[:, None] + _CORNERS))
        corners = np.setdiff1d(corners, keys, assume_unique=True)
        found = blend(atlas.table, atlas.kin, _unkey(corners) * edge + start, 4.0 * edge)
        keys = np.concatenate([keys, corners])
        values = np.concatenate([values, found.distance])
        order = keys.argsort()
        keys, values = keys[order], values[order]
        fresh = np.setdiff1d(_next_cubes(_unkey(fresh), keys, values), seen)
    cubes = _unkey(seen)
    corner_values = values[np.searchsorted(keys, _key(cubes[:, None] + _CORNERS))]
    crossed = (corner_values.min(axis=1) < 0) & (corner_values.max(axis=1) >= 0)
    return cubes[crossed], keys, values


def _next_cubes(cubes, keys, values) -> np.ndarray:
    """Keys of the neighbours into which the surface goes on from cubes with known corners."""
    corner_values = values[np.searchsorted(keys, _key(cubes[:, None] + _CORNERS))]
    known = ~np.isnan(corner_values).any(axis=1)
    inside = corner_values < 0
    out = []
    for axis, side, four in _FACES:
        face = inside[:, four]
        crossed = known & face.any(axis=1) & ~face.all(axis=1)
        neighbours = cubes[crossed].copy()
        neighbours[:, axis] += 2 * side - 1
        out.append(_key(neighbours))
    return np.unique(np.concatenate(out))


def _seeds(atlas: Atlas, edge) -> np.ndarray:
    """Points (n, 3) on every patch within its own cell, about an edge apart."""
    table, seeds = atlas.table, []
    for row in range(table.size):
        radius = table.radius[row]
        steps = np.arange(-table.core, table.core, edge / radius)
        x, y = (a.ravel() for a in np.meshgrid(steps, steps))
        inside = x * x + y * y <= table.core**2
        x, y = x[inside], y[inside]
        z = scaled_height(table.basis, table.mean[row], x, y)
        points = np.stack([x, y, z], axis=1) * radius @ table.axes[row] + table.origin[row]
        own = power_at(table, [row], points)[:, 0]
        keep = own <= 0.0
        if atlas.kin[row]:
            keep &= own <= power_at(table, sorted(atlas.kin[row]), points).min(axis=1)
        seeds.append(points[keep])
    return np.concatenate(seeds)
