"""Points beside sharp edges: the largest distance of the faces at a convex one, the smallest at a
concave one; where an edge is blunt, that of the ball that rounds it."""

import numpy as np

from touchatlas.atlas.faces.face_trees import FaceTrees, curve_tree
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.faces.rounded_edges import RoundedCorners, raise_to_ball

# Distance from a sharp edge up to which the face beyond it is asked, over that of the last of the
# nearest samples, and from the samples of that face, over ``reach``. Doubled, faces are cut by the
# extension of others.
_BESIDE = 2.0
# How far outside of the face beyond an edge a point must lie, over the least of so many nearest
# samples of its own face: one may have a wrong label. Doubled, points far from samples are not cut,
# or slits run on beyond edges.
_CROSSED, _NEAR = 2.0, 3
# Nearest samples of a face that may show that it goes on, and their distance over that of the
# nearest one of the face beyond the edge, up to which none of them has a wrong label. Doubled,
# faces go on beside edges whose other face has few samples.
_ABOUT, _CLEAR = 8, 0.5
# Noise of a sample beside an edge, in root mean squares of its face. Doubled, faces are cut by the
# extension of others that lie less than eight of these farther in.
_NOISE = 4.0


class SharpEdges:
    """The sharp edges between faces.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    """

    def __init__(self, trees: FaceTrees, reach: float) -> None:
        self._trees, self._reach, self._faces = trees, reach, trees.faces.faces
        sharp = [edge for edge in trees.faces.edges if edge.kind.sharp]
        # An edge that a single contour crossed has no curve.
        self._edges = [(edge, curve_tree(edge) if edge.curves else None) for edge in sharp]
        self._corners = RoundedCorners(trees, reach)
        # How far out the samples of a face lie of the second face of a pair.
        self._before: dict[tuple[int, int, float], np.ndarray] = {}
        # The faces with which each has a sharp edge, and its sign.
        self._around: list[list[tuple[int, float]]] = [[] for _ in self._faces]
        for edge in sharp:
            self._around[edge.first].append((edge.second, edge.kind.sign))
            self._around[edge.second].append((edge.first, edge.kind.sign))

    def cut(self, points, away, owner, chosen) -> np.ndarray:
        """(n,) the face that decides for points (n, 3) beside sharp edges.

        Parameters
        ----------
        points : (n, 3) float, length
        away : (n, k) float, length
            Distances of the nearest samples.
        owner : (n,) int
            The face of each point.
        chosen : (n, 5) float
            Distance, normal and variance there; changed where another face decides.
        """
        decides = owner.copy()
        rows = [np.flatnonzero(owner == own) for own in range(len(self._faces))]
        for edge, curve in self._edges:
            sign = edge.kind.sign
            for own, other in ((edge.first, edge.second), (edge.second, edge.first)):
                mine = rows[own]
                if edge.radius == 0.0:
                    # What ends the second face lies behind it, so that no other point is cut.
                    out = self._trees.distances(other, points[mine])
                    mine = mine[sign * out > sign * chosen[mine, 0]]
                beside = self._trees.away(other, points[mine]) < _BESIDE * self._reach
                if curve is not None:
                    beside |= curve.query(points[mine])[0] < _BESIDE * away[mine, -1]
                self._cut(edge, (own, other), mine[beside], points, chosen, decides)
        self._corners.round(points, owner, decides, chosen)
        return decides

    def _cut(self, edge: FaceEdge, pair, rows, points, chosen, decides) -> None:
        """Let the second face of a pair decide for points of ``rows`` (m,) of the first where it is
        the farther out; at a concave edge, of sign -1, the farther in.

        A point whose nearest samples are as far out lies where the edge does not bound its face.
        """
        if not len(rows):
            return
        (own, other), sign, points = pair, edge.kind.sign, points[rows]
        before = self._near_samples_out(sign, pair, points)
        theirs, which = self._where_it_is(sign, pair, points)
        limit = np.where(before > 0.0, _CROSSED * before, -np.inf)
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], limit)
        chosen[rows[wins]], decides[rows[wins]] = theirs[wins], which[wins]
        if edge.radius > 0.0:
            near = (which == other) & (before <= 0.0)
            mine = self._trees.values(own, points[near])
            raise_to_ball(edge, mine, theirs[near], rows[near], chosen)

    def _near_samples_out(self, sign: float, pair, points) -> np.ndarray:
        """(m,) how far the samples of the first face of a pair that are nearest to points (m, 3)
        lie out of the second beyond its noise, length: the innermost of them, because the others
        may have wrong labels. Infinite where one is out and the second face has no sample about a
        point: the first goes on there."""
        own, other = pair
        near = self._trees.nearest(own, points, _ABOUT)
        out = self._samples_out(sign, pair)[near]
        samples = self._trees.faces.points[self._faces[own].samples[near]]
        away = np.linalg.norm(samples - points[:, None], axis=2)
        clear = away < _CLEAR * self._trees.away(other, points)[:, None]
        noise = _NOISE * self._faces[other].deviation
        goes_on = (clear & (out > noise)).any(axis=1)
        return np.asarray(np.where(goes_on, np.inf, out[:, :_NEAR].min(axis=1) - noise))

    def _samples_out(self, sign: float, pair) -> np.ndarray:
        """(k,) how far the samples of the first face of a pair lie out of the second, and of those
        that end it, length; in, at a concave edge, of sign -1."""
        own, other = pair
        if (*pair, sign) not in self._before:
            samples = self._trees.faces.points[self._faces[own].samples]
            out = self._trees.values(other, samples)[:, 0]
            for third in self._enders(-sign, own, other):
                ended, values, _ = self._ended(sign, (own, other, third), samples, out)
                out[ended] = values[:, 0]
            self._before[(*pair, sign)] = sign * out
        return self._before[(*pair, sign)]

    def _where_it_is(self, sign: float, pair, points) -> tuple[np.ndarray, np.ndarray]:
        """Distance, normal and variance (m, 5) of the second face of a pair at points (m, 3), and
        the face that decides (m,): that face, or one that ends it at an edge of the other sign, or
        one that ends that one.

        At a corner of edges of one sign each face bounds the others, wherever it ends.
        """
        own, other = pair
        theirs, which = self._trees.values(other, points), np.full(len(points), other)
        waiting = [(other, np.arange(len(points)))]
        while waiting:
            face, rows = waiting.pop()
            for third in self._enders(-sign, own, face):
                three, distance = (own, face, third), theirs[rows, 0]
                ended, values, by = self._ended(sign, three, points[rows], distance)
                theirs[rows[ended]], which[rows[ended]] = values, by
                for decides in np.unique(by).tolist():
                    waiting.append((decides, rows[ended[by == decides]]))
        return theirs, which

    def _enders(self, sign: float, own: int, face: int) -> list[int]:
        """The faces but ``own`` that end a face at edges of a sign."""
        return [k for k, kind in self._around[face] if kind == sign and k != own]

    def _ended(self, sign: float, three, points, distance):
        """Which points (k,) of (m, 3) the third of three faces ends the second before, at an edge
        of the sign opposite to ``sign``, and lies behind a distance (m,); its distance, normal and
        variance (k, 5) there; and the face (k,) that decides: it, or one that ends it in turn."""
        own, face, third = three
        limit = _BESIDE * np.maximum(self._trees.away(face, points), self._reach)
        values = self._trees.values(third, points)
        ended = sign * values[:, 0] < sign * distance
        ended &= self._goes_not_beyond(-sign, (face, third), points)
        ended &= self._trees.away(third, points) < limit
        rows = np.flatnonzero(ended)
        values, which = values[rows], np.full(len(rows), third)
        for other in self._enders(sign, own, third):
            beyond = self._trees.values(other, points[rows])
            farther = sign * beyond[:, 0] > sign * values[:, 0]
            farther &= self._goes_not_beyond(sign, (third, other), points[rows])
            farther &= self._trees.away(other, points[rows]) < limit[rows]
            values[farther], which[farther] = beyond[farther], other
        behind = sign * values[:, 0] < sign * distance[rows]
        return rows[behind], values[behind], which[behind]

    def _goes_not_beyond(self, sign: float, pair, points) -> np.ndarray:
        """(m,) whether one of the samples of the first face of a pair that are nearest to points
        (m, 3) lies within the second, at an edge of a sign: all of them beyond it would show that
        the face goes on, and one may have a wrong label."""
        face, other = pair
        nearest = self._faces[face].samples[self._trees.nearest(face, points, _NEAR)]
        out = sign * self._trees.distances(other, self._trees.faces.points[nearest.ravel()])
        innermost = out.reshape(nearest.shape).min(axis=1)
        return np.asarray(innermost < _NOISE * self._faces[other].deviation)
