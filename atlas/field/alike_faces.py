"""Alike faces: several faces that are one surface, as parts of one plane are."""

import numpy as np

from touchatlas.atlas.field.face_trees import FaceTrees


def alike_faces(trees: FaceTrees, noise) -> tuple[np.ndarray, np.ndarray]:
    """(f,) the first face that is one surface with each: most samples of the later one lie on it
    within the noise (f,), with its normal or the opposite one; and (f,) 1 or -1, for its normal."""
    faces = trees.faces.faces
    one, way = np.arange(len(faces)), np.ones(len(faces))
    for later in range(len(faces)):
        samples = faces[later].samples
        points = trees.faces.points[samples[:: max(1, len(samples) // 64)]]
        normals = trees.values(later, points)[:, 1:4]
        for first in range(later):
            values = trees.values(first, points)
            cosine = (values[:, 1:4] * normals).sum(axis=1)
            on = np.abs(values[:, 0]) < noise[first] + noise[later]
            on &= np.abs(cosine) > 0.99
            if on.mean() > 0.5:
                one[later], way[later] = one[first], way[first] * np.sign(np.median(cosine))
                break
    return one, way
