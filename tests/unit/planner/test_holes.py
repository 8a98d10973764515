"""Holes of the surface, where the planner touches last."""

import numpy as np

from tests.explored import explored, spread_touches
from touchatlas.atlas import Atlas
from touchatlas.planner.place.holes import hole_centres
from touchatlas.sim import make_object


def test_the_open_side_of_a_ball_is_one_hole_however_large():
    """Contours over the upper part of a ball end at a rim, whose middle lies below its centre.

    By symmetry it is on the axis, up to the places of the touches, which are random: a tenth of the
    radius. Normals near the equator add up to little, so that their sum is within 25 degrees.
    """
    obj = make_object("sphere")
    atlas = Atlas(obj.tolerance)
    for touch in spread_touches(obj, 40):
        if touch.contact[2] > 0.2 * obj.diagonal:
            atlas.add(touch)
    centres, normals = hole_centres(atlas)
    radius = 0.5 * obj.diagonal / np.sqrt(3.0)
    assert len(centres) == 1
    assert np.hypot(*centres[0, :2]) < 0.1 * radius and np.abs(normals[0, 2]) > 0.9


def test_a_closed_surface_has_no_hole():
    centres, normals = hole_centres(explored("sphere").atlas)
    assert centres.shape == normals.shape == (0, 3)
