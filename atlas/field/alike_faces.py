"""Alike faces: several faces that are one surface, as parts of one plane are."""

import numpy as np

from touchatlas.atlas.field.face_trees import FaceTrees


def alike_faces(trees: FaceTrees, noise) -> tuple[np.ndarray, np.ndarray]:
    """(f,) the first face that is one surface with each: most samples of the later one lie on it
    within the noise (f,), with its normal or the opposite one; and (f,) 1 or -1, for its normal."""
    faces = trees.faces.faces
    one, way = np.arange(len(faces)), np.ones(len(faces))
    for later in range(len(faces)):
        some = slice(None, None, max(1, len(faces[later].samples) // 64))
        points = trees.faces.points[faces[later].samples[some]]
        on = np.abs(trees.between[later][some]) < noise + noise[later]
        for first in np.flatnonzero(on[:, :later].mean(axis=0) > 0.5).tolist():
            normals = [trees.of(k).level(points)[:, 1:] for k in (first, later)]
            cosine = (normals[0] * normals[1]).sum(axis=1)
            if (on[:, first] & (np.abs(cosine) > 0.99)).mean() > 0.5:
                one[later], way[later] = one[first], way[first] * np.sign(np.median(cosine))
                break
    return one, way
