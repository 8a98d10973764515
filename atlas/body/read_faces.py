"""Faces read from an atlas's samples."""

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.explained import determined
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.edges.boundaries import find_boundaries
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.join_faces import join_faces
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.relabel.labelling import label_samples, relabel
from touchatlas.atlas.relabel.moves import find_roundings
from touchatlas.atlas.samples.sample_pool import SamplePool


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
        none = np.zeros(0, int)
        return Faces((), (), np.zeros((0, 3)), np.zeros((0, 3)), none, none, none, std)
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
    pool: SamplePool, count: int, std: float, levels: Levels = Levels()
) -> ContourSamples:
    """The first ``count`` samples of a pool, with contours and normals; the surest of them have the
    standard deviation ``std``, length."""
    columns = pool.points, pool.normals, pool.across, pool.noise, pool.contours, pool.measured
    points, normals, across, noise, numbers, measured = (c[:count].copy() for c in columns)
    # All have one lack of fit, beside the noise of each.
    stds = np.sqrt(std**2 + (noise**2 - noise.min() ** 2))
    own = std, levels, stds, numbers, measured, pool.tip_radius
    return contour_samples(points, normals, across, *own)
