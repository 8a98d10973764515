"""Rims: where contours lost contact, the surface ends."""

import numpy as np
import pytest

from touchatlas.atlas.samples.rims import Rims
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch import Contour, ContourEnd, SamplingPlane

KEPT, LOST = ContourEnd.LENGTH_REACHED, ContourEnd.LOST_CONTACT
STEP = 0.05


def rims_of(ends, starts, upward, step: float = STEP, kept=()) -> Rims:
    """Rims at straight contours (on the surface to second order) from starts (n, 3) to ends (n, 3);
    ``upward`` is a function from points (k, 3) to surface normals (k, 3); points ``kept`` (m, 3)
    are samples besides."""
    pool = SamplePool()
    rims = Rims(pool)
    if len(kept):
        pool.add(kept, upward(kept), np.tile(np.eye(3)[0], (len(kept), 1)), False, 0.0)
    for end, start in zip(ends, starts, strict=True):
        count = int(np.linalg.norm(end - start) / step) + 1
        points = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
        normal = np.cross(upward(end[None])[0], end - start)
        plane = SamplingPlane(end, normal / np.linalg.norm(normal))
        pool.add(points, upward(points), np.tile(plane.normal, (count, 1)), False, 0.0)
        rims.ends.extend([Contour(points, plane, 0.0, (KEPT, LOST))], [upward(points)])
    return rims


def flat(points):
    return np.tile([0.0, 0.0, 1.0], (len(points), 1))


def circle(radius: float, angles, height: float = 0.0) -> np.ndarray:
    angles = np.asarray(angles)
    return np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)], axis=1
    )


ANGLES = np.array([0.1, 1.0, 2.3, 3.3, 4.1, 5.4])
EVERY = np.linspace(0.0, 2.0 * np.pi, 50)


@pytest.mark.parametrize(("inside", "beyond"), [(0.6, 1.0), (1.0, 0.6)])
def test_a_disc_ends_at_its_circle_and_a_plate_at_its_hole(inside, beyond):
    """The sphere through three points of a circle that is perpendicular to the plane meets it in
    that circle. Contours run obliquely, so their direction says little."""
    ends = circle(0.8, ANGLES)
    starts = circle(2.0 * inside - 0.8, ANGLES + 0.3)
    rims = rims_of(ends, starts, flat)
    for radius, expected in ((0.8001, beyond > inside), (0.7999, beyond < inside)):
        points = circle(radius, EVERY)
        assert rims.beyond(points, flat(points)).tolist() == [expected] * len(points)
    moved = rims.onto(circle(beyond, EVERY), flat(EVERY))
    assert np.linalg.norm(moved, axis=1) == pytest.approx(np.full(50, 0.8), abs=1e-12)


def test_a_bowl_ends_at_the_plane_that_cuts_it():
    """A ball of radius 1 below the height 0.6. The sphere through the circle that is perpendicular
    to the ball is the same at all its points."""
    ends = circle(0.8, ANGLES, 0.6)
    starts = circle(1.0, ANGLES + 0.2, 0.2)
    starts /= np.linalg.norm(starts, axis=1)[:, None]

    def upward(points):
        return points / np.linalg.norm(points, axis=1)[:, None]

    rims = rims_of(ends, starts, upward)
    rim = 0.6 + np.array([-1e-4, 1e-4])
    for height, expected in zip(rim, (False, True), strict=True):
        points = circle(np.sqrt(1.0 - height**2), EVERY, height)
        assert rims.beyond(points, upward(points)).tolist() == [expected] * len(points)


def test_an_end_alone_has_its_rim_across_the_direction_of_travel():
    rims = rims_of(np.zeros((1, 3)), np.array([[-1.0, 0.0, 0.0]]), flat)
    points = np.array([[0.1, 0.3, 0.0], [-0.1, 0.3, 0.0], [0.0, 0.0, 0.0]])
    assert rims.beyond(points, flat(points)).tolist() == [True, False, False]


def test_the_other_side_of_a_sheet_has_no_rim():
    rims = rims_of(circle(0.8, ANGLES), circle(0.3, ANGLES), flat)
    points = circle(1.0, EVERY)
    assert not rims.beyond(points, -flat(points)).any()


def test_what_was_tracked_beyond_an_end_shows_a_slip():
    """The second contour begins where the first one lost contact."""
    ends, starts = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0]] * 2)
    starts[1, 0] = 0.0
    rims = rims_of(ends, starts, flat)
    assert rims.ends.open().tolist() == [1]
    points = np.array([[0.2, 0.1, 0.0], [0.6, 0.1, 0.0]])
    assert rims.beyond(points, flat(points)).tolist() == [False, True]


