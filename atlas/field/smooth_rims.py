"""Points beside smooth rims: between touches the nearest sample may be of the other face."""

import numpy as np

from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.edges.edge_curves import rim_distances
from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees, curve_tree


class SmoothRims:
    """The smooth rims between lawful faces.

    Parameters
    ----------
    trees : FaceTrees
    """

    def __init__(self, trees: FaceTrees) -> None:
        self._trees, self._faces = trees, trees.faces.faces
        self._rims = [
            (edge, curve_tree(edge))
            for edge in trees.faces.edges
            if edge.kind is EdgeKind.SMOOTH_RIM
            and edge.curves
            and not (trees.is_free_form(edge.first) or trees.is_free_form(edge.second))
        ]

    def move(self, at: FacesAt, away, owner, chosen) -> None:
        """Give n points beside rims to the face of their side.

        Parameters
        ----------
        at : FacesAt
        away : (n, k) float, length
            Distances of the nearest samples.
        owner : (n,) int
            The face of each point; changed where it lies on the other side.
        chosen : (n, 5) float
            Distance, normal and variance there; changed as well.
        """
        for edge, curve in self._rims:
            pair = edge.first, edge.second
            rows = np.flatnonzero((owner == pair[0]) | (owner == pair[1]))
            limit = np.maximum(3.0 * away[rows, 0], away[rows, -1])
            # Curves end where contours do: it is asked a little farther than points are moved.
            near = curve.query(at.points[rows])[0] < 2.0 * limit
            rows, limit = rows[near], limit[near]
            apart = [self._trees.away(k, at.points[rows]) for k in pair]
            rows, limit = (x[np.maximum(*apart) < limit] for x in (rows, limit))
            if not len(rows):
                continue
            samples = self._trees.faces.points
            first, second = (self._mean_near(samples, k, at.points[rows]) for k in pair)
            toward = first - second
            pieces = [self._faces[k].pieces[0] for k in pair]
            across = rim_distances(pieces[0], pieces[1], at.points[rows], toward)
            own = np.where(across > 0.0, *pair)
            for k in pair:
                moved = rows[(own == k) & (owner[rows] != k) & (np.abs(across) < limit)]
                values = at.values(k, moved)
                # Inside of a plate the far side of a cylinder that rounds its rim is no surface.
                normals = self._mean_near(self._trees.faces.normals, k, at.points[moved])
                faces = (values[:, 1:4] * normals).sum(axis=1) > 0.0
                chosen[moved[faces]], owner[moved[faces]] = values[faces], k

    def _mean_near(self, columns, number: int, points) -> np.ndarray:
        """(n, 3) mean of ``columns`` (m, 3) of the samples of a face that are nearest to points
        (n, 3)."""
        near = self._faces[number].samples[self._trees.nearest(number, points, 6)[0]]
        return np.asarray(columns[near].mean(axis=1))
