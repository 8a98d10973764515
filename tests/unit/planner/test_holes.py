"""Holes of the surface, where the planner touches last."""

import numpy as np

from tests.explored import explored, spread_touches
from touchatlas.atlas import Atlas
from touchatlas.planner.place.holes import _closed, drawn_holes
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
    found = drawn_holes(atlas, atlas.tolerance)
    centres, normals = found.centres, found.normals
    radius = 0.5 * obj.diagonal / np.sqrt(3.0)
    assert len(centres) == 1
    assert np.hypot(*centres[0, :2]) < 0.1 * radius and np.abs(normals[0, 2]) > 0.9
    assert np.isinf(found.error).all()


def test_a_closed_surface_has_no_hole():
    atlas = explored("sphere").atlas
    found = drawn_holes(atlas, atlas.tolerance)
    assert found.centres.shape == found.normals.shape == (0, 3)


def test_the_error_of_a_hole_grows_with_its_size_and_with_what_slopes_differ():
    """A tenth of the radius, 1.96 times, on a sphere; as much again for slopes of two kinds."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    rim = np.column_stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), np.zeros(40)])
    level = np.tile([0.0, 0.0, 1.0], (40, 1))
    bent = level + 0.05 * np.sign(np.arange(40) % 2 - 0.5)[:, None] * rim
    np.testing.assert_allclose(_closed(rim, level, 100.0), (2.0, 1.96 * 0.2))
    np.testing.assert_allclose(_closed(rim, level + 0.1 * rim, 100.0), (2.0, 1.96 * 0.2))
    np.testing.assert_allclose(_closed(rim, bent, 100.0), (2.0, 1.96 * 0.2 * np.sqrt(2.0)))
    assert np.isinf(_closed(rim, level, 10.0)[1])
