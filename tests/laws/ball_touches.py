"""Touches on top of a ball, as a probe reports them."""

from functools import lru_cache

import numpy as np

from tests.explored import explored
from tests.truths import ball_height, graph_contours
from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd

UP, REACH, NOISE = [0.0, 0.0, 1.0], 10.0, 0.02
SOFT = (ContourEnd.LENGTH_REACHED,) * 2


def contours(noise=NOISE, scale=1.0):
    """Three through the top of the ball, at any scale."""
    found = graph_contours(ball_height, REACH, 13, noise, np.random.default_rng(0))
    return tuple(Contour(scale * c.points, c.plane, scale * c.noise_std, c.ends) for c in found)


def touch(contours, contact=(0.0, 0.0, 0.0), **changes):
    values = {"status": TouchStatus.TOUCHED, "tracked_length": 60.0, "travel_length": 0.0}
    values |= changes
    return Touch(0, contact, UP, contours, **values)


@lru_cache
def begun():
    return explored("sphere")
