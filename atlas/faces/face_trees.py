"""FaceTrees: the samples of each face by place, and what each face says of points."""

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.faces.kinds import Kind
from touchatlas.atlas.faces.piece import Piece

# Points of a curve that distances are measured to, per point of the edge. Doubled, nothing changes.
_FINER = 8


class FaceTrees:
    """The samples of each face by place.

    Parameters
    ----------
    faces : Faces
    """

    def __init__(self, faces: Faces) -> None:
        self.faces = faces
        self.trees = [cKDTree(faces.points[face.samples]) for face in faces.faces]

    def away(self, number: int, points) -> np.ndarray:
        """(n,) distances of points (n, 3) from the samples of a face, length."""
        return np.asarray(self.trees[number].query(points)[0])

    def nearest(self, number: int, points, count: int) -> tuple[np.ndarray, np.ndarray]:
        """(n, k) which samples of a face are nearest to points (n, 3), ``count`` or all, and how
        far they are, length."""
        count = min(count, len(self.faces.faces[number].samples))
        off, near = self.trees[number].query(points, k=count)
        return np.reshape(near, (len(points), count)), np.reshape(off, (len(points), count))

    @cached_property
    def between(self) -> list[np.ndarray]:
        """Of each face, the signed distances (m, f) of its samples from all faces, length."""
        return [self.all_distances(self.faces.points[face.samples]) for face in self.faces.faces]

    def values(self, number: int, points) -> np.ndarray:
        """(n, 5) distance, normal and variance of a face, by the patch of its nearest sample."""
        pieces = self.faces.faces[number].pieces
        if len(pieces) == 1:
            return values_of(pieces[0], points)
        out = np.empty((len(points), 5))
        for piece, mine in self._pieces(number, points):
            out[mine] = values_of(piece, points[mine])
        return out

    def distances(self, number: int, points) -> np.ndarray:
        """(n,) signed distances of points (n, 3) from a face, by the patch of its nearest
        sample."""
        out = np.empty(len(points))
        for piece, mine in self._pieces(number, points):
            out[mine] = piece.at(points[mine])[0]
        return out

    def all_distances(self, points) -> np.ndarray:
        """(n, f) signed distances of points (n, 3) from all faces; from planes at once."""
        out = np.empty((len(points), len(self.faces)))
        middle, planes, normals, levels = self._planes
        out[:, planes] = (points - middle) @ normals.T + levels
        for k in set(range(len(self.faces))) - set(planes):
            out[:, k] = self.distances(k, points)
        return out

    @cached_property
    def _planes(self) -> tuple[np.ndarray, list[int], np.ndarray, np.ndarray]:
        """A point amid the samples (3,), the numbers (p) of the plane faces, their normals (p, 3)
        and signed distances (p,) there."""
        middle = self.faces.points.mean(axis=0)
        faces = [face for face in self.faces.faces if face.pieces[0].kind is Kind.PLANE]
        faces = [face for face in faces if len(face.pieces) == 1]
        found = [face.pieces[0].at(middle[None]) for face in faces]
        normals = np.reshape([normal for _, normal in found], (-1, 3))
        return middle, [f.id for f in faces], normals, np.ravel([level for level, _ in found])

    def shape_operators(self, number: int, points) -> np.ndarray:
        """(n, 3, 3) shape operators of a face, 1/length, by the patch of its nearest sample."""
        out = np.empty((len(points), 3, 3))
        for piece, mine in self._pieces(number, points):
            out[mine] = piece.shape_operators(points[mine])
        return out

    def _pieces(self, number: int, points) -> Iterator[tuple[Piece, np.ndarray]]:
        """The pieces of a face, each with the indices of the points (n, 3) that are nearest to a
        sample of it."""
        face = self.faces.faces[number]
        if len(face.pieces) == 1:
            yield face.pieces[0], np.arange(len(points))
            return
        _, near = self.trees[number].query(points)
        patches = self.faces.patch_of[face.samples[near]]
        for patch, piece in zip(face.patches, face.pieces, strict=True):
            yield piece, np.flatnonzero(patches == patch)


def curve_tree(edge: FaceEdge) -> cKDTree:
    """The curves of an edge by place."""
    return cKDTree(np.concatenate([_finer(curve) for curve in edge.curves]))


def values_of(piece: Piece, points) -> np.ndarray:
    """(n, 5) distance, normal and variance of a piece."""
    distance, normals, variance = piece.predicted(points)
    return np.column_stack([distance, normals, variance])


def _finer(curve) -> np.ndarray:
    """(k, 3) points along the straight lines between those of a curve."""
    at = np.linspace(0.0, len(curve) - 1.0, _FINER * len(curve))
    steps = np.arange(len(curve))
    return np.stack([np.interp(at, steps, column) for column in curve.T], axis=1)
