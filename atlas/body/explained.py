"""Which faces contours determine."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.faces.faces import Face, Faces
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.patch.geometry.arrays import evenly


def determined(faces: Faces, samples: ContourSamples) -> Faces:
    """The same without the faces that contours do not determine: planes that no contour tests, and
    others that one contour alone has met, or another with few samples. Their samples belong to
    none."""
    kept = [face for face in faces.faces if _is_determined(face, samples)]
    number = {face.id: k for k, face in enumerate(kept)}
    table = np.array([number.get(face.id, NONE) for face in faces.faces] + [NONE])
    edges = tuple(
        replace(edge, first=number[edge.first], second=number[edge.second])
        for edge in faces.edges
        if edge.first in number and edge.second in number
    )
    corners = tuple(
        replace(corner, faces=(number[a], number[b], number[c]))
        for corner in faces.corners
        for a, b, c in [corner.faces]
        if {a, b, c} <= number.keys()
    )
    found = tuple(replace(face, id=k) for k, face in enumerate(kept))
    return replace(faces, faces=found, edges=edges, of=table[faces.of], corners=corners)


def _is_determined(face: Face, samples: ContourSamples) -> bool:
    """Whether the samples of a face determine more than curves in planes."""
    if face.law is None or face.pieces[0].kind is not Kind.PLANE:
        return samples.are_of_several_contours(face.samples)
    return _is_tested(face.samples, samples)


def _is_tested(members, samples: ContourSamples) -> bool:
    """Whether the contour with most samples of a plane (m,) lies where the others predict it.

    Two contours alone test nothing: all that one touch tracks on faces along its normal are lines
    parallel to it, and any two of them lie in one plane. Three lines lie on one cylinder, too; but
    where that was asked of cylinders and spheres, a box with wide roundings had a handle.
    """
    contours = samples.contours[members]
    largest = contours == np.bincount(contours).argmax()
    others = evenly(members[~largest], 400)
    if len(others) < Kind.PLANE.parameters:
        return False
    plane = fit_piece(
        Kind.PLANE, samples.points[others], samples.normals[others], samples.std_of(others)
    )
    if plane is None:
        return False
    distance, _, variance = plane.predicted(samples.points[members[largest]])
    sure, std = samples.levels.sure, samples.std_of(members[largest])
    known = variance < (sure * std) ** 2
    met = np.abs(distance) < sure * np.sqrt(variance + std**2)
    return bool(np.mean(known & met) > 0.5)
