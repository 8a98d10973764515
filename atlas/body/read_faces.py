"""Faces read from an atlas's samples, and which of them contours determine."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.edges.boundaries import find_boundaries
from touchatlas.atlas.faces.faces import Face, Faces
from touchatlas.atlas.faces.join_faces import join_faces
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.labelling import label_samples, relabel
from touchatlas.atlas.relabel.moves import find_roundings
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import evenly


def read_faces(
    pool: SamplePool, std: float, levels: Levels = Levels(), before: Faces | None = None
) -> Faces:
    """The faces of the samples of a pool, without those that one contour alone has met.

    Parameters
    ----------
    pool : SamplePool
    std : float, length
        Standard deviation of the surest samples: of noise, and the lack of fit that is borne.
    levels : Levels
    before : Faces, optional
        Those of the first of the samples.
    """
    if not len(pool):
        none, nowhere = np.zeros(0, int), np.zeros((0, 3))
        return Faces((), (), nowhere, nowhere, none, none, none, std, nowhere[:, 0])
    samples = samples_of(pool, len(pool), std, levels)
    found = determined(faces_of_samples(samples, before=before), samples)
    return with_uncrossed_edges(Body(found, samples)) if len(found) > 1 else found


def faces_of_samples(samples: ContourSamples, before: Faces | None = None) -> Faces:
    """The faces of samples of contours; if those ``before`` of the first of the samples are known,
    only what the new ones touch is read again."""
    return faces_of_labels(label_samples(samples) if before is None else relabel(samples, before))


def faces_of_labels(labels: Labels) -> Faces:
    """The faces of a labelling, and nothing else: so that they can be made again from a file."""
    find_roundings(labels)
    return join_faces(labels, find_boundaries(labels))


def samples_of(
    pool: SamplePool,
    count: int,
    std: float,
    levels: Levels = Levels(),
    before: ContourSamples | None = None,
) -> ContourSamples:
    """The first ``count`` samples of a pool, with contours and normals; the surest of them have the
    standard deviation ``std``, length. ``before`` are the first of them, if they are known: see
    ``contour_samples``."""
    columns = pool.points, pool.normals, pool.across, pool.noise, pool.contours, pool.measured
    points, normals, across, noise, numbers, measured = (c[:count].copy() for c in columns)
    # All have one lack of fit, beside the noise of each.
    stds = np.sqrt(std**2 + (noise**2 - noise.min() ** 2))
    own = std, levels, stds, numbers, measured, pool.tip_radius, before
    return contour_samples(points, normals, across, *own)


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
        Kind.PLANE, samples.points[others], samples.normals[others], samples.stds[others]
    )
    if plane is None:
        return False
    distance, _, variance = plane.predicted(samples.points[members[largest]])
    sure, std = samples.levels.sure, samples.stds[members[largest]]
    known = variance < (sure * std) ** 2
    met = np.abs(distance) < sure * np.sqrt(variance + std**2)
    return bool(np.mean(known & met) > 0.5)
