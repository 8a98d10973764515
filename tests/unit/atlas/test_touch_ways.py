"""The way of a ball's centre ends above a contact that has a normal."""

import numpy as np
import pytest

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

UP = np.array([0.0, 0.0, 1.0])


def _touch(normals, way_end: float) -> Touch:
    points = np.stack([np.linspace(-5, 5, 11), np.zeros(11), np.zeros(11)], axis=1)
    plane, ends = SamplingPlane(np.zeros(3), [0.0, 1.0, 0.0]), (ContourEnd.LENGTH_REACHED,) * 2
    contour = Contour(points, plane, 0.01, ends, normals)
    way = np.array([20.0 * UP, way_end * UP])
    return Touch(0, np.zeros(3), UP, (contour,), TouchStatus.TOUCHED, 10.0, 0.0, way)


def test_the_way_of_a_centre_ends_above_its_contact():
    assert _touch(np.tile(UP, (11, 1)), 2.0).way[1, 2] == 2.0
    with pytest.raises(ValueError, match="ends 2 from the contact"):
        _touch(None, 2.0)
    with pytest.raises(ValueError, match="ends 2 from the contact"):
        _touch(np.tile(UP, (11, 1)), -2.0)
