"""The field of faces: signed distance, normal and deviation at any point, each face by its own."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.boundaries import EdgeKind
from touchatlas.atlas.faces.edge_curves import rim_distances
from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.faces.labels import NONE
from touchatlas.atlas.faces.piece import Piece

# Nearest samples that say which patches reach a point. Doubled, free-form patches are blended
# farther, and faces are cut beyond the ends of their edges.
_NEAREST = 16
# Distance from a sharp edge up to which the face beyond it is asked, over that of the last of the
# nearest samples, and from the samples of that face, over ``reach``. Doubled, faces are cut by the
# extension of others.
_BESIDE = 2.0
# How far outside of the face beyond an edge a point must lie, over the least of so many nearest
# samples of its own face: one may have a wrong label. Doubled, points far from samples are not cut,
# or slits run on beyond edges.
_CROSSED, _ABOUT = 2.0, 3
# Noise of a sample beside an edge, in root mean squares of its face. Doubled, faces are cut by the
# extension of others that lie less than eight of these farther in.
_NOISE = 4.0
# Points of a curve that distances are measured to, per point of the edge. Doubled, nothing changes.
_FINER = 8
# Distance to a sample of the face beyond a smooth rim, over that to the nearest sample, below which
# the rim says of which face a point is. Doubled, rims are asked far from where they are known.
_BESIDE_RIM = 3.0
# Samples of either face that say on which side of a rim it lies. Doubled, narrow faces have wrong
# sides.
_SIDE = 6
# Distance to a sample of another face, over that to the nearest sample, below which a point may
# belong to that face. Doubled, more points between two faces are doubted.
_RIVAL = 2.0


@dataclass(frozen=True, eq=False)
class FaceValues:
    """What the faces say of n points.

    Parameters
    ----------
    distance : (n,) float, length
        Signed, positive outside.
    normal : (n, 3) float, unit, world
        Outward.
    deviation : (n,) float, length
        Predicted standard deviation of the distance: that of the coefficients, and half of the
        difference of two faces where both may have the point.
    face : (n,) int
        Id of the face that decides.
    """

    distance: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    face: np.ndarray


class FaceField:
    """The field of faces.

    Parameters
    ----------
    faces : Faces
    reach : float, length
        Distance from the samples of a face up to which it may bound another.

    Raises
    ------
    ValueError
        Without a face.
    """

    def __init__(self, faces: Faces, reach: float = 0.0) -> None:
        if not len(faces):
            raise ValueError("there is no face; add touches to the atlas first")
        self.faces, self.reach = faces, reach
        self._known = np.flatnonzero(faces.of != NONE)
        self._tree = cKDTree(faces.points[self._known])
        self._trees = [cKDTree(faces.points[face.samples]) for face in faces.faces]
        self._sharp = [edge for edge in faces.edges if edge.kind.sharp and edge.curves]
        self._rims = [
            edge
            for edge in faces.edges
            if edge.kind is EdgeKind.SMOOTH_RIM and edge.curves and _are_lawful(faces, edge)
        ]
        # The faces with which each has a sharp edge, and its sign.
        self._around: list[list[tuple[int, float]]] = [[] for _ in faces.faces]
        for edge in self._sharp:
            self._around[edge.first].append((edge.second, _sign(edge)))
            self._around[edge.second].append((edge.first, _sign(edge)))
        self._curves, self._rim_curves = (
            [cKDTree(np.concatenate([_finer(c) for c in edge.curves])) for edge in edges]
            for edges in (self._sharp, self._rims)
        )

    @cached_property
    def _meet(self) -> np.ndarray:
        """(f, f) whether two faces have an edge or rim in common, or are one."""
        out = np.eye(len(self.faces), dtype=bool)
        for edge in self.faces.edges:
            out[edge.first, edge.second] = out[edge.second, edge.first] = True
        return out

    def at(self, points) -> FaceValues:
        """Signed distance, normal, deviation and face at points (n, 3), length, world.

        A point belongs to the face of the nearest sample. Patches of one free-form face are
        averaged, each with the weight of its samples near the point. At a sharp edge the distance
        is the largest of those of the faces that meet there in a convex edge, the smallest in a
        concave one.
        """
        points = np.asarray(points, float)
        faces, count = self.faces, min(_NEAREST, len(self._known))
        away, near = self._tree.query(points, k=count)
        away = away.reshape(len(points), count)
        near = self._known[near.reshape(len(points), count)]
        owner = faces.of[near[:, 0]]
        columns = _by_face(faces, points, away, near)
        chosen = columns[owner, np.arange(len(points))]
        chosen[:, 4] += self._doubt(columns, owner, away, near)
        self._move_to_rims(points, away, owner, chosen)
        decides = owner.copy()
        for edge, curve in zip(self._sharp, self._curves, strict=True):
            for own, other in ((edge.first, edge.second), (edge.second, edge.first)):
                rows = np.flatnonzero(owner == own)
                limit = _BESIDE * away[rows, -1]
                beside = curve.query(points[rows])[0] < limit
                if self.reach:
                    beside |= self._trees[other].query(points[rows])[0] < _BESIDE * self.reach
                rows = rows[beside]
                self._cut(_sign(edge), (own, other), rows, points[rows], chosen, decides)
        normal = chosen[:, 1:4] / np.linalg.norm(chosen[:, 1:4], axis=1)[:, None]
        return FaceValues(chosen[:, 0], normal, np.sqrt(chosen[:, 4]), decides)

    def _move_to_rims(self, points, away, owner, chosen) -> None:
        """Give points (n, 3) beside smooth rims to the face of their side: between touches the
        nearest sample may be of the other one."""
        faces = self.faces.faces
        for edge, curve in zip(self._rims, self._rim_curves, strict=True):
            pair = edge.first, edge.second
            rows = np.flatnonzero((owner == pair[0]) | (owner == pair[1]))
            limit = np.maximum(_BESIDE_RIM * away[rows, 0], away[rows, -1])
            # Curves end where contours do: it is asked a little farther than points are moved.
            near = curve.query(points[rows])[0] < 2.0 * limit
            rows, limit = rows[near], limit[near]
            apart = [self._trees[k].query(points[rows])[0] for k in pair]
            rows, limit = (x[np.maximum(*apart) < limit] for x in (rows, limit))
            if not len(rows):
                continue
            toward = self._mean_near(pair[0], points[rows]) - self._mean_near(pair[1], points[rows])
            first, second = (faces[k].pieces[0] for k in pair)
            across = rim_distances(first, second, points[rows], toward)
            own = np.where(across > 0.0, *pair)
            for k in pair:
                moved = rows[(own == k) & (owner[rows] != k) & (np.abs(across) < limit)]
                chosen[moved], owner[moved] = self._of_face(k, points[moved]), k

    def _mean_near(self, number: int, points) -> np.ndarray:
        """(n, 3) mean of the samples of a face that are nearest to points (n, 3)."""
        samples = self.faces.faces[number].samples
        _, near = self._trees[number].query(points, k=min(_SIDE, len(samples)))
        index = samples[near.reshape(len(points), -1)]
        return np.asarray(self.faces.points[index].mean(axis=1))

    def _cut(self, sign: float, pair, rows, points, chosen, decides) -> None:
        """Let the second face of a pair decide for points (m, 3) of ``rows`` (m,) of the first,
        where it is the farther out; at a concave edge, of sign -1, the farther in.

        A point whose nearest samples are as far out lies where the edge does not bound its face.
        """
        if not len(rows):
            return
        own, other = pair
        samples = self.faces.faces[own].samples
        _, near = self._trees[own].query(points, k=min(_ABOUT, len(samples)))
        nearest = self.faces.points[samples[near]].reshape(-1, 3)
        before = sign * self._where_it_is(sign, pair, nearest)[0][:, 0]
        before = before.reshape(len(points), -1).min(axis=1)
        before = before - _NOISE * self.faces.faces[other].deviation
        theirs, which = self._where_it_is(sign, pair, points)
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], _CROSSED * before)
        chosen[rows[wins]], decides[rows[wins]] = theirs[wins], which[wins]

    def _where_it_is(self, sign: float, pair, points) -> tuple[np.ndarray, np.ndarray]:
        """Distance, normal and variance (m, 5) of the second face of a pair at points (m, 3), and
        the face that decides (m,): that face, or one that ends it at an edge of the other sign.

        At a corner of edges of one sign each face bounds the others, wherever it ends.
        """
        own, other = pair
        theirs, which = self._of_face(other, points), np.full(len(points), other)
        samples = self.faces.faces[other].samples
        away, near = self._trees[other].query(points)
        nearest = self.faces.points[samples[near]]
        limit = np.maximum(_BESIDE * away, self.reach)
        for third in [k for k, kind in self._around[other] if kind == -sign and k != own]:
            noise = _NOISE * self.faces.faces[third].deviation
            # Its nearest sample beyond the third shows that the face goes on there.
            ends = -sign * self._of_face(third, nearest)[:, 0] < noise
            ends &= self._trees[third].query(points)[0] < limit
            values = self._of_face(third, points)
            ends &= sign * values[:, 0] < sign * theirs[:, 0]
            theirs[ends], which[ends] = values[ends], third
        return theirs, which

    def _of_face(self, number: int, points) -> np.ndarray:
        """(n, 5) distance, normal and variance of a face, by the patch of its nearest sample."""
        face = self.faces.faces[number]
        if len(face.pieces) == 1:
            return _values(face.pieces[0], points)
        _, near = self._trees[number].query(points)
        patches = self.faces.patch_of[face.samples[near]]
        out = np.empty((len(points), 5))
        for patch, piece in zip(face.patches, face.pieces, strict=True):
            out[patches == patch] = _values(piece, points[patches == patch])
        return out

    def _doubt(self, columns, owner, away, near) -> np.ndarray:
        """(n,) variance of the distance where a face that does not meet the owner has a sample
        about as near: the square of half of the difference of both, less the farther it is."""
        of, rows = self.faces.of[near], np.arange(len(owner))
        # At a sample itself every other one is far away.
        least = np.maximum(away[:, :1], np.finfo(float).eps * away[:, -1:])
        ratio = away / np.maximum(least, np.finfo(float).tiny)
        rival = (ratio < _RIVAL) & ~self._meet[owner[:, None], of]
        first = rival.argmax(axis=1)
        other = of[rows, first]
        apart = 0.5 * (columns[other, rows, 0] - columns[owner, rows, 0])
        fade = _RIVAL - ratio[rows, first]
        return np.where(rival.any(axis=1), (fade * apart) ** 2, 0.0)


def face_values(faces: Faces, points) -> FaceValues:
    """Signed distance, normal, deviation and face at points (n, 3): see ``FaceField.at``."""
    return FaceField(faces).at(points)


def _sign(edge: FaceEdge) -> float:
    """1 for a convex edge, where the farther out decides; -1 for a concave one."""
    return 1.0 if edge.kind is EdgeKind.SHARP_CONVEX else -1.0


def _are_lawful(faces: Faces, edge: FaceEdge) -> bool:
    """Whether both faces of an edge are one piece."""
    return all(len(faces.faces[k].pieces) == 1 for k in (edge.first, edge.second))


def _finer(curve) -> np.ndarray:
    """(k, 3) points along the straight lines between those of a curve."""
    at = np.linspace(0.0, len(curve) - 1.0, _FINER * len(curve))
    steps = np.arange(len(curve))
    return np.stack([np.interp(at, steps, column) for column in curve.T], axis=1)


def _by_face(faces: Faces, points, away, near) -> np.ndarray:
    """(f, n, 5) distance, normal and variance of each face at each point, a mean over its patches;
    NaN where none of its samples is near."""
    reach = np.maximum(away[:, -1:], np.finfo(float).tiny)
    # A weight that falls to zero at the last of the nearest samples.
    weight = (1.0 - (away / reach) ** 2) ** 2 + 1e-9
    out = np.full((len(faces), len(points), 5), np.nan)
    patches = faces.patch_of[near]
    for face in faces.faces:
        total = np.zeros(len(points))
        sums = np.zeros((len(points), 5))
        for number, piece in zip(face.patches, face.pieces, strict=True):
            share = (weight * (patches == number)).sum(axis=1)
            rows = np.flatnonzero(share)
            sums[rows] += share[rows, None] * _values(piece, points[rows])
            total += share
        some = total > 0.0
        out[face.id, some] = sums[some] / total[some, None]
    return out


def _values(piece: Piece, points) -> np.ndarray:
    """(n, 5) distance, normal and variance of a piece."""
    distance, normals, variance = piece.predicted(points)
    return np.column_stack([distance, normals, variance])
