"""Faces read from an atlas's samples."""

import numpy as np

from touchatlas.atlas.faces.boundaries import find_boundaries
from touchatlas.atlas.faces.faces import Faces, join_faces
from touchatlas.atlas.faces.labelling import label_samples
from touchatlas.atlas.faces.options import FaceOptions
from touchatlas.atlas.faces.revise import refit
from touchatlas.atlas.faces.rim_labels import move_to_rims
from touchatlas.atlas.faces.samples import ContourSamples, contour_samples
from touchatlas.atlas.patches.sample_pool import SamplePool

# Rounds of labels by the sides of rims, and fits of the pieces; the second changes 2 per mille of
# the labels of a plate. Doubled, it takes twice as long.
_RIM_ROUNDS = 2


def read_faces(pool: SamplePool, std: float, options: FaceOptions = FaceOptions()) -> Faces:
    """The faces of the samples of a pool, from scratch.

    Parameters
    ----------
    pool : SamplePool
    std : float, length
        Standard deviation of a sample: of its noise, and the lack of fit that is borne.
    options : FaceOptions
    """
    if not len(pool):
        return Faces((), (), np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))
    return faces_of_samples(samples_of(pool, len(pool), std), options)


def faces_of_samples(samples: ContourSamples, options: FaceOptions = FaceOptions()) -> Faces:
    """The faces of samples of contours."""
    labels = label_samples(samples, options)
    for _ in range(_RIM_ROUNDS):
        move_to_rims(labels, find_boundaries(labels))
        refit(labels)
    return join_faces(labels, find_boundaries(labels))


def samples_of(pool: SamplePool, count: int, std: float) -> ContourSamples:
    """The first ``count`` samples of a pool, with contours and normals."""
    points, normals, across = (
        column[:count].copy() for column in (pool.points, pool.normals, pool.across)
    )
    return contour_samples(points, normals, across, std)