def test_what_was_touched_all_around_shows_no_rim():
    """Six contours of one touch lost contact on a plate that was met all around: nothing lies
    beyond, and each end is doubtful. At a hole as wide the other ends lie ahead."""
    x, y = np.meshgrid(np.linspace(-2.0, 2.0, 21), np.linspace(-2.0, 2.0, 21))
    plate = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    around = plate[np.hypot(plate[:, 0], plate[:, 1]) > 0.5]
    slips = rims_of(circle(0.3, ANGLES), np.zeros((6, 3)), flat, kept=around)
    assert not slips.beyond(circle(1.0, EVERY), flat(EVERY)).any()
    hole = rims_of(circle(0.5, ANGLES), circle(0.8, ANGLES), flat, kept=around)
    assert hole.beyond(circle(0.3, EVERY), flat(EVERY)).all()


def test_a_rim_is_shown_by_the_touches_of_its_end_and_of_those_beside_it():
    """Each contour of a hole is a touch of its own; all of one touch have one number."""
    several = rims_of(circle(0.5, ANGLES), circle(0.8, ANGLES), flat)
    inside = circle(0.3, EVERY)
    assert (several.shown_beyond(inside, flat(inside)) == 2).all()
    one = rims_of(circle(0.5, ANGLES), circle(0.8, ANGLES), flat)
    one.ends.touches[:] = 0
    one._known = -1
    assert (one.shown_beyond(inside, flat(inside)) == 1).all()
    outside = circle(0.7, EVERY)
    assert not several.shown_beyond(outside, flat(outside)).any()


def test_two_ends_of_a_tube_are_two_rims():
    """Contours along a plate of width 1 lose contact at both sides; no rim joins the sides."""
    y = np.linspace(0.0, 0.6, 4)
    right = np.stack([np.full(4, 0.5), y, np.zeros(4)], axis=1)
    left = right * [-1.0, 1.0, 1.0]
    rims = rims_of(np.concatenate([left, right]), np.zeros((8, 3)) + [0.0, 0.3, 0.0], flat)
    points = np.array([[0.51, 0.2, 0.0], [-0.51, 0.4, 0.0], [0.49, 0.5, 0.0], [-0.49, 0.1, 0.0]])
    assert rims.beyond(points, flat(points)).tolist() == [True, True, False, False]


def test_a_rim_that_is_known_needs_no_touch():
    """Ends on a circle: all rims are the circle. Ends on an ellipse: two rims drawn on do not
    meet."""
    every = np.linspace(0.0, 2.0 * np.pi, 7)[:-1]
    ends = circle(0.8, every)
    rims = rims_of(ends, 0.3 * ends, flat)
    assert len(rims.unsure(1e-9)[0]) == 0
    stretched = ends * [1.6, 1.0, 1.0]
    points, normals, apart = rims_of(stretched, 0.3 * stretched, flat).unsure(1e-9)
    assert len(points) == len(apart) > 0 and np.allclose(normals, [0.0, 0.0, 1.0])
    # Within the ellipse, and more than an eighth of it from its middle.
    size = np.linalg.norm(points / [1.28, 0.8, 1.0], axis=1)
    assert ((size > 0.5) & (size < 1.0)).all()


def test_a_probe_that_stands_still_as_it_loses_contact_has_the_direction_in_which_it_came():
    """It reports the last place three times, off its plane by noise alone; so do the others. A
    probe that never moved has no direction, and shows no rim."""
    upright = np.array([0.0, 1.0, 0.0])
    stood = np.repeat(np.arange(4.0), 3)[:, None] * np.eye(3)[0]
    stood[1::3, 1], stood[2::3, 1] = 1e-3, -1e-3
    for points, count in ((stood, 1), (stood[:3], 0)):
        rims = Rims(SamplePool())
        contour = Contour(points, SamplingPlane(np.zeros(3), upright), 1e-3, (KEPT, LOST))
        rims.ends.extend([contour], [flat(points)])
        assert len(rims.ends) == count
        if count:
            assert rims.ends.tangents[0].tolist() == [1.0, 0.0, 0.0]
            assert rims.ends.steps[0] == 1.0


def test_ends_above_each_other_show_the_rim_across_the_direction_of_travel():
    """No direction of the tangent plane leads from one to the next."""
    ends = np.linspace(0.0, 0.6, 4)[:, None] * np.array([0.0, 0.0, 1.0])
    rims = rims_of(ends, ends - [0.5, 0.0, 0.0], flat)
    points = np.array([[0.01, 0.1, 0.2], [-0.01, 0.1, 0.2]])
    assert rims.beyond(points, flat(points)).tolist() == [True, False]
    assert all(np.isfinite(column).all() for column in rims.unsure(1e-3))


def test_rims_that_face_each_other_over_a_slit_meet_half_way():
    """Contours from opposite sides end at a slit. Others along the slit show that no rim runs along
    the contours, so that their directions alone are left: these cancel."""
    ends = np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    y = np.linspace(-0.2, 0.2, 9)
    along = np.stack([np.stack([x + 0 * y, y, 0 * y], axis=1) for x in (-0.12, 0.12)])
    rims = rims_of(ends, 5.0 * ends, flat, kept=along.reshape(-1, 3))
    points, normals, _ = rims.unsure(1e-3)
    assert np.isfinite(points).all() and normals.tolist() == flat(points).tolist()
