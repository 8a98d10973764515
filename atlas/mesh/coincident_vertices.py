"""Coincident vertices: where sheets of triangles meet in a point or an edge they are moved apart.

Marching cubes join two sheets of a thin wall here and there. These are separated by giving each its
own vertices, at the same place. A program that merges equal vertices, as most do when they load a
file, would join them again, and the surface would no longer be a manifold.
"""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.mesh.surface import Surface

# Way of a vertex to the middle of its triangles, no unit: more than single precision rounds, and
# far less than triangles are off the surface. Doubled, nothing changes.
_STEP = 1e-3


def without_coincident_vertices(surface: Surface) -> Surface:
    """The surface with all vertices at different places: those at one place are moved by a
    thousandth of the way to the middle of the triangles that each belongs to."""
    _, place, count = np.unique(surface.vertices, axis=0, return_inverse=True, return_counts=True)
    twins = count[place] > 1
    if not twins.any():
        return surface
    total, number = np.zeros_like(surface.vertices), np.zeros(len(surface.vertices))
    middles = surface.vertices[surface.faces].mean(axis=1)
    for corner in surface.faces.T:
        np.add.at(total, corner, middles)
        np.add.at(number, corner, 1.0)
    toward = total / np.maximum(number, 1.0)[:, None] - surface.vertices
    return replace(surface, vertices=surface.vertices + _STEP * toward * twins[:, None])
