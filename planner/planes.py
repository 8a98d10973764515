"""Planes: the sampling planes of a touch.

Another choice of planes is one more function here.
"""

import numpy as np

from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.patch.geometry.frame import axes_from_normal


def concurrent_planes(point, normal, heading, count: int) -> tuple[SamplingPlane, ...]:
    """``count`` sampling planes through a point that contain the normal, at even angles.

    Even angles (60 degrees for three planes) give the system for the principal curvatures its best
    condition number, sqrt 2 (see ``curvatures_from_sections``).

    Parameters
    ----------
    point : (3,) float, length, world
    normal : (3,) float, unit, world
    heading : (3,) float, world
        Direction whose part across the normal lies in the first plane.
    count : int
    """
    e1, e2, _ = axes_from_normal(normal, heading)
    angles = np.pi / count * np.arange(count)
    return tuple(SamplingPlane(point, np.cos(a) * e2 - np.sin(a) * e1) for a in angles)
