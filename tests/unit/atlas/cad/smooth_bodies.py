"""Smooth surfaces of known distance, meshes as surfaces, and volumes of shapes of the kernel."""

import numpy as np

RADIUS = 10.0


def ball_of(radius: float):
    """Distance (n,) and normal (n, 3) of a ball about the origin."""

    def at(points):
        away = np.linalg.norm(points, axis=1)
        return away - radius, points / away[:, None]

    return at


ball = ball_of(RADIUS)


def cube_quads():
    """The corners (8, 3) of a cube in a ball of ``RADIUS``, and its sides (6, 4), counter-clockwise
    as seen from outside."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return RADIUS / np.sqrt(3.0) * corners, np.array(quads)


def volume(shape) -> float:
    """Volume of a shape of the kernel."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return float(found.Mass())
