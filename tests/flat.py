"""Atlases of a plane, touched without a probe."""

import numpy as np

from tests.truths import UP
from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

ARM = np.linspace(-1.0, 1.0, 15)


def flat_touch(contact, normal, first, noise_std: float, rng, number: int = 0) -> Touch:
    """A touch of a plane: three contours of 15 points, 60 degrees apart, with arms of length one.

    The first contour runs along ``first``, a unit tangent.
    """
    contours = []
    for angle in np.pi / 3.0 * np.arange(3):
        along = np.cos(angle) * first + np.sin(angle) * np.cross(normal, first)
        points = contact + ARM[:, None] * along + noise_std * rng.normal(size=(len(ARM), 3))
        plane = SamplingPlane(contact, np.cross(along, normal))
        contours.append(Contour(points, plane, noise_std, (ContourEnd.LENGTH_REACHED,) * 2))
    return Touch(number, contact, normal, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0)


def plane(places) -> Atlas:
    """A plane, touched at places 0.9 apart: (column, row) of a grid."""
    atlas, rng = Atlas(0.01), np.random.default_rng(0)
    for place in places:
        contact = np.array([*(0.9 * np.array(place)), 0.0])
        atlas.add(flat_touch(contact, UP, np.array([1.0, 0.0, 0.0]), 2e-3, rng))
    return atlas
