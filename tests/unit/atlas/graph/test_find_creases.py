"""Creases of two planes that meet at a known line, touched up to it or not."""

import numpy as np
import pytest

from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.atlas.graph.find_creases import find_creases
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

STEP = 1.0 / 7.0
SOFT, EDGE = ContourEnd.LENGTH_REACHED, ContourEnd.EDGE


def half_plane(normal, inward, gap: float, end: ContourEnd, number: int) -> Touch:
    """A touch of the half plane through the y axis that extends along ``inward``: three contours
    about a contact 0.5 from the axis, which end ``gap`` steps short of it."""
    contact, contours = 0.5 * inward, []
    for angle in np.pi / 4.0 * np.array([-1.0, 0.0, 1.0]):
        along = np.cos(angle) * -inward + np.sin(angle) * np.cross(normal, -inward)
        longest = (0.5 - gap * STEP) / np.cos(angle)
        parameter = np.append(np.arange(-1.0, longest, STEP), longest)
        plane = SamplingPlane(contact, np.cross(along, normal))
        contours.append(Contour(contact + parameter[:, None] * along, plane, 1e-6, (SOFT, end)))
    return Touch(number, contact, normal, tuple(contours), TouchStatus.TOUCHED, 6.0, 0.0)


def roof(slope: float, gap: float = 0.2, end: ContourEnd = EDGE) -> Atlas:
    """Two half planes that fall away from the y axis by ``slope``, rad; a valley when negative."""
    atlas, s, c = Atlas(0.05), np.sin(slope), np.cos(slope)
    for number, side in enumerate((1.0, -1.0)):
        normal, inward = np.array([side * s, 0.0, c]), np.array([side * c, 0.0, -s])
        atlas.add(half_plane(normal, inward, gap, end, number))
    return atlas


def creases_of(atlas: Atlas):
    return find_creases(atlas.table, atlas.membership, [(0, 1)], atlas.bias)


@pytest.mark.parametrize("slope", [0.5, 0.8, -0.5, -0.8])
def test_two_planes_that_were_touched_up_to_their_line_are_creased(slope):
    """Convex, sign 1, where they fall away from the line, and concave where they rise; the anchor
    is on the y axis."""
    (crease,) = creases_of(roof(slope)).values()
    assert crease.sign == np.sign(slope)
    assert np.abs(crease.anchor[[0, 2]]).max() < 1e-3


@pytest.mark.parametrize(
    ("slope", "gap", "end"),
    [(0.2, 0.2, EDGE), (0.5, 2.5, EDGE), (0.8, 0.2, SOFT)],
    ids=["an angle below 30 degrees", "ends two steps short", "ends at no edge"],
)
def test_other_planes_are_not_creased(slope, gap, end):
    assert not creases_of(roof(slope, gap, end))
