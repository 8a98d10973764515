"""Points beside blunt edges and corners: the distance of the ball that rounds them."""

import numpy as np

from touchatlas.atlas.edges.rolling_ball import radius_slope, rounded_corner, rounded_edge
from touchatlas.atlas.faces.face_corners import FaceCorner
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.field.face_trees import FacesAt, FaceTrees
from touchatlas.atlas.labels.labels import NONE

# A blunt edge or corner, its faces, rows of points, and which faces end an edge in edges of the
# other sign.
_Asked = tuple[FaceEdge | FaceCorner, tuple[int, ...], np.ndarray, np.ndarray]


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
        sharp = [(*_pair(edge), edge.kind.sign) for edge in trees.faces.edges if edge.kind.sharp]
        blunt = [edge for edge in trees.faces.edges if edge.radius > 0.0]
        # Each with which faces are its own, and which of them end it at an edge of its own sign,
        # and of the other one.
        ids = np.arange(len(trees.faces))
        beside = [_beside(edge, sharp) for edge in blunt]
        self._edges = [
            (edge, np.isin(ids, _pair(edge)), np.isin(ids, alike), np.isin(ids, other))
            for edge, (alike, other) in zip(blunt, beside, strict=True)
        ]
        self._corners = [(one, np.isin(ids, one.faces)) for one in trees.faces.corners]

    def round(self, at: FacesAt, owner, decides, chosen) -> None:
        """Change the distances and normals (n, 5) that were chosen at n points to those of balls,
        where these take more of a convex edge or corner away, or fill more of a concave one. The
        points are of faces ``owner`` (n,), and cut by faces ``decides`` (n,), which change where a
        face ends an edge."""
        asked = self._asked(at.distances, owner, decides)
        values = self._values(at, asked)
        for part, faces, rows, other in asked:
            here = np.stack([values[k][rows] for k in faces], axis=1)
            if isinstance(part, FaceCorner):
                self._raise_to_corner(part, here, at.points, rows, chosen)
                continue
            ends, inner = np.flatnonzero(other), ~other[owner[rows]]
            self._raise_to_edge(part, here[inner], at, rows[inner], ends, chosen)
            taken = here[~inner], at, rows[~inner], owner, decides, chosen
            self._end_edge(part, *taken)

    def _asked(self, distances, owner, decides) -> list[_Asked]:
        """The edges and corners that may round points, their faces, and the rows (m,) of these."""
        out: list[_Asked] = []
        for edge, own, alike, other in self._edges:
            rows = _near(_pair(edge), edge.kind.sign, edge.radius, distances)
            its, decided = owner[rows], decides[rows]
            ended = other[its] & (own[decided] | (decided == its))
            out.append((edge, _pair(edge), rows[alike[its] & alike[decided] | ended], other))
        for corner, own in self._corners:
            rows = _near(corner.faces, corner.sign, corner.radius, distances)
            out.append((corner, corner.faces, rows[own[owner[rows]]], own))
        return [one for one in out if len(one[2])]

    def _values(self, at: FacesAt, asked) -> dict[int, np.ndarray]:
        """What each face says of n points, an array (n, 5), in those rows that are asked."""
        out = {}
        for face in {k for _, faces, *_ in asked for k in faces}:
            rows = np.unique(np.concatenate([rows for _, faces, rows, _ in asked if face in faces]))
            out[face] = np.empty((len(at.points), 5))
            out[face][rows] = at.values(face, rows)
        return out

    def _raise_to_edge(self, edge: FaceEdge, values, at: FacesAt, rows, ends, chosen) -> None:
        """Change what was chosen for ``rows`` (m,) to the ball of a blunt edge, of whose faces the
        values (m, 2, 5) are given, up to the faces that end it in edges of the other sign."""
        sign, pair = edge.kind.sign, edge.kind.sign * values[..., 0]
        found, weights = _ball(edge, values)
        higher = (weights.min(axis=1) > 0.0) & (found > sign * chosen[rows, 0])
        # Where the face that is farther out was left out, the edge is not there; but for rounding.
        higher &= sign * chosen[rows, 0] >= pair.max(axis=1) - 1e-6 * edge.radius
        higher = self._believed(_pair(edge), found, at.points[rows], higher)
        before, rows = sign * chosen[rows[higher], 0], rows[higher]
        chosen[rows] = _on_ball(edge, found[higher], weights[higher], values[higher])
        for face in ends:
            level = sign * at.distances[rows, face]
            lower = np.flatnonzero((level < sign * chosen[rows, 0]) & (level > before))
            mine = rows[lower[self._is_beside(face, edge, at.points[rows[lower]])]]
            chosen[mine] = at.values(face, mine)

    def _is_beside(self, face: int, edge: FaceEdge, points) -> np.ndarray:
        """(m,) whether a face has samples about as near to points (m, 3) as those of an edge."""
        away = np.stack([self._trees.away(k, points) for k in _pair(edge)])
        return np.asarray(self._trees.away(face, points) < 2.0 * away.min(axis=0))

    def _end_edge(self, edge: FaceEdge, values, at: FacesAt, rows, owner, decides, chosen):
        """Change what was chosen for ``rows`` (m,) of faces that end a blunt edge in edges of the
        other sign, as the ground ends the rounded edges of a block, and the top those of a pocket:
        one of the ball and that face decides, whatever its two faces say."""
        sign, (found, weights) = edge.kind.sign, _ball(edge, values)
        there = self._believed(_pair(edge), found, at.points[rows], weights.min(axis=1) > 0.0)
        rows, found, weights, values = rows[there], found[there], weights[there], values[there]
        # What that face decided another ball may have changed already.
        its_own = decides[rows] == owner[rows]
        level = sign * np.where(its_own, chosen[rows, 0], at.distances[rows, owner[rows]])
        ball = found <= level
        chosen[rows[ball]] = _on_ball(edge, found[ball], weights[ball], values[ball])
        rest = rows[~ball & ~its_own]
        decides[rest] = owner[rest]
        for face in np.unique(owner[rest]).tolist():
            mine = rest[owner[rest] == face]
            chosen[mine] = at.values(face, mine)

    def _raise_to_corner(self, corner: FaceCorner, values, points, rows, chosen) -> None:
        """Change what was chosen for ``rows`` (m,) to the ball of a corner, of whose faces the
        values (m, 3, 5) are given."""
        sign, radius = corner.sign, np.full(len(rows), corner.radius)
        found, normal, ball = rounded_corner(sign * values[..., 0], values[..., 1:4], radius)
        before = chosen[rows, 0]
        higher = ball & (found > sign * before) & (np.abs(before) < 2.0 * corner.radius)
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
        noise = self._trees.faces.levels.sure * np.array(
            [self._trees.faces.faces[k].deviation for k in faces]
        )
        near = away.max(axis=0) < 2.0 * self._reach
        return rows[near & (np.abs(found[rows]) < (away + noise[:, None]).min(axis=0))]


