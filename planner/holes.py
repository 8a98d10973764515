"""Holes: where the surface that an atlas draws has small gaps that no contour crossed."""

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.extract import open_surface


def hole_centres(atlas: Atlas, largest: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres (k, 3) of the holes of the surface, length, world, and outward normals (k, 3) there.

    A boundary of the surface is a hole where its bounding box has a diagonal of ``largest`` length
    at most; a longer one may be a true rim.
    """
    surface = open_surface(atlas)
    vertices, ends = np.unique(igl.boundary_facets(surface.faces)[0], return_inverse=True)
    first, second = ends.reshape(-1, 2).T
    ones, size = np.ones(len(first), bool), len(vertices)
    count, loop = connected_components(coo_array((ones, (first, second)), (size, size)))
    points = surface.vertices[vertices]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, loop, points)
    np.maximum.at(high, loop, points)
    small = np.flatnonzero(((high - low) ** 2).sum(axis=1) <= largest**2)
    centres = np.array([points[loop == k].mean(axis=0) for k in small]).reshape(-1, 3)
    normals = np.array([surface.normals[vertices[loop == k]].sum(axis=0) for k in small])
    normals = normals.reshape(-1, 3)
    return centres, normals / np.linalg.norm(normals, axis=1, keepdims=True)
