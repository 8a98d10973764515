"""Which planes to track in."""

import numpy as np

from touchatlas.patch.geometry.contour import SamplingPlane
from touchatlas.patch.geometry.frame import axes_from_normal


def concurrent_planes(point, normal, heading, count: int) -> tuple[SamplingPlane, ...]:
    """``count`` sampling planes through a point that contain the normal, evenly apart.

    Evenly (60 degrees for three) the system for the principal curvatures is conditioned
    best: sqrt 2 (see ``curvatures_from_sections``).

    Parameters
    ----------
    point, normal : (3,) float, world
    heading : (3,) float, world
        The first plane contains it, as far as the normal allows.
    count : int
    """
    e1, e2, _ = axes_from_normal(normal, heading)
    angles = np.pi / count * np.arange(count)
    return tuple(SamplingPlane(point, np.cos(a) * e2 - np.sin(a) * e1) for a in angles)