def face_of_each_sample(trees: FaceTrees) -> np.ndarray:
    """(n,) the face of each sample, NONE where it has none; of one on a rounding that of its faces
    which would decide at a sharp edge."""
    faces, out = trees.faces, trees.faces.of.copy()
    parts: list[tuple[tuple[int, ...], float, np.ndarray]] = [
        (_pair(edge), edge.kind.sign, edge.samples) for edge in faces.edges if edge.radius > 0.0
    ]
    parts += [(corner.faces, corner.sign, corner.samples) for corner in faces.corners]
    for own, sign, samples in parts:
        mine = samples[faces.of[samples] == NONE]
        out_of = [sign * trees.of(k).distances(faces.points[mine]) for k in own]
        out[mine] = np.array(own)[np.argmax(out_of, axis=0)]
    return out


def are_rounded(trees: FaceTrees, points, distances, reach: float) -> np.ndarray:
    """(n,) whether points (n, 3) at distances (n, f) from all faces lie between the ball of a blunt
    edge and the sharp edge that it rounds, where both of its faces have samples: there the sides of
    the faces do not say whether a point lies inside."""
    out = np.zeros(len(points), bool)
    for edge in trees.faces.edges:
        if not edge.radius > 0.0:
            continue
        pair, sign = _pair(edge), edge.kind.sign
        rows = _near(pair, sign, edge.radius, distances)
        rows = rows[(sign * distances[rows][:, pair] <= 0.0).all(axis=1)]
        for face in pair:
            rows = rows[trees.away(face, points[rows]) < 2.0 * reach]
        values = np.stack([trees.of(face).values(points[rows]) for face in pair], axis=1)
        noise = trees.faces.levels.sure * max(trees.faces.faces[face].deviation for face in pair)
        found, weights = _ball(edge, values)
        out[rows[(found > -noise) & (weights.min(axis=1) > 0.0)]] = True
    return out


def ball_distances(edge: FaceEdge, at: FacesAt) -> tuple[np.ndarray, np.ndarray]:
    """Rows (m,) of the points abreast of the ball of a blunt edge that are on the same side of it
    as of the sharp edge that it rounds, and how far (m,) they are from it, length."""
    rows = _near(_pair(edge), edge.kind.sign, edge.radius, at.distances)
    if not len(rows):
        return rows, np.zeros(0)
    found, weights = _ball(edge, np.stack([at.values(k, rows) for k in _pair(edge)], axis=1))
    sharp = (edge.kind.sign * at.distances[rows][:, _pair(edge)]).max(axis=1)
    there = (weights.min(axis=1) > 0.0) & (found * sharp > 0.0)
    return rows[there], np.abs(found[there])


def _pair(edge: FaceEdge) -> tuple[int, int]:
    """The faces of an edge."""
    return edge.first, edge.second


def _near(faces, sign: float, radius: float, distances) -> np.ndarray:
    """Rows (m,) of the points at distances (n, f) that lie within a radius of all faces, or beyond
    them."""
    near = sign * distances[:, list(faces)] > -radius
    return np.flatnonzero(near.all(axis=1))


def _ball(edge: FaceEdge, values) -> tuple[np.ndarray, np.ndarray]:
    """Distances (m,) from a blunt edge, times its sign, and the weights (m, 2) of both normals, by
    the values (m, 2, 5) of its faces."""
    one, other = edge.kind.sign * values[..., 0].T
    cosine = (values[:, 0, 1:4] * values[:, 1, 1:4]).sum(axis=1)
    return rounded_edge(one, other, cosine, edge.radius)


def _on_ball(edge: FaceEdge, found, weights, values) -> np.ndarray:
    """(m, 5) distance, normal and variance of a blunt edge, from what ``_ball`` says and the values
    (m, 2, 5) of its faces."""
    normal = (weights[..., None] * values[..., 1:4]).sum(axis=1)
    variance = values[..., 4].max(axis=1) + (radius_slope(weights) * edge.radius_std) ** 2
    return np.column_stack([edge.kind.sign * found, normal, variance])


def _beside(own: FaceEdge, sharp) -> tuple[list[int], list[int]]:
    """The faces of an edge, and those that have an edge of its sign with one of these; and the
    others that have one of the other sign with one of them; by pairs of faces and signs."""
    pair, sign = set(_pair(own)), own.kind.sign
    beside = [({one, other}, its) for one, other, its in sharp if pair & {one, other}]
    alike = pair.union(*(faces for faces, its in beside if its == sign))
    others = set().union(*(faces for faces, its in beside if its != sign))
    return sorted(alike), sorted(others - alike)
