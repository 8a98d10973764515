"""Round holes of a lawful body: hollow cylinders with samples all around their axes."""

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.faces.faces import Face

# Largest standard deviation of the radius of a hole, over the radius. Doubled, a few samples on two
# sides of a bent wall are a hole.
_SURE = 0.02


def smallest_hole(body: Body) -> float:
    """Radius of the smallest round hole of a body, length; infinite where none is known."""
    return min((_radius(body, face) for face in body.faces.faces), default=np.inf)


def _radius(body: Body, face: Face) -> float:
    """Radius of a face that is a hole, with samples on more than half of all sides of its axis,
    length; infinite of another."""
    if face.law is None or not face.law.words.startswith("hollow cylinder"):
        return np.inf
    numbers, normals = face.law.numbers, body.faces.normals[face.samples]
    radius, axis = float(np.ravel(numbers["radius"])[0]), np.ravel(numbers["axis"])
    if np.ravel(numbers["radius_std"])[0] > _SURE * radius:
        return np.inf
    across = normals[0] - (normals[0] @ axis) * axis
    angle = np.sort(np.arctan2(normals @ np.cross(axis, across), normals @ across))
    widest = np.diff(angle, append=angle[:1] + 2.0 * np.pi).max()
    return radius if widest < np.pi else np.inf
