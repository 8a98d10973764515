"""What faces explain of the samples, and how many contours run over sharp edges."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.faces.faces import Face, Faces
from touchatlas.atlas.labels.grow import evenly
from touchatlas.atlas.labels.labels import NONE
from touchatlas.atlas.labels.samples import ContourSamples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.surfaces.sharp_turns import share_of_contours, sharp_turns
from touchatlas.patch.geometry.kinks import kinks

# Least fraction of the samples with a face that lawful ones explain. With twice the rest left out,
# free-form parts of a body are drawn as planes.
_LAWFUL = 0.9
# Number of faces from which a larger fraction of the samples may be of no face, which are unknown
# and touched again: small faces that one contour alone has met. On a part of 80 faces it was 0.14
# after 20 touches, of which faces knew 0.69 of the surface and sextics 0.32. Without a least number
# 25 explorations of small bodies took 522 touches instead of 508. The number doubled, such parts
# are drawn from sextics for longer; the fraction doubled, more free-form parts are drawn as planes.
_MANY_FACES, _REST = 20, 0.2
# Most samples by which a plane is fitted without one contour: a mean of so many is within a
# twentieth of a deviation. Doubled, it takes longer.
_FITTED = 400
# Largest predicted deviation where a contour tests a plane, in deviations of a sample: what labels
# bear. Doubled, a line and a few samples beside it pass for two lines.
_DOUBT = 3.0
# Largest distance of a sample from where it is predicted, in deviations of the difference. Doubled,
# a contour that is off by a lack of fit tests a plane, too.
_GATE = 3.0


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
    others = evenly(members[~largest], _FITTED)
    if len(others) < Kind.PLANE.parameters:
        return False
    plane = fit_piece(Kind.PLANE, samples.points[others], samples.normals[others], samples.std)
    if plane is None:
        return False
    distance, _, variance = plane.predicted(samples.points[members[largest]])
    sure = variance < (_DOUBT * samples.std) ** 2
    met = np.abs(distance) < _GATE * np.sqrt(variance + samples.std**2)
    return bool(np.mean(sure & met) > 0.5)


def share_with_edges(samples: ContourSamples, ends_at_edge) -> float:
    """Fraction of the contours that run over a sharp edge, or of which a sample (n,) is the last
    before one."""
    bounds = np.append(np.flatnonzero(np.diff(samples.contours, prepend=-1)), len(samples))
    found = [
        bool(ends_at_edge[a:b].any())
        or len(kinks(samples.points[a:b], samples.planes[a], samples.std)) > 0
        for a, b in zip(bounds[:-1], bounds[1:], strict=True)
    ]
    return float(np.mean(found))


def share_over_sharp_edges(samples: ContourSamples) -> float:
    """Fraction of the contours that turn by 35 degrees or more at a sharp edge."""
    return share_of_contours(samples, sharp_turns(samples))


def lawful_share(faces: Faces) -> float:
    """Fraction of the samples that lawful faces explain, and the rounding of their edges."""
    lawful = [face.id for face in faces.faces if face.law is not None]
    if not len(faces.of):
        return 0.0
    count = np.count_nonzero(np.isin(faces.of, lawful)) + len(faces.rounded)
    return count / len(faces.of)


def is_lawful(faces: Faces) -> bool:
    """Whether lawful faces explain nearly all samples; of many faces, most, and nearly all that
    have a face."""
    share, rest = lawful_share(faces), _REST if len(faces) >= _MANY_FACES else 1.0 - _LAWFUL
    least = max(1.0 - rest, _LAWFUL * (1.0 - faces.unexplained))
    return len(faces) > 1 and bool(share >= least)


def is_explained(faces: Faces) -> bool:
    """Whether faces of any kind, some of which meet in sharp edges, explain nearly all samples."""
    return 1.0 - faces.unexplained >= _LAWFUL and any(edge.kind.sharp for edge in faces.edges)
