"""Points beside blunt edges and corners: the distance of the ball that rounds them."""

import numpy as np

from touchatlas.atlas.edges.rolling_ball import radius_slope, rounded_corner, rounded_edge
from touchatlas.atlas.faces.face_corners import FaceCorner
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.field.face_trees import FaceTrees

# Distance from the surface up to which corners are rounded, in radii. Doubled, more points are
# asked in vain.
_NEAR = 2.0
# Distance from the samples of each face of a corner, over ``reach``. Doubled, corners are rounded
# where extended faces meet.
_REACH = 2.0
# Difference of two distances that are one, in radii: rounding. Doubled, nothing changes.
_SAME = 1e-6
# Noise of a sample, in root mean squares of its face. Doubled, balls are seen farther from samples.
_NOISE = 4.0


# A blunt edge or corner, its faces, and rows of points.
_Asked = tuple[FaceEdge | FaceCorner, tuple[int, ...], np.ndarray]


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
        edges, faces = trees.faces.edges, np.arange(len(trees.faces))
        # Each with which faces are its own, and which of them end it at an edge of its own sign.
        self._edges = [
            (edge, np.isin(faces, (edge.first, edge.second)), np.isin(faces, _beside(edges, edge)))
            for edge in edges
            if edge.radius > 0.0
        ]
        self._corners = [(one, np.isin(faces, one.faces)) for one in trees.faces.corners]

    def round(self, points, distances, owner, decides, chosen) -> None:
        """Change the distances and normals (n, 5) that were chosen at points (n, 3) to those of
        balls, where these take more of a convex edge or corner away, or fill more of a concave one.
        The points are at distances (n, f) from all faces, of faces ``owner`` (n,), and cut by faces
        ``decides`` (n,)."""
        asked = self._asked(distances, owner, decides)
        values = self._values(points, asked)
        for part, faces, rows in asked:
            here = np.stack([values[k][rows] for k in faces], axis=1)
            if isinstance(part, FaceEdge):
                self._raise_to_edge(part, here, points, rows, chosen)
            else:
                self._raise_to_corner(part, here, points, rows, chosen)

    def _asked(self, distances, owner, decides) -> list[_Asked]:
        """The edges and corners that may round points, their faces, and the rows (m,) of these."""
        out: list[_Asked] = []
        for edge, own, ends in self._edges:
            faces = edge.first, edge.second
            rows = _near(faces, edge.kind.sign, edge.radius, distances)
            out.append((edge, faces, rows[own[decides[rows]] & ends[owner[rows]]]))
        for corner, own in self._corners:
            rows = _near(corner.faces, corner.sign, corner.radius, distances)
            out.append((corner, corner.faces, rows[own[owner[rows]]]))
        return [one for one in out if len(one[2])]

    def _values(self, points, asked) -> dict[int, np.ndarray]:
        """What each face says of the points (n, 3), an array (n, 5), in those rows that are
        asked."""
        out = {}
        for face in {k for _, faces, _ in asked for k in faces}:
            rows = np.unique(np.concatenate([rows for _, faces, rows in asked if face in faces]))
            out[face] = np.empty((len(points), 5))
            out[face][rows] = self._trees.values(face, points[rows])
        return out

    def _raise_to_edge(self, edge: FaceEdge, values, points, rows, chosen) -> None:
        """Change what was chosen for ``rows`` (m,) to the ball of a blunt edge, of whose faces the
        values (m, 2, 5) are given."""
        sign, mine, theirs = edge.kind.sign, values[:, 0], values[:, 1]
        cosine = (mine[:, 1:4] * theirs[:, 1:4]).sum(axis=1)
        found, weights = rounded_edge(sign * mine[:, 0], sign * theirs[:, 0], cosine, edge.radius)
        higher = (weights.min(axis=1) > 0.0) & (found > sign * chosen[rows, 0])
        # Where the face that is farther out was left out, the edge is not there.
        sharp = np.maximum(sign * mine[:, 0], sign * theirs[:, 0])
        higher &= sign * chosen[rows, 0] >= sharp - _SAME * edge.radius
        higher = self._believed((edge.first, edge.second), found, points[rows], higher)
        weights, mine, theirs, rows = weights[higher], mine[higher], theirs[higher], rows[higher]
        chosen[rows, 0] = sign * found[higher]
        chosen[rows, 1:4] = weights[:, :1] * mine[:, 1:4] + weights[:, 1:] * theirs[:, 1:4]
        variance = np.maximum(mine[:, 4], theirs[:, 4])
        chosen[rows, 4] = variance + (radius_slope(weights) * edge.radius_std) ** 2

    def _raise_to_corner(self, corner: FaceCorner, values, points, rows, chosen) -> None:
        """Change what was chosen for ``rows`` (m,) to the ball of a corner, of whose faces the
        values (m, 3, 5) are given."""
        sign, radius = corner.sign, np.full(len(rows), corner.radius)
        found, normal, ball = rounded_corner(sign * values[..., 0], values[..., 1:4], radius)
        before = chosen[rows, 0]
        higher = ball & (found > sign * before) & (np.abs(before) < _NEAR * corner.radius)
        higher = self._believed(corner.faces, found, points[rows], higher)
        chosen[rows[higher], 0] = sign * found[higher]
        chosen[rows[higher], 1:4] = normal[higher]

    def _believed(self, faces, found, points, asked) -> np.ndarray:
        """Rows (k,) of points (m, 3), of those that are asked (m,), that lie near samples of all
        faces, and no farther from the surface than from a sample, by distances ``found`` (m,)."""
        rows = np.flatnonzero(asked)
        if not len(rows):
            return rows
        away = np.stack([self._trees.away(k, points[rows]) for k in faces])
        noise = _NOISE * np.array([self._trees.faces.faces[k].deviation for k in faces])
        near = away.max(axis=0) < _REACH * self._reach
        return rows[near & (np.abs(found[rows]) < (away + noise[:, None]).min(axis=0))]


def _near(faces, sign: float, radius: float, distances) -> np.ndarray:
    """Rows (m,) of the points at distances (n, f) that lie within a radius of all faces, or beyond
    them."""
    near = sign * distances[:, list(faces)] > -radius
    return np.flatnonzero(near.all(axis=1))


def _beside(edges, own: FaceEdge) -> list[int]:
    """The faces of an edge, and those that have an edge of its kind with one of these."""
    pair = {own.first, own.second}
    alike = [edge for edge in edges if edge.kind is own.kind]
    return sorted({k for e in alike if pair & {e.first, e.second} for k in (e.first, e.second)})
