"""Points beside sharp edges: the largest distance of the faces at a convex one, the smallest at a
concave one."""

import numpy as np

from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees, curve_tree


class SharpEdges:
    """The sharp edges between faces that contours crossed.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    """

    def __init__(self, trees: FaceTrees, reach: float) -> None:
        self._trees, self._reach, self._faces = trees, reach, trees.faces.faces
        # Pairs, signs, and curves: an edge that a single contour crossed has none.
        self._edges = []
        for edge in trees.faces.edges:
            if edge.kind.sharp:
                curve = curve_tree(edge) if edge.curves else None
                self._edges.append((edge.first, edge.second, edge.kind.sign, curve))

    def cut(self, at: FacesAt, away, owner, chosen) -> np.ndarray:
        """(n,) the face that decides for n points beside sharp edges.

        Parameters
        ----------
        at : FacesAt
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
                mine = mine[sign * at.distances[mine, other] > sign * chosen[mine, 0]]
                if not len(mine):
                    continue
                reach = 2.0 * min(self._reach, self._trees.extents[other])
                theirs = self._trees.away(other, at.points[mine], reach)
                if curve is not None:
                    far = np.flatnonzero(np.isinf(theirs))
                    far = far[curve.query(at.points[mine[far]])[0] < 2.0 * away[mine[far], -1]]
                    theirs[far] = self._trees.away(other, at.points[mine[far]])
                beside = np.isfinite(theirs)
                mine, theirs = mine[beside], theirs[beside]
                self._cut(sign, (own, other), mine, theirs, at, chosen, decides)
        return decides

    def _cut(self, sign: float, pair, rows, away, at: FacesAt, chosen, decides) -> None:
        """Let the second face of a pair decide for points of ``rows`` (m,) of the first where it is
        the farther out; at a concave edge, of sign -1, the farther in. Its samples are ``away``
        (m,) from them, length.

        A point whose nearest samples are as far out lies where the edge does not bound its face.
        """
        if not len(rows):
            return
        out = self._near_samples_out(sign, pair, at.points[rows], away)
        # Twice as far as the samples about a point.
        limit = np.where(out > 0.0, 2.0 * out, -np.inf)
        theirs = at.values(pair[1], rows)
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], limit)
        chosen[rows[wins]], decides[rows[wins]] = theirs[wins], pair[1]

    def _near_samples_out(self, sign: float, pair, points, away) -> np.ndarray:
        """(m,) how far the samples of the first face of a pair that are nearest to points (m, 3)
        lie out of the second beyond its noise, length: the innermost of them, because the others
        may have wrong labels. Infinite where one is out and the second face, whose samples are
        ``away`` (m,), has none about a point: the first goes on there."""
        own, other = pair
        near, off = self._trees.nearest(own, points, 8)
        out = sign * self._trees.between[own][near, other]
        clear = off < 0.5 * away[:, None]
        noise = self._trees.faces.levels.sure * self._faces[other].deviation
        goes_on = (clear & (out > noise)).any(axis=1)
        return np.asarray(np.where(goes_on, np.inf, out[:, :3].min(axis=1) - noise))
