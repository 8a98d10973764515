"""Rim vertices: the triangles across a rim of the surface end there."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.records.surface import Surface


def ended_at_rims(surface: Surface, body: Body) -> Surface:
    """The surface without the triangles beyond rims; the vertices beyond of triangles across a rim
    are moved onto it."""
    if not (body.rims and len(surface.faces)):
        return surface
    points, faces = surface.vertices, surface.faces
    beyond = body.beyond(points, surface.normals)
    across = ~beyond[faces].all(axis=1)
    moved = np.intersect1d(faces[across], np.flatnonzero(beyond))
    onto = body.rims.onto(points[moved], surface.normals[moved])
    # On the tangent plane they left the surface by the sagitta of the way.
    found = body.field.at(onto)
    points = points.copy()
    points[moved] = onto - found.distance[:, None] * found.normal
    return replace(surface, vertices=points).of(faces[across])
