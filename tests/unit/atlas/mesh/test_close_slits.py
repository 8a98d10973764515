"""Narrow holes are closed from side to side; wide ones and true rims stay open."""

from dataclasses import replace

import igl
import numpy as np
import trimesh

from tests.meshes import euler_number, surface_of
from tests.unit.atlas.mesh.test_close_holes import NO_RIMS, RADIUS, ball
from touchatlas.atlas.mesh.mend import close_holes, triangles_across
from touchatlas.atlas.records.surface import Surface

WIDTH = 4.0
NONE = np.zeros((0, 2), int)


def slit_ball(width: float = WIDTH) -> Surface:
    """The ball without a band about half of its equator, as wide as is said."""
    whole = ball()
    x, _, z = whole.vertices.T
    return whole.only((x < 0.0) | (np.abs(z) > 0.5 * width))


def test_a_long_slit_is_closed_on_the_sphere():
    """Its edges are bent as the ball is, up to the fourth power of their length:
    l^4 / (128 R^3). The centre of a triangle of edges l / 2 is off by (l / 2)^2 / (6 R)."""
    open_ball = slit_ball()
    assert euler_number(open_ball) == 1
    closed = close_holes(open_ball, NO_RIMS)
    mesh = closed.to_trimesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    # The rim is jagged by the edges of the ball, which are 2 long: edges across are 4 + 2 x 2 at
    # most, and a little longer at the corners of the slit.
    longest = 10.0
    middles = closed.vertices[len(open_ball.vertices) :]
    assert len(middles) > 40 and len(closed.closed_holes) == 1
    off = np.linalg.norm(middles, axis=1) - RADIUS
    assert np.abs(off).max() < longest**4 / (128.0 * RADIUS**3) + 1e-12
    depth = RADIUS - np.linalg.norm(mesh.triangles_center, axis=1)
    assert depth.max() < 0.25 * longest**2 / (6.0 * RADIUS)


def test_what_is_across_a_slit_is_less_sure_than_its_rim():
    """A slope of a tenth over half of its width, which the edges of the ball add 2 or 4 to."""
    open_ball = slit_ball()
    closed = close_holes(open_ball, NO_RIMS)
    count = len(open_ball.vertices)
    np.testing.assert_array_equal(closed.deviation[:count], open_ball.deviation)
    assert 0.1 * 0.5 * WIDTH < closed.deviation[count:].max() < 0.1 * 0.5 * (WIDTH + 4.0)
    assert closed.deviation[count:].min() > open_ball.deviation.max()


def test_a_slit_that_is_wider_than_a_tenth_of_the_surface_stays_open():
    """The diagonal is 173: edges of 17 are too long for a band that is 20 wide."""
    wide = slit_ball(20.0)
    assert close_holes(wide, NO_RIMS) is wide


def test_the_crest_of_a_wall_rises_by_half_of_its_thickness():
    """Both sides are upright, so that a half circle joins them."""
    along = np.arange(20.0)
    rim = np.concatenate(
        [
            np.stack([along, 0 * along, 0 * along]),
            np.stack([along[::-1], 0 * along + 1, 0 * along]),
        ],
        axis=1,
    ).T
    normals = np.where(rim[:, 1:2] > 0.5, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0])
    across = triangles_across(rim, normals, NONE)
    square = np.abs(np.diff(rim[across.diagonals][..., 0], axis=1)) < 0.5
    np.testing.assert_allclose(across.error[square[:, 0]], 0.5)
    # Those that lean across the next point rise by no more than half of the wall, too.
    assert across.error.max() <= 0.5 * np.sqrt(2.0)
    assert len(across.triangles) == len(rim) - 2 == len(across.error) + 1


def test_an_edge_that_the_surface_has_already_is_not_made_twice():
    """Of a rim of four points both ways across have an edge on the other side: it stays open."""
    rim, up = np.array([[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0.0]]), np.tile([0, 0, 1.0], (4, 1))
    assert triangles_across(rim, up, [(0, 2)]).diagonals.tolist() == [[3, 1]]
    assert triangles_across(rim, up, [(0, 2), (1, 3)]) is None


def test_a_cap_is_not_closed_by_its_own_back():
    """The outer rim of what was touched is as level as that of a hole, but what is across it faces
    the other way."""
    whole = ball()
    places = whole.vertices[:, 2]
    cap, rest = whole.only(places > 0.99 * RADIUS), whole.only(places < 0.99 * RADIUS)
    for part, is_closed in ((cap, False), (rest, True)):
        rim = np.array(igl.boundary_loop_all(part.faces)[0])
        across = triangles_across(part.vertices[rim], part.normals[rim], NONE)
        assert (across is not None) == is_closed
    assert close_holes(cap, NO_RIMS) is cap


def test_corners_that_point_into_a_slit_are_cut_last():
    """A level slit with teeth on both sides: a triangle that is cut off a tooth lies on the
    surface, and faces the other way."""
    x = np.linspace(0.0, 40.0, 81)
    teeth = 1.0 * np.sign(np.sin(x))
    low, high = np.column_stack([x, teeth - 3.0]), np.column_stack([x, teeth + 3.0])
    # Clockwise, as the rim of a hole is.
    flat = np.concatenate([low[::-1], high])
    rim = np.column_stack([flat, np.zeros(len(flat))])
    across = triangles_across(rim, np.tile([0.0, 0.0, 1.0], (len(rim), 1)), NONE)
    a, b, c = rim[across.triangles].transpose(1, 0, 2)
    areas = 0.5 * np.cross(b - a, c - a)[:, 2]
    np.testing.assert_allclose(areas.sum(), 6.0 * 40.0)
    assert np.abs(areas[areas < 0.0]).sum() < 0.02 * 6.0 * 40.0


def test_a_rim_of_three_points_has_no_new_edge():
    whole = trimesh.creation.icosahedron()
    part = surface_of(whole, 1e-3, 1.0)
    closed = close_holes(replace(part, faces=part.faces[1:]), NO_RIMS)
    assert len(closed.vertices) == 12 and closed.to_trimesh().is_watertight
    np.testing.assert_allclose(closed.closed_holes[0], whole.vertices[whole.faces[0]].mean(axis=0))
