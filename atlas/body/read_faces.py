"""Faces read from an atlas's samples."""

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.explained import determined
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.edges.boundaries import find_boundaries
from touchatlas.atlas.edges.rim_labels import move_to_rims
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.join_faces import join_faces
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.absorb import absorb
from touchatlas.atlas.relabel.crossed_links import cut_crossed_links
from touchatlas.atlas.relabel.labelling import label_samples, relabel
from touchatlas.atlas.relabel.revise import refit
from touchatlas.atlas.relabel.unite import unite
from touchatlas.atlas.samples.sample_pool import SamplePool


def read_faces(
    pool: SamplePool, std: float, levels: Levels = Levels(), before: Faces | None = None
) -> Faces:
    """The faces of the samples of a pool, without those that one contour alone has met.

    Parameters
    ----------
    pool : SamplePool
    std : float, length
        Standard deviation of a sample: of its noise, and the lack of fit that is borne.
    levels : Levels
    before : Faces, optional
        Those of the first of the samples.
    """
    if not len(pool):
        none = np.zeros(0, int)
        return Faces((), (), np.zeros((0, 3)), np.zeros((0, 3)), none, none, none, std)
    samples = samples_of(pool, len(pool), std, levels)
    found = determined(faces_of_samples(samples, before=before), samples)
    return with_uncrossed_edges(Body(found, samples)) if len(found) > 1 else found


def faces_of_samples(
    samples: ContourSamples, options: FaceOptions = FaceOptions(), before: Faces | None = None
) -> Faces:
    """The faces of samples of contours; if those ``before`` of the first of the samples are known,
    only what the new ones touch is read again."""
    if before is None:
        return _read_again(samples, options, faces_of_revised(label_samples(samples, options)))
    # Labels from before were moved to rims already.
    return faces_of_revised(relabel(samples, before, options), rounds=1)


def _read_again(samples: ContourSamples, options: FaceOptions, found: Faces) -> Faces:
    """The faces of samples, read again from those that were found, until their labels stay."""
    for _ in range(5 if len(found.rounded) else 0):
        before, found = found, faces_of_samples(samples, options, found)
        changed = np.count_nonzero(found.patch_of != before.patch_of)
        if len(found.pieces) == len(before.pieces) and changed <= 1e-3 * len(samples):
            break
    return found


def faces_of_revised(labels: Labels, rounds: int = 2) -> Faces:
    """The faces of a labelling that was revised: blunt edges absorb samples, and labels move to the
    sides of rims that they are on, in so many rounds."""
    # An edge beside one part of a face must not absorb another part.
    _unite_all(labels)
    if absorb(labels):
        refit(labels)
        _unite_all(labels)
    for _ in range(rounds):
        labels.drop_empty()
        cut_crossed_links(labels)
        boundaries = find_boundaries(labels)
        if not move_to_rims(labels, boundaries):
            return join_faces(labels, boundaries)
        refit(labels)
    labels.drop_empty()
    return faces_of_labels(labels)


def _unite_all(labels: Labels) -> None:
    """Unite parts of lawful faces until none are left, and fit their pieces again."""
    while unite(labels):
        refit(labels)


def faces_of_labels(labels: Labels) -> Faces:
    """The faces of a labelling, and nothing else: so that they can be made again from a file."""
    cut_crossed_links(labels)
    return join_faces(labels, find_boundaries(labels))


def samples_of(
    pool: SamplePool, count: int, std: float, levels: Levels = Levels()
) -> ContourSamples:
    """The first ``count`` samples of a pool, with contours and normals."""
    points, normals, across = (
        column[:count].copy() for column in (pool.points, pool.normals, pool.across)
    )
    return contour_samples(points, normals, across, std, levels)
