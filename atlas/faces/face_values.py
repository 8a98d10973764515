"""The field of faces: signed distance, normal and deviation at any point, each face by its own."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.boundaries import EdgeKind
from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.faces.labels import NONE
from touchatlas.atlas.faces.piece import Piece

# Nearest samples that say which patches reach a point. Doubled, free-form patches are blended
# farther, and faces are cut beyond the ends of their edges.
_NEAREST = 16
# Distance from a sharp edge up to which the face beyond it is asked, over that of the last of the
# nearest samples. Doubled, faces are cut by the extension of others.
_BESIDE = 2.0
# How far outside of the face beyond an edge a point must lie, over its nearest sample. Doubled,
# points far from samples are not cut.
_CROSSED = 2.0
# Noise of a sample beside an edge, in root mean squares of its face. Doubled, faces are cut by the
# extension of others that lie less than eight of these farther in.
_NOISE = 4.0
# Points of a curve that distances are measured to, per point of the edge. Doubled, nothing changes.
_FINER = 8


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
        Predicted standard deviation of the distance, from that of the coefficients.
    face : (n,) int
        Id of the face that decides.
    """

    distance: np.ndarray
    normal: np.ndarray
    deviation: np.ndarray
    face: np.ndarray


def face_values(faces: Faces, points) -> FaceValues:
    """Signed distance, normal, deviation and face at points (n, 3), length, world.

    A point belongs to the face of the nearest sample. Patches of one free-form face are averaged,
    each with the weight of its samples near the point. At a sharp edge the distance is the largest
    of those of the faces that meet there in a convex edge, the smallest in a concave one.

    Raises
    ------
    ValueError
        Without a face.
    """
    points = np.asarray(points, float)
    if not len(faces):
        raise ValueError("there is no face; add touches to the atlas first")
    known = np.flatnonzero(faces.of != NONE)
    count = min(_NEAREST, len(known))
    away, near = cKDTree(faces.points[known]).query(points, k=count)
    away, near = away.reshape(len(points), count), known[near.reshape(len(points), count)]
    owner = faces.of[near[:, 0]]
    columns = _by_face(faces, points, away, near)
    chosen = columns[owner, np.arange(len(points))]
    decides = owner.copy()
    for edge in faces.edges:
        if edge.kind.sharp and edge.curves:
            reach = _BESIDE * away[:, -1]
            _cut(faces, edge, points, faces.points[near[:, 0]], reach, owner, chosen, decides)
    normal = chosen[:, 1:4] / np.linalg.norm(chosen[:, 1:4], axis=1)[:, None]
    return FaceValues(chosen[:, 0], normal, np.sqrt(chosen[:, 4]), decides)


def _cut(faces: Faces, edge: FaceEdge, points, nearest, reach, owner, chosen, decides) -> None:
    """Let the face beyond a sharp edge decide for points within their reach (n,) of the edge, where
    it is the farther out; at a concave edge the farther in.

    A point whose nearest sample (n, 3) is as far out lies where the edge does not bound its face.
    """
    away, _ = cKDTree(np.concatenate([_finer(curve) for curve in edge.curves])).query(points)
    sign = 1.0 if edge.kind is EdgeKind.SHARP_CONVEX else -1.0
    for own, other in ((edge.first, edge.second), (edge.second, edge.first)):
        rows = np.flatnonzero((owner == own) & (away < reach))
        if not len(rows):
            continue
        theirs = _of_face(faces, other, points[rows])
        before = sign * _of_face(faces, other, nearest[rows])[:, 0]
        before = before - _NOISE * faces.faces[other].deviation
        wins = sign * theirs[:, 0] > np.maximum(sign * chosen[rows, 0], _CROSSED * before)
        chosen[rows[wins]], decides[rows[wins]] = theirs[wins], other


def _finer(curve) -> np.ndarray:
    """(k, 3) points along the straight lines between those of a curve."""
    at = np.linspace(0.0, len(curve) - 1.0, _FINER * len(curve))
    steps = np.arange(len(curve))
    return np.stack([np.interp(at, steps, column) for column in curve.T], axis=1)


def _of_face(faces: Faces, number: int, points) -> np.ndarray:
    """(n, 5) distance, normal and variance of a face, by the patch of its nearest sample."""
    face = faces.faces[number]
    _, near = cKDTree(faces.points[face.samples]).query(points)
    patches = faces.patch_of[face.samples[near]]
    out = np.empty((len(points), 5))
    for patch, piece in zip(face.patches, face.pieces, strict=True):
        out[patches == patch] = _values(piece, points[patches == patch])
    return out


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
