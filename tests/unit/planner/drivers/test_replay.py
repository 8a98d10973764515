"""Recordings of a robot with a force sensor, read as touches: closed forms of a ball."""

import numpy as np
import pytest

from tests.unit.planner.drivers.ball_recordings import BALL, RATE, TIP, recording
from touchatlas.atlas import Atlas
from touchatlas.patch import ContourEnd
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.replay import ReplayOptions, touches_of
from touchatlas.planner.tracking.options import Tip


def test_arms_from_one_place_are_a_touch_of_contours_through_it():
    """Contacts are on the ball and normals along its radii: friction and bending are taken out.

    A sample of 17 readings is good to 1.5 / sqrt(17) of hypot(0.01, 0.005 / 2) = 0.004; over some
    hundred samples the largest of two coordinates' worth is below five deviations. Normals are off
    by noise of force over force along the arc: 0.005 * 0.36 / 0.4 = 0.005 rad, times the same five.
    """
    places = np.eye(3)[:2]
    touches = touches_of(recording(places), TIP)
    assert [touch.number for touch in touches] == [0, 1]
    for touch, place in zip(touches, places, strict=True):
        assert len(touch.contours) == 3
        np.testing.assert_allclose(touch.contact, BALL * place, atol=0.05)
        assert touch.approach @ place > 0.999
        for contour in touch.contours:
            distance = np.linalg.norm(contour.points, axis=1)
            assert np.abs(distance - BALL).max() < 5 * 0.004
            radial = contour.points / distance[:, None]
            assert np.arccos((radial * contour.normals).sum(axis=1).clip(-1, 1)).max() < 0.03
            assert contour.ends == (ContourEnd.LENGTH_REACHED,) * 2
            # Both arms, of 25 at the centre each.
            length = np.linalg.norm(np.diff(contour.points, axis=0), axis=1).sum()
            assert length == pytest.approx(2 * 25 * BALL / (BALL + TIP.radius), abs=4.0)


def test_what_is_replayed_is_learned():
    """Six touches around a ball: what the atlas knows of it lies on it."""
    places = np.vstack([np.eye(3), -np.eye(3)])
    atlas = Atlas(tolerance=0.1, scale=0.1)
    for touch in touches_of(recording(places), TIP):
        assert not atlas.add(touch).refused
    seen = atlas.blend(BALL * places)
    assert seen.known.all()
    assert np.abs(seen.distance).max() < 0.1


def test_an_arm_that_runs_off_the_surface_has_lost_contact():
    """It goes on along the path in the air, where one that is lifted goes along the normal."""
    touch = touches_of(recording(np.eye(3)[:1], end="on"), TIP)[0]
    assert all(contour.ends == (ContourEnd.LOST_CONTACT,) * 2 for contour in touch.contours)


def test_a_tip_that_is_never_pressed_or_never_travels_gives_no_touch():
    quiet = recording(np.eye(3)[:1])
    with pytest.raises(ValueError, match=r"never above 5 N for 0\.16 s"):
        touches_of(quiet, TIP, ReplayOptions(least=5.0))
    still = Recording(np.arange(200) / RATE, np.zeros((200, 3)), np.full((200, 3), 0.3))
    with pytest.raises(ValueError, match="while the tip travelled"):
        touches_of(still, TIP)
    with pytest.raises(ValueError, match="window is 0"):
        ReplayOptions(window=0)


def test_errors_that_all_samples_share_are_those_of_radius_and_bending():
    """0.4 N (1 + 0.15^2)^0.5 over 2 N/mm bend by 0.2 mm; 5 % of that, and the radius."""
    tip = Tip(radius=2.0, stiffness=2.0, radius_std=0.003, stiffness_std=0.05, noise_std=0.01)
    touch = touches_of(recording(np.eye(3)[:1]), tip)[0]
    assert touch.systematic_std == pytest.approx(np.hypot(0.003, 0.05 * 0.2022), rel=0.02)


def test_a_path_that_leaves_its_plane_in_contact_is_told_by_its_time():
    """A winding of 20 mm about z that climbs by 40 in 4 s is in no plane."""
    t = np.arange(0.0, 4.0, 1.0 / RATE)
    u = np.stack([np.cos(3.0 * t), np.sin(3.0 * t), 0.0 * t], axis=1)
    wound = Recording(t, 20.0 * u + np.outer(10.0 * t, [0.0, 0.0, 1.0]), 0.4 * u)
    with pytest.raises(ValueError, match="from 0 to 3.99.* s is no arm in a plane: .*lift the tip"):
        touches_of(wound, TIP)
