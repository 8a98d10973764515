"""Points beside smooth rims: between touches the nearest sample may be of the other face."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.edges.edge_curves import across_rim, rim_distances
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees, curve_tree, off_box


class SmoothRims:
    """The smooth rims between lawful faces.

    Parameters
    ----------
    trees : FaceTrees
    """

    def __init__(self, trees: FaceTrees) -> None:
        self._trees, self._faces = trees, trees.faces.faces
        rims = [
            edge
            for edge in trees.faces.edges
            if edge.kind is EdgeKind.SMOOTH_RIM
            and edge.curves
            and not (trees.is_free_form(edge.first) or trees.is_free_form(edge.second))
        ]
        # Points of each rim, and the directions (m, 3) from there to its first face.
        self._rims = [(rim, tree := curve_tree(rim), self._to_first(rim, tree)) for rim in rims]

    def join(self, some, others) -> bool:
        """Whether a rim joins one of some faces and one of others."""
        pairs = [{edge.first, edge.second} for edge, _, _ in self._rims]
        return any({one, other} in pairs for one in some for other in others)

    def pass_rims(self, face: int, points, reach) -> np.ndarray:
        """(n,) whether points (n, 3) are on the other side of a rim of a face that is nearer to
        them than ``reach`` (n,), length."""
        out = np.zeros(len(points), bool)
        for edge, curve, to_first in self._rims:
            if face in (edge.first, edge.second):
                near = np.flatnonzero(~out & (off_box(curve, points) < reach))
                off, which = curve.query(points[near])
                side = ((points[near] - curve.data[which]) * to_first[which]).sum(axis=1)
                beyond = side < 0.0 if face == edge.first else side > 0.0
                out[near] = beyond & (off < reach[near])
        return out

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
        for edge, curve, to_first in self._rims:
            pair = edge.first, edge.second
            rows = np.flatnonzero((owner == pair[0]) | (owner == pair[1]))
            limit = np.maximum(3.0 * away[rows, 0], away[rows, -1])
            # Curves end where contours do: it is asked a little farther than points are moved.
            off, which = curve.query(at.points[rows])
            near = off < 2.0 * limit
            rows, limit, which = rows[near], limit[near], which[near]
            near = np.ones(len(rows), bool)
            for k in pair:
                believed = np.minimum(limit, self._trees.extents[k])
                near &= self._trees.away(k, at.points[rows]) < believed
            rows, limit, which = rows[near], limit[near], which[near]
            if not len(rows):
                continue
            pieces = [self._faces[k].pieces[0] for k in pair]
            rim = curve.data[which], to_first[which]
            across = rim_distances(pieces[0], pieces[1], at.points[rows], *rim)
            own = np.where(across > 0.0, *pair)
            for k in pair:
                moved = rows[(own == k) & (owner[rows] != k) & (np.abs(across) < limit)]
                values = at.values(k, moved)
                # Inside of a plate the far side of a cylinder that rounds its rim is no surface.
                normals = self._mean_near(self._trees.faces.normals, k, at.points[moved])
                faces = (values[:, 1:4] * normals).sum(axis=1) > 0.0
                # Neither is that of a wall, whose sides face away from each other.
                turn = (values[:, 1:4] * chosen[moved, 1:4]).sum(axis=1)
                faces &= turn > -self._trees.faces.levels.facing
                chosen[moved[faces]], owner[moved[faces]] = values[faces], k

    def _to_first(self, edge: FaceEdge, curve: cKDTree) -> np.ndarray:
        """(m, 3) unit directions across a rim, at the points of its curves, to the first face."""
        pair, points = (edge.first, edge.second), np.asarray(curve.data)
        samples = self._trees.faces.points
        first, second = (self._mean_near(samples, k, points) for k in pair)
        pieces = [self._faces[k].pieces[0] for k in pair]
        return across_rim(pieces[0], pieces[1], points, first - second)

    def _mean_near(self, columns, number: int, points) -> np.ndarray:
        """(n, 3) mean of ``columns`` (m, 3) of the samples of a face that are nearest to points
        (n, 3)."""
        near = self._faces[number].samples[self._trees.nearest(number, points, 6)[0]]
        return np.asarray(columns[near].mean(axis=1))
