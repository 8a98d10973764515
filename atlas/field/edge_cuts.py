"""Points beside sharp edges: the largest distance of the faces at a convex one, the smallest at a
concave one."""

from collections import defaultdict

import numpy as np

from touchatlas.atlas.field.face_trees import FaceTrees, curve_tree
from touchatlas.atlas.field.implied_edges import implied_edges

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
# Least cosine of the normals of two planes that are steps of one stair: 18 degrees. Doubled in
# angle, of two planes that meet bluntly only the nearer one bounds a third face.
PARALLEL = 0.95
# Distance to the samples of another step, over that to the nearest one, below which a point may be
# beside either. Doubled, more points beside low steps are doubted.
_RIVAL = 2.0
# Distance of the samples of a face that bounds the one beyond an edge, over that of the samples of
# this one, up to which it does. Without a limit a face far away left a wall standing in the air.
# Doubled, more of such stay.
_BOUNDS = 2.0
# Noise of a sample beside an edge, in root mean squares of its face. Doubled, faces are cut by the
# extension of others that lie less than eight of these farther in.
_NOISE = 4.0


class SharpEdges:
    """The sharp edges between faces, those that contours crossed and those that the sides of the
    samples imply.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    """

    def __init__(self, trees: FaceTrees, reach: float) -> None:
        self._trees, self._reach, self._faces = trees, reach, trees.faces.faces
        self.implied = implied_edges(trees, reach)
        # Pairs, signs, and curves: an edge that a single contour crossed has none.
        self._edges = [(*edge, None) for edge in self.implied]
        for edge in trees.faces.edges:
            if edge.kind.sharp:
                curve = curve_tree(edge) if edge.curves else None
                self._edges.append((edge.first, edge.second, edge.kind.sign, curve))
        # The faces that meet each one in edges of each sign.
        self._bounds: dict[tuple[int, float], list[int]] = defaultdict(list)
        for first, second, sign, _ in self._edges:
            self._bounds[first, sign].append(second)
            self._bounds[second, sign].append(first)
        self._steps = self._steps_of_stairs()

    def _steps_of_stairs(self) -> dict[tuple[int, int], list[int]]:
        """Of each face and one beyond its edge the planes that are parallel to that one, as steps
        of a stair are, and have an edge of the same sign with the first face."""
        numbers, normals = self._trees.planes[1:3]
        parallel = np.zeros((len(self._faces), len(self._faces)), bool)
        parallel[np.ix_(numbers, numbers)] = normals @ normals.T > PARALLEL
        np.fill_diagonal(parallel, False)
        signs = np.zeros(parallel.shape)
        for first, second, sign, _ in self._edges:
            signs[first, second] = signs[second, first] = sign
        found = {}
        for own, other in np.argwhere(signs != 0.0).tolist():
            alike = signs[own] == signs[own, other]
            found[own, other] = np.flatnonzero(parallel[other] & alike).tolist()
        return found

    def cut(self, points, distances, away, owner, chosen) -> np.ndarray:
        """(n,) the face that decides for points (n, 3) beside sharp edges.

        Parameters
        ----------
        points : (n, 3) float, length
        distances : (n, f) float, length
            From all faces.
        away : (n, k) float, length
            Distances of the nearest samples.
        owner : (n,) int
            The face of each point.
        chosen : (n, 5) float
            Distance, normal and variance there; changed where another face decides.
        """
        decides = owner.copy()
        rows = [np.flatnonzero(owner == own) for own in range(len(self._faces))]
        for first, second, sign, curve in self._edges:
            for own, other in ((first, second), (second, first)):
                mine = rows[own]
                mine = mine[sign * distances[mine, other] > sign * chosen[mine, 0]]
                if not len(mine):
                    continue
                theirs = self._trees.away(other, points[mine], _BESIDE * self._reach)
                if curve is not None:
                    far = np.flatnonzero(np.isinf(theirs))
                    far = far[curve.query(points[mine[far]])[0] < _BESIDE * away[mine[far], -1]]
                    theirs[far] = self._trees.away(other, points[mine[far]])
                beside = np.isfinite(theirs)
                mine, theirs = mine[beside], theirs[beside]
                taken = (own, other), mine, theirs, points, distances
                self._cut(sign, *taken, chosen, decides)
        return decides

    def _cut(self, sign: float, pair, rows, away, points, distances, chosen, decides) -> None:
        """Let the second face of a pair decide for points of ``rows`` (m,) of the first where it is
        the farther out; at a concave edge, of sign -1, the farther in. Its samples are ``away``
        (m,) from them, length.

        A point whose nearest samples are as far out lies where the edge does not bound its face.
        """
        if not len(rows):
            return
        limit = self._least_out(sign, pair, points[rows], away)
        theirs = self._trees.values(pair[1], points[rows])
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], limit)
        rows, away, limit, theirs = rows[wins], away[wins], limit[wins], theirs[wins]
        if not len(rows):
            return
        face = self._bound(sign, pair, points[rows], distances[rows], away, theirs)
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], limit)
        rows, theirs, face = rows[wins], theirs[wins], face[wins]
        theirs[:, 4] += self._doubt(pair, rows, away[wins], points, distances)
        wins = np.isfinite(theirs[:, 4])
        chosen[rows[wins]], decides[rows[wins]] = theirs[wins], face[wins]

    def _bound(self, sign: float, pair, points, distances, away, values) -> np.ndarray:
        """(m,) the face that decides for points (m, 3) of the first face of a pair where the second
        would, whose samples are ``away`` (m,), with ``values`` (m, 5), which change: a face that
        meets the second in an edge of the other sign bounds it, as the side of a block on the
        ground does its front."""
        own, other = pair
        face = np.full(len(points), other)
        for third in self._bounds[other, -sign]:
            rows = np.flatnonzero(sign * distances[:, third] < sign * values[:, 0])
            if third == own or not len(rows):
                continue
            its = self._trees.away(third, points[rows])
            near = its < _BOUNDS * away[rows]
            rows, its = rows[near], its[near]
            if not len(rows):
                continue
            limit = self._least_out(-sign, (other, third), points[rows], its)
            theirs = self._trees.values(third, points[rows])
            wins = -sign * theirs[:, 0] > np.maximum(-sign * values[rows, 0], limit)
            values[rows[wins]], face[rows[wins]] = theirs[wins], third
        return face

    def _least_out(self, sign: float, pair, points, away) -> np.ndarray:
        """(m,) how far out of the second face of a pair points (m, 3) must lie at least where it
        decides for those of the first, length."""
        before = self._near_samples_out(sign, pair, points, away)
        return np.where(before > 0.0, _CROSSED * before, -np.inf)

    def _doubt(self, pair, rows, away, points, distances) -> np.ndarray:
        """(m,) variance of the distance of points of ``rows`` (m,) of the first face of a pair from
        the second, whose samples are ``away`` (m,), where those of another step of a stair are
        about as near: the square of half of the difference of both, less the farther they are.
        Infinite where they are nearer: then that step bounds the first face."""
        out = np.zeros(len(rows))
        for step in self._steps[pair]:
            other = self._trees.away(step, points[rows])
            apart = 0.5 * (distances[rows, step] - distances[rows, pair[1]])
            fade = np.maximum(_RIVAL - other / np.maximum(away, np.finfo(float).tiny), 0.0)
            out = np.where(other < away, np.inf, out + (fade * apart) ** 2)
        return out

    def _near_samples_out(self, sign: float, pair, points, away) -> np.ndarray:
        """(m,) how far the samples of the first face of a pair that are nearest to points (m, 3)
        lie out of the second beyond its noise, length: the innermost of them, because the others
        may have wrong labels. Infinite where one is out and the second face, whose samples are
        ``away`` (m,), has none about a point: the first goes on there."""
        own, other = pair
        near, off = self._trees.nearest(own, points, _ABOUT)
        out = sign * self._trees.between[own][near, other]
        clear = off < _CLEAR * away[:, None]
        noise = _NOISE * self._faces[other].deviation
        goes_on = (clear & (out > noise)).any(axis=1)
        return np.asarray(np.where(goes_on, np.inf, out[:, :_NEAR].min(axis=1) - noise))
