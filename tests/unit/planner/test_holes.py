"""Holes of the surface, where the planner touches last."""

import numpy as np

from tests.explored import explored, spread_touches
from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner.place import holes
from touchatlas.planner.place.holes import _hole, drawn_holes
from touchatlas.sim import make_object

NO_EDGES = np.zeros((0, 2), int)


def test_the_open_side_of_a_ball_is_one_hole_however_large():
    """Contours over the upper part of a ball end at a rim, whose middle lies below its centre.

    By symmetry it is on the axis, up to the places of the touches, which are random, and to the
    edge across whose middle it is: a fourth of the radius. Normals near the equator add up to
    little, so that their sum is within 25 degrees.
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
    assert np.hypot(*centres[0, :2]) < 0.25 * radius and np.abs(normals[0, 2]) > 0.9
    # A circle through the rim rises by half of the width times tan(t / 2). The rim is jagged, so
    # that its slopes differ by a tenth.
    sine = found.radius[0] / radius
    height = found.radius[0] * sine / (1.0 + np.sqrt(1.0 - sine**2))
    np.testing.assert_allclose(found.error[0], height, rtol=0.1)


def test_a_closed_surface_has_no_hole():
    atlas = explored("sphere").atlas
    found = drawn_holes(atlas, atlas.tolerance)
    assert found.centres.shape == found.normals.shape == (0, 3)


def test_a_surface_without_triangles_has_no_hole(monkeypatch):
    """As where the patches of a first touch are all less sure than is asked."""
    atlas = explored("sphere").atlas
    whole = extract_surface(atlas)
    nothing = whole.only(np.zeros(len(whole.vertices), bool))
    monkeypatch.setattr(holes, "open_surface", lambda _: nothing)
    assert not len(drawn_holes(atlas, atlas.tolerance).error)


def ellipse(long, short):
    """A rim in the plane z = 0, counter-clockwise about z, as boundaries of triangles around it
    run the other way round."""
    angle = np.linspace(2.0 * np.pi, 0.0, 200, endpoint=False)
    return np.column_stack([long * np.cos(angle), short * np.sin(angle), np.zeros(200)])


def test_the_error_of_a_hole_grows_with_its_size_and_with_what_slopes_differ():
    """A tenth of the radius, 1.96 times, on a sphere; as much again for slopes of two kinds."""
    rim = ellipse(2.0, 2.0)
    level = np.tile([0.0, 0.0, 1.0], (200, 1))
    bent = level + 0.05 * np.sign(np.arange(200) % 2 - 0.5)[:, None] * rim
    for normals, factor in ((level, 1.0), (level + 0.1 * rim, 1.0), (bent, np.sqrt(2.0))):
        centre, outward, *found = _hole(rim, normals, NO_EDGES, 100.0)
        np.testing.assert_allclose(found, (2.0, 1.96 * 0.2 * factor))
        np.testing.assert_allclose(centre, 0.0, atol=1e-12)
        np.testing.assert_allclose(outward, [0.0, 0.0, 1.0], atol=1e-12)


def test_a_hole_too_large_to_be_closed_is_touched_at_its_widest_place():
    """Across an ellipse that is the middle, and its short axis; at the corner of an L of two slits,
    one of them twice as wide, it is in the wide one."""
    rim = ellipse(20.0, 2.0)
    centre, _, radius, error = _hole(rim, np.tile([0.0, 0.0, 1.0], (200, 1)), NO_EDGES, 100.0)
    # The points of the rim are 0.6 apart beside the short axis, so that an edge across leans.
    np.testing.assert_allclose(centre, 0.0, atol=0.6)
    np.testing.assert_allclose(radius, 2.0, rtol=0.03)
    np.testing.assert_allclose(error, 1.96 * 0.1 * radius)
    corners = np.array([[0, 0], [0, 20], [4, 20], [4, 2], [20, 2], [20, 0], [0, 0]], float)
    along = np.linspace(0.0, 1.0, 40, endpoint=False)[:, None]
    sides = [a + along * (b - a) for a, b in zip(corners[:-1], corners[1:], strict=True)]
    rim = np.column_stack([np.concatenate(sides), np.zeros(240)])
    centre, _, radius, _ = _hole(rim, np.tile([0.0, 0.0, 1.0], (240, 1)), NO_EDGES, 100.0)
    assert radius >= 2.0 and centre[0] < 4.0


def test_a_slit_that_goes_about_a_mouth_is_not_touched_in_the_mouth():
    """Three quarters of a ring, one wide, ten from its middle. Beside its ends the way around an
    end counts, so that the width is 1.5 at most."""
    angle = np.linspace(0.0, 1.5 * np.pi, 150)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(150)])
    rim = np.concatenate([9.5 * ring, 10.5 * ring[::-1]])
    centre, _, radius, _ = _hole(rim, np.tile([0.0, 0.0, 1.0], (300, 1)), NO_EDGES, 100.0)
    np.testing.assert_allclose(np.linalg.norm(centre), 10.0, atol=0.5)
    assert 0.5 - 1e-9 <= radius < 0.75


def test_the_normal_of_a_slit_in_the_crest_of_a_wall_points_along_the_wall():
    """The sides of the wall face away from each other, so that their normals add to nothing; the
    surface goes up to the slit on both sides."""
    rim = ellipse(20.0, 0.5)
    sides = np.sign(rim[:, 1:2]) * [[0.0, 1.0, 0.0]]
    _, outward, _, _ = _hole(rim, sides, NO_EDGES, 100.0)
    np.testing.assert_allclose(outward, [0.0, 0.0, 1.0], atol=0.05)
