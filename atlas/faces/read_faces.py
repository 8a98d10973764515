"""Faces read from an atlas's samples."""

import numpy as np

from touchatlas.atlas.faces.boundaries import find_boundaries
from touchatlas.atlas.faces.faces import Faces, join_faces
from touchatlas.atlas.faces.labelling import label_samples
from touchatlas.atlas.faces.options import FaceOptions
from touchatlas.atlas.faces.revise import refit
from touchatlas.atlas.faces.rim_labels import move_to_rims
from touchatlas.atlas.faces.samples import ContourSamples, contour_samples
from touchatlas.atlas.state import AtlasState

# Rounds of labels by the sides of rims, and fits of the pieces; the second changes 2 per mille of
# the labels of a plate. Doubled, it takes twice as long.
_RIM_ROUNDS = 2


def read_faces(state: AtlasState, options: FaceOptions = FaceOptions()) -> Faces:
    """The faces of the samples of an atlas, from scratch. The atlas does not change.

    Parameters
    ----------
    state : AtlasState
    options : FaceOptions

    Notes
    -----
    The standard deviation of a sample is that of the noise that its contour states, and the lack of
    fit that the atlas bears.
    """
    if not len(state.membership.pool):
        return Faces((), (), np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))
    return faces_of_samples(samples_of(state), options)


def faces_of_samples(samples: ContourSamples, options: FaceOptions = FaceOptions()) -> Faces:
    """The faces of samples of contours."""
    labels = label_samples(samples, options)
    for _ in range(_RIM_ROUNDS):
        move_to_rims(labels, find_boundaries(labels))
        refit(labels)
    return join_faces(labels, find_boundaries(labels))


def samples_of(state: AtlasState) -> ContourSamples:
    """The samples of an atlas that has some, with contours and normals."""
    pool, table = state.membership.pool, state.table
    noise = np.sqrt((table.measurement_std[table.rows] ** 2).mean()) if len(state) else 0.0
    std = float(np.hypot(noise, state.bias))
    return contour_samples(pool.points.copy(), pool.normals.copy(), pool.across.copy(), std)
