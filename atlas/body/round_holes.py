"""Round holes of a lawful body: hollow cylinders with samples all around their axes."""

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.faces.faces import Face


def smallest_hole(body: Body) -> float:
    """Radius of the smallest round hole of a body, length; infinite where none is known."""
    return min((_radius(body, face) for face in body.faces.faces), default=np.inf)


def _radius(body: Body, face: Face) -> float:
    """Radius of a face that is a hole, with samples on more than half of all sides of its axis,
    length; infinite of another."""
    law = face.law
    if law is None or law.kind != "cylinder":
        return np.inf
    numbers = {name: np.asarray(value, float) for name, value in law.numbers.items()}
    if numbers["radius_std"] > 0.02 * numbers["radius"]:
        return np.inf
    normals, axis = body.faces.normals[face.samples], numbers["axis"]
    offset = body.faces.points[face.samples] - numbers["point"]
    # Normals of a hole point to its axis.
    if np.median((offset * normals).sum(axis=1)) > 0.0:
        return np.inf
    across = normals[0] - (normals[0] @ axis) * axis
    angle = np.sort(np.arctan2(normals @ np.cross(axis, across), normals @ across))
    widest = np.diff(angle, append=angle[:1] + 2.0 * np.pi).max()
    return float(numbers["radius"]) if widest < np.pi else np.inf
