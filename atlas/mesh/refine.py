"""Refine: edges of triangles are halved until the triangles are near enough to the surface.

The field is asked for its distance from the middles of edges; along sharp edges of the body both
faces are asked. Two triangles share what becomes of their edge, so that no gap opens.
"""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.contouring.body_surface import is_smooth
from touchatlas.atlas.field.face_field import FaceValues
from touchatlas.atlas.mesh.edge_feet import feet_on_sharp_edges
from touchatlas.atlas.mesh.split_triangles import edges_of, split, triangles_beside
from touchatlas.atlas.records.surface import Surface

# Most times that an edge is halved: its height is then a 250th. Doubled, places where the field
# jumps fill with triangles.
_HALVINGS = 4
# The same of a body with edges, the roundings of which coarse cubes cut off: the first halves lead
# to the rounding. With four a corner was off by 1.4 tolerances. Doubled, little changes: edges are
# shorter than the shortest before.
_HALVINGS_SHARP = 7
# Height over an edge at which it is halved, in bounds, before vertices are moved out: a triangle of
# equal edges is a third higher in its middle. Doubled, triangles are beyond the bound.
_FAR = 1.1
# The same where vertices stay, because a body has sharp edges.
_FAR_SHARP = 0.8
# Distance of the field at a foot, in heights over the edge, from which the foot is none. Doubled,
# only feet that are farther off than the middle are refused.
_NEARER = 0.5
# Shortest edge that is halved, in extents. Halved, surfaces to tolerances far below the noise take
# four times the memory.
_SHORTEST = 1e-3
# Part of the mean height over its edges by which a vertex is moved out: then it is as far off as
# the middles of the triangles. Doubled, vertices are twice as far.
_OUT = 2.0 / 3.0
# Part of the largest height over its edges that a vertex counts as deviation, where vertices stay:
# 1.96 of these are the height over the middle of a triangle of equal edges. Where they are moved
# out, half of it, or how far if that is more. Doubled, deviations are twice as large.
_CHORD = 2.0 / 3.0
# Height over an edge by the normals at its ends, in bounds, below which the field is not asked.
# Doubled, less time, and more triangles are too far where the field has detail.
_LEVEL = 0.3
# Bound in predicted deviations, where that is more. Doubled, half as many triangles where little is
# known.
_UNSURE = 0.1


def refined(body: Body, surface: Surface, bound: float) -> Surface:
    """A surface whose triangles are within a bound of a body, without curvatures. Its deviation
    takes in how far they are.

    Parameters
    ----------
    body : Body
    surface : Surface
        With vertices on the body.
    bound : float, length
        Largest distance of the body from the middles of edges; a tenth of the predicted deviation
        where that is more. Edges shorter than a thousandth of the extent stay, and those where the
        field jumps.
    """
    keys, heights, smooth = np.zeros(0, np.int64), np.zeros(0), is_smooth(body)
    most = _HALVINGS if smooth else _HALVINGS_SHARP
    for done in range(most + 1):
        ends, sides = edges_of(surface.faces)
        named = ends[:, 0] << 32 | ends[:, 1]
        fresh = np.flatnonzero(~np.isin(named, keys))
        height, foot = _heights(body, surface, ends[fresh], bound if done else 0.0)
        if not smooth:
            beside = triangles_beside(sides, len(ends))[fresh]
            _ask_both_faces(body, surface, ends[fresh], beside, bound, height, foot)
        keys, heights = np.append(keys, named[fresh]), np.append(heights, height)
        if done == most:
            break
        far = np.flatnonzero(_are_far(body, surface, ends[fresh], height, bound))
        at = body.field.at(foot[far])
        # Where the field jumps no foot is nearer, and triangles would fold.
        nearer = np.abs(at.distance) < _NEARER * np.abs(height[far])
        far, at = far[nearer], at.some(nearer)
        if not len(far):
            break
        middle = np.full(len(ends), -1)
        middle[fresh[far]] = len(surface.vertices) + np.arange(len(far))
        new = _on_body(surface, foot[far], at)
        faces = split(
            surface.faces, middle[sides], np.concatenate([surface.vertices, new.vertices])
        )
        surface = surface.extended([new], faces, np.zeros((0, 3)))
    order = np.argsort(keys)
    heights = heights[order][np.searchsorted(keys[order], named)]
    highest = np.zeros(len(surface.vertices))
    np.maximum.at(highest, ends.T.ravel(), np.tile(np.abs(heights), 2))
    chord = _CHORD * np.minimum(highest, bound)
    if not smooth:
        return replace(surface, deviation=np.hypot(surface.deviation, chord))
    out = _outward(surface, ends, heights, bound)
    return replace(
        surface,
        vertices=surface.vertices + out[:, None] * surface.normals,
        deviation=np.hypot(surface.deviation, np.maximum(np.abs(out), 0.5 * chord)),
    )


def _are_far(body: Body, surface: Surface, ends, height, bound: float) -> np.ndarray:
    """(e,) whether the body is too far from the middles of edges (e, 2), by its heights (e,)."""
    unsure = _UNSURE * surface.deviation[ends].mean(axis=1)
    limit = (_FAR if is_smooth(body) else _FAR_SHARP) * np.maximum(bound, unsure)
    length = np.linalg.norm(np.diff(surface.vertices[ends], axis=1)[:, 0], axis=1)
    return np.asarray((np.abs(height) > limit) & (length > _SHORTEST * body.extent))


def _ask_both_faces(body: Body, surface: Surface, ends, beside, bound, height, foot) -> None:
    """Change the heights (e,) and feet (e, 3) of edges (e, 2) that run along sharp edges of the
    body, with the triangles ``beside`` (e, 2) them."""
    own, feet = feet_on_sharp_edges(body, surface, ends, beside, bound)
    middles = surface.vertices[ends[own]].mean(axis=1)
    height[own], foot[own] = np.linalg.norm(feet - middles, axis=1), feet


def _heights(body: Body, surface: Surface, ends, bound: float):
    """Heights (e,) of the body over the middles of edges (e, 2), length, and its points (e, 3)
    there. The field is not asked where the normals at both ends tell that they are far below the
    bound."""
    first, second = surface.vertices[ends.T]
    along, turn = second - first, surface.normals[ends[:, 1]] - surface.normals[ends[:, 0]]
    height, foot = (along * turn).sum(axis=1) / 8.0, 0.5 * (first + second)
    ask = np.abs(height) >= _LEVEL * bound
    found = body.field.at(foot[ask])
    most = 0.5 * np.linalg.norm(along[ask], axis=1)
    height[ask] = np.clip(-found.distance, -most, most)
    foot[ask] += height[ask, None] * found.normal
    return height, foot


def _on_body(surface: Surface, points, found: FaceValues) -> Surface:
    """Vertices at points (n, 3) that are nearly on the body, by what the field says there, without
    triangles."""
    return Surface(
        points - found.distance[:, None] * found.normal,
        np.zeros((0, 3), int),
        found.normal,
        np.minimum(found.deviation, surface.deviation.max()),
        found.face,
        np.zeros(len(points)),
    )


def _outward(surface: Surface, ends, heights, bound: float) -> np.ndarray:
    """(v,) how far vertices are moved out, length, so that triangles are above the body as much as
    below it; ``heights`` (e,), length, are those of the body over edges ``ends`` (e, 2)."""
    count = len(surface.vertices)
    total, times = (
        np.bincount(ends.T.ravel(), np.tile(each, 2), count)
        for each in (heights, np.ones(len(ends)))
    )
    return np.clip(_OUT * total / np.maximum(times, 1.0), -bound, bound)
