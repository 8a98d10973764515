"""Holes: where the surface that an atlas draws has gaps that no contour crossed."""

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.extract import open_surface

# Least part of the surface that is worth a touch, no unit. Doubled, more small holes are closed
# without a sample.
LEAST_SHARE = 1.25e-4


def hole_centres(atlas: Atlas) -> tuple[np.ndarray, np.ndarray]:
    """Centres (k, 3) of the holes of the surface, length, world, and outward normals (k, 3) there.

    Openings of the body, whose centres lie beyond rims, are left out, and holes so small that a
    touch there teaches less than ``LEAST_SHARE`` of the surface.
    """
    surface = open_surface(atlas)
    vertices, ends = np.unique(igl.boundary_facets(surface.faces)[0], return_inverse=True)
    first, second = ends.reshape(-1, 2).T
    ones, size = np.ones(len(first), bool), len(vertices)
    count, loop = connected_components(coo_array((ones, (first, second)), (size, size)))
    points, normals = surface.vertices[vertices], surface.normals[vertices]
    centres = np.array([points[loop == k].mean(axis=0) for k in range(count)]).reshape(-1, 3)
    outward = np.array([normals[loop == k].sum(axis=0) for k in range(count)]).reshape(-1, 3)
    length = np.linalg.norm(outward, axis=1)
    spokes = points[first] - centres[loop[first]], points[second] - centres[loop[second]]
    area = np.bincount(loop[first], 0.5 * np.linalg.norm(np.cross(*spokes), axis=1), count)
    whole = 0.5 * igl.doublearea(surface.vertices, surface.faces).sum()
    some = (length > 0.0) & (area >= LEAST_SHARE * whole)
    centres, outward = centres[some], outward[some] / length[some, None]
    true = atlas.rims.beyond(centres, outward)
    return centres[~true], outward[~true]
