"""Edges that no contour crossed, where the surface of a lawful body shows them."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import CurvePoints, angles, gap, intersection_points
from touchatlas.atlas.faces.faces import Face, FaceEdge, Faces, face_edge

# Distance from samples of a face up to which its edge is sought, over ``reach``. Doubled, it takes
# longer.
_NEAR = 2.0
# Distance from an edge, in steps, at which the faces on both sides are the surface. Doubled, edges
# of narrower faces are missed.
_BESIDE = 0.25
# Distance of the surface from a face that it is, in root mean squares of the face. Doubled, nothing
# changes: others are steps away.
_NOISE = 4.0
# Points of an edge that are enough to tell it. Doubled, short edges are missed.
_LEAST = 3


def with_uncrossed_edges(body: Body) -> Faces:
    """The faces of a body, with the edges that its surface has where no contour crossed them, or
    too few to draw them. The surface beside such an edge is one face on one side, and the other
    beyond."""
    faces, found = body.faces, {}
    known = {(e.first, e.second) for e in faces.edges if e.curves or e.radius > 0.0}
    single = [face.id for face in faces.faces if len(face.pieces) == 1]
    for pair in combinations(single, 2):
        edge = None if pair in known else _edge(body, pair)
        if edge is not None:
            found[pair] = edge
    kept = [e for e in faces.edges if e.curves or (e.first, e.second) not in found]
    edges = sorted([*kept, *found.values()], key=lambda edge: (edge.first, edge.second))
    return replace(faces, edges=tuple(edges))


def _edge(body: Body, pair) -> FaceEdge | None:
    """The edge of a pair of faces; None where the surface has none."""
    first, second = (body.faces.faces[k] for k in pair)
    pieces, reach = (first.pieces[0], second.pieces[0]), _NEAR * body.reach
    start = [_near(body, *both, reach) for both in ((first, second), (second, first))]
    curve = intersection_points(*pieces, np.concatenate(start), reach)
    for kind in (EdgeKind.SHARP_CONVEX, EdgeKind.SHARP_CONCAVE):
        shown = _is_edge(body, pair, kind.sign, curve.points)
        if np.count_nonzero(shown) < _LEAST:
            continue
        points = CurvePoints(curve.points[shown], curve.deviation[shown])
        angle = float(np.median(angles(*pieces, points.points)))
        apart = gap(*pieces, points.points)
        boundary = Boundary(first.id, second.id, kind, points, angle, apart)
        edge = face_edge(first.id, second.id, [boundary], float(np.median(body.samples.steps)))
        if edge.curves:
            return edge
    return None


def _near(body: Body, own: Face, other: Face, reach: float) -> np.ndarray:
    """(n, 3) samples of a face within reach of those of another, length."""
    points = body.faces.points[own.samples]
    return points[body.field.trees.away(other.id, points) < reach]


def _is_edge(body: Body, pair, sign: float, points) -> np.ndarray:
    """(n,) whether the surface beside points (n, 3) of an edge is the one face of a pair on one
    side, and the other on the other side."""
    steps = _BESIDE * float(np.median(body.samples.steps))
    if not len(points):
        return np.zeros(0, bool)
    normals = [body.field.trees.values(k, points)[:, 1:4] for k in pair]
    shown = np.ones(len(points), bool)
    for own, normal, other in ((pair[0], *normals), (pair[1], *normals[::-1])):
        along = -sign * (other - (other * normal).sum(axis=1)[:, None] * normal)
        # Where both normals are one there is no edge.
        length = np.linalg.norm(along, axis=1)
        shown &= length > 0.0
        along /= np.where(length > 0.0, length, 1.0)[:, None]
        found, known = body.at(points + steps * along)
        noise = _NOISE * body.faces.faces[own].deviation
        shown &= known & (found.face == own) & (np.abs(found.distance) < noise)
    return shown
