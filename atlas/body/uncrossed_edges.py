"""Edges that no contour crossed, where the surface of a lawful body shows them; those that are
drawn sharp by a guess, as most edges of the body are rounded."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.edges.boundary import Boundary, EdgeKind
from touchatlas.atlas.edges.edge_curves import CurvePoints, angles, gap, intersection_points
from touchatlas.atlas.faces.faces import Face, FaceEdge, Faces
from touchatlas.atlas.faces.join_faces import face_edge

# The kinds of sharp edges, in the order in which they are tried.
_KINDS = EdgeKind.SHARP_CONVEX, EdgeKind.SHARP_CONCAVE


def with_uncrossed_edges(body: Body) -> Faces:
    """The faces of a body, with the edges that its surface has where no contour crossed them, or
    too few to draw them. The surface beside such an edge is one face on one side, and the other
    beyond."""
    faces, found = body.faces, {}
    known = {(e.first, e.second) for e in faces.edges if e.curves or e.radius > 0.0}
    single = [face.id for face in faces.faces if len(face.pieces) == 1]
    tried = [_Meeting(body, pair) for pair in combinations(single, 2) if pair not in known]
    tried = [one for one in tried if len(one.curve.points) >= 3]
    for one, shown in zip(tried, _shown(body, tried), strict=True):
        edge = one.edge(body, shown)
        if edge is not None:
            found[one.pair] = edge
    kept = [e for e in faces.edges if e.curves or (e.first, e.second) not in found]
    edges = sorted([*kept, *found.values()], key=lambda edge: (edge.first, edge.second))
    return replace(faces, edges=tuple(edges))


class _Meeting:
    """Where the laws of a pair of faces meet, near samples of both."""

    def __init__(self, body: Body, pair: tuple[int, int]) -> None:
        first, second = (body.faces.faces[k] for k in pair)
        reach = 2.0 * body.reach
        start = _near(body, first, second, reach), _near(body, second, first, reach)
        self.pair, self.pieces = pair, (first.pieces[0], second.pieces[0])
        curve = intersection_points(*self.pieces, np.concatenate(start), reach)
        self.curve = _thinned(curve, 0.2 * float(np.median(body.samples.steps)))

    def beside(self, body: Body) -> np.ndarray:
        """(kinds, 2, n, 3) points beside those of an edge of each kind, on each of both faces."""
        points = self.curve.points
        first, second = (body.field.trees.of(k).values(points)[:, 1:4] for k in self.pair)
        step = 0.25 * float(np.median(body.samples.steps))
        return points_beside(points, first, second, step)

    def edge(self, body: Body, shown) -> FaceEdge | None:
        """The edge of the first kind that enough points (kinds, n) show; None where none is."""
        for kind, some in zip(_KINDS, shown, strict=True):
            if np.count_nonzero(some) < 3:
                continue
            points = CurvePoints(self.curve.points[some], self.curve.deviation[some])
            angle = float(np.median(angles(*self.pieces, points.points)))
            apart = gap(*self.pieces, points.points)
            boundary = Boundary(*self.pair, kind, points, angle, apart)
            step, tip = float(np.median(body.samples.steps)), body.samples.tip
            edge = face_edge(*self.pair, [boundary], step, tip)
            if edge.curves:
                return edge
        return None


def _thinned(curve: CurvePoints, edge: float) -> CurvePoints:
    """The surest of the points of a curve in each cube of an edge, length. The first point is in
    the middle of its cube: a straight line along an axis runs amid cubes, not between them."""
    cubes = np.floor((curve.points - curve.points[:1]) / edge + 0.5).astype(np.int64)
    order = np.argsort(curve.deviation, kind="stable")
    kept = np.sort(order[np.unique(cubes[order], axis=0, return_index=True)[1]])
    return CurvePoints(curve.points[kept], curve.deviation[kept])


def points_beside(points, first, second, step: float) -> np.ndarray:
    """(kinds, 2, n, 3) points that are a step (length) beside points (n, 3) of an edge of each
    kind, on each of two faces with normals (n, 3); NaN where both are one, so that there is no
    edge."""
    cosine = (first * second).sum(axis=1)[:, None]
    along = np.stack([second - cosine * first, first - cosine * second])
    length = np.linalg.norm(along, axis=2, keepdims=True)
    along /= np.where(length > 0.0, length, np.nan)
    return np.array([points - kind.sign * step * along for kind in _KINDS])


def _near(body: Body, own: Face, other: Face, reach: float) -> np.ndarray:
    """(n, 3) samples of a face within reach of those of another, length."""
    points = body.faces.points[own.samples]
    return points[body.field.trees.away(other.id, points) < reach]


def _shown(body: Body, tried: list[_Meeting]) -> list[np.ndarray]:
    """For each pair (kinds, n) whether the surface beside the points of an edge is the one face on
    one side, and the other on the other side. All are asked at once, which takes three
    fifths of the time."""
    if not tried:
        return []
    beside = [one.beside(body) for one in tried]
    owners = [
        np.broadcast_to(np.array(one.pair)[:, None], points.shape[:3])
        for one, points in zip(tried, beside, strict=True)
    ]
    points = np.concatenate([some.reshape(-1, 3) for some in beside])
    own = np.concatenate([some.ravel() for some in owners])
    good = ~np.isnan(points[:, 0])
    found, known = body.at(points[good])
    noise = body.samples.levels.sure * np.array([face.deviation for face in body.faces.faces])
    near = np.abs(found.distance) < noise[own[good]]
    good[good] = known & (found.face == own[good]) & near
    parts = np.split(good, np.cumsum([some.size for some in owners])[:-1])
    return [
        np.asarray(part.reshape(some.shape).all(axis=1))
        for part, some in zip(parts, owners, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class GuessedEdges:
    """Edges that no contour crossed, of a body most of whose edges are rounded.

    Parameters
    ----------
    points, normals : (k, 3) float, length; unit, world
        A point amid the curves of each edge, and the direction half-way between the normals of its
        faces.
    radius : float, length
        Median radius of the rounded edges; 0 where most are sharp.
    """

    points: np.ndarray
    normals: np.ndarray
    radius: float


def guessed_edges(body: Body, tolerance: float) -> GuessedEdges:
    """The edges of a body that are drawn sharp though no contour crossed them and most others are
    rounded, if rounded alike they would be off by more than the tolerance."""
    met = [edge for edge in body.faces.edges if edge.kind.sharp]
    radii = [edge.radius for edge in met if edge.radius > 0.0]
    if 2 * len(radii) <= len(met):
        return GuessedEdges(np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    # The surface shows edges, too, that no contour came near.
    sharp = [edge for edge in with_uncrossed_edges(body).edges if edge.kind.sharp]
    tree, radius = cKDTree(body.samples.points), float(np.median(radii))
    found = [
        edge
        for edge in sharp
        if edge.radius == 0.0 and tolerance < _off(edge, radius) < _away(edge, tree)
    ]
    curves = [np.concatenate(edge.curves) for edge in found]
    middles = np.reshape([curve[len(curve) // 2] for curve in curves], (-1, 3))
    pairs = zip(found, middles, strict=True)
    normals = [_between(body, (edge.first, edge.second), point) for edge, point in pairs]
    return GuessedEdges(middles, np.reshape(normals, (-1, 3)), radius)


def _between(body: Body, pair, point) -> np.ndarray:
    """The direction (3,) half-way between the normals of a pair of faces at a point (3,)."""
    both = np.sum([body.field.trees.of(k).values(point[None])[0, 1:4] for k in pair], axis=0)
    return np.asarray(both / np.linalg.norm(both))


def _off(edge: FaceEdge, radius: float) -> float:
    """Distance of a rounding of a radius from the sharp edge, length: the ball touches both faces,
    whose normals differ by the edge's angle."""
    return float(radius * (1.0 / np.cos(0.5 * edge.angle) - 1.0))


def _away(edge: FaceEdge, tree: cKDTree) -> float:
    """Distance of the nearest sample from the curves of an edge, length; 0 where it has none. A
    contour that crosses a sharp edge has samples nearer to it than a rounding is."""
    return float(tree.query(np.concatenate(edge.curves))[0].min()) if edge.curves else 0.0
