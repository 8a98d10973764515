"""Points beside blunt edges and corners: the distance of the ball that rounds them."""

import numpy as np

from touchatlas.atlas.faces.face_trees import FaceTrees
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.faces.rolling_ball import radius_slope, rounded_corner, rounded_edge

# Distance from the surface up to which corners are rounded, in radii. Doubled, more points are
# asked in vain.
_NEAR = 2.0
# Distance from the samples of each face of a corner, over ``reach``. Doubled, corners are rounded
# where extended faces meet.
_REACH = 2.0
# Noise of a sample, in root mean squares of its face. Doubled, balls are seen farther from samples.
_NOISE = 4.0


def raise_to_ball(edge: FaceEdge, mine, theirs, farthest, rows, chosen) -> None:
    """Change the values (n, 5) that were chosen, in ``rows`` (m,), to those of the ball of a blunt
    edge, where it takes more of a convex edge away, or fills more of a concave one.

    Parameters
    ----------
    edge : FaceEdge
    mine, theirs : (m, 5) float
        Distance, normal and variance of both faces at the points.
    farthest : (m,) float, length
        Largest distance of the surface.
    """
    sign = edge.kind.sign
    cosine = (mine[:, 1:4] * theirs[:, 1:4]).sum(axis=1)
    found, weights = rounded_edge(sign * mine[:, 0], sign * theirs[:, 0], cosine, edge.radius)
    higher = (weights.min(axis=1) > 0.0) & (found > sign * chosen[rows, 0])
    higher &= np.abs(found) < farthest
    weights, mine, theirs, rows = weights[higher], mine[higher], theirs[higher], rows[higher]
    chosen[rows, 0] = sign * found[higher]
    chosen[rows, 1:4] = weights[:, :1] * mine[:, 1:4] + weights[:, 1:] * theirs[:, 1:4]
    variance = np.maximum(mine[:, 4], theirs[:, 4])
    chosen[rows, 4] = variance + (radius_slope(weights) * edge.radius_std) ** 2


class RoundedEdges:
    """Blunt edges, their ends beside a third face, and corners of three faces with blunt edges that
    are all convex or all concave.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    """

    def __init__(self, trees: FaceTrees, reach: float) -> None:
        self._trees, self._reach = trees, reach
        # Each with its faces, and those that end it at an edge of its own sign.
        edges = trees.faces.edges
        self._edges = [(edge, _beside(edges, edge)) for edge in edges if edge.radius > 0.0]

    def round(self, points, distances, owner, decides, chosen) -> None:
        """Change the distances and normals (n, 5) that were chosen at points (n, 3) to those of
        balls. The points are at distances (n, f) from all faces, of faces ``owner`` (n,), and cut
        by faces ``decides`` (n,)."""
        for edge, ends in self._edges:
            pair = edge.first, edge.second
            near = _is_near(pair, edge.kind.sign, edge.radius, distances)
            rows = near[np.isin(decides[near], pair) & np.isin(owner[near], ends)]
            if not len(rows):
                continue
            rows, (mine, theirs), farthest = self._values(pair, points, rows)
            raise_to_ball(edge, mine, theirs, farthest, rows, chosen)
        for corner in self._trees.faces.corners:
            three, sign, radius = corner.faces, corner.sign, corner.radius
            rows = _is_near(three, sign, radius, distances)
            rows = rows[np.isin(owner[rows], three) & (np.abs(chosen[rows, 0]) < _NEAR * radius)]
            if not len(rows):
                continue
            rows, values, farthest = self._values(three, points, rows)
            depths = sign * np.stack([v[:, 0] for v in values], axis=1)
            normals = np.stack([v[:, 1:4] for v in values], axis=1)
            found, normal, ball = rounded_corner(depths, normals, np.full(len(rows), radius))
            higher = ball & (found > sign * chosen[rows, 0]) & (np.abs(found) < farthest)
            chosen[rows[higher], 0] = sign * found[higher]
            chosen[rows[higher], 1:4] = normal[higher]

    def _values(self, faces, points, rows):
        """Those of the rows (m,) whose points lie near samples of all faces, what these faces say
        there, a list of (k, 5), and the largest distance (k,) of the surface: it is no farther than
        a sample."""
        away = np.stack([self._trees.away(k, points[rows]) for k in faces])
        near = away.max(axis=0) < _REACH * self._reach
        noise = _NOISE * np.array([self._trees.faces.faces[k].deviation for k in faces])
        farthest = (away + noise[:, None]).min(axis=0)
        values = [self._trees.values(k, points[rows[near]]) for k in faces]
        return rows[near], values, farthest[near]


def _is_near(faces, sign: float, radius: float, distances) -> np.ndarray:
    """Rows (m,) of the points at distances (n, f) that lie within a radius of all faces, or beyond
    them."""
    near = sign * distances[:, list(faces)] > -radius
    return np.flatnonzero(near.all(axis=1))


def _beside(edges, own: FaceEdge) -> list[int]:
    """The faces of an edge, and those that have an edge of its kind with one of these."""
    pair = {own.first, own.second}
    alike = [edge for edge in edges if edge.kind is own.kind]
    return sorted({k for e in alike if pair & {e.first, e.second} for k in (e.first, e.second)})
