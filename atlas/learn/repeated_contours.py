"""Repeated contours: a contour that was learned before tells nothing new."""

import numpy as np

from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.contour import Contour


def learned_before(pool: SamplePool, contours: tuple[Contour, ...]) -> bool:
    """Whether the points of any contour are samples already, bit for bit.

    Noise repeats no point, so equal points are the same measurement. The pool keeps the samples of
    a contour in order, so its first point tells where the others must be.
    """
    for path in (contour.points_in_plane for contour in contours):
        for start in np.flatnonzero(pool.points[:, 0] == path[0, 0]).tolist():
            if np.array_equal(pool.points[start : start + len(path)], path):
                return True
    return False
