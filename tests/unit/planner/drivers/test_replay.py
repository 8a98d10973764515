"""Recordings of a robot with a force sensor, read as touches: closed forms of a ball."""

import numpy as np
import pytest

from touchatlas.patch import ContourEnd
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.replay import ReplayOptions, touches_of
from touchatlas.planner.tracking.options import Tip

BALL, FRICTION, FORCE, FEED, RATE = 30.0, 0.15, 0.4, 10.0, 100.0
TIP = Tip(radius=2.0, stiffness=2.0, noise_std=0.01, force_std=0.005)


def arm(place, along, length, rng, end="lift"):
    """Readings of an arm along a great circle of a ball about 0: air, contact, air. The force has
    friction against the travel; the beam bends by F / k."""
    period = 1.0 / RATE
    turn = np.arange(0.0, length / (BALL + TIP.radius), FEED * period / (BALL + TIP.radius))
    n = np.outer(np.cos(turn), place) + np.outer(np.sin(turn), along)
    t = np.outer(np.cos(turn), along) - np.outer(np.sin(turn), place)
    force = FORCE * (n - FRICTION * t)
    centres = (BALL + TIP.radius) * n
    height = np.linspace(5.0, 0.1, 30)[:, None]
    leave = n[-1] if end == "lift" else t[-1]
    positions = np.vstack(
        [
            centres[0] + height * n[0],
            centres - force / TIP.stiffness,
            centres[-1] + height[::-1] * leave,
        ]
    )
    forces = np.vstack([np.zeros((30, 3)), force, np.zeros((30, 3))])
    positions = positions + TIP.noise_std * rng.normal(size=positions.shape)
    return positions, forces + TIP.force_std * rng.normal(size=forces.shape)


def recording(places, length=25.0, end="lift", planes=3, seed=0):
    """At each place three planes, both ways each."""
    rng = np.random.default_rng(seed)
    rows = []
    for place in places:
        across = np.cross(place, [0.3, 0.5, 0.8])
        across /= np.linalg.norm(across)
        other = np.cross(place, across)
        for k in range(planes):
            a = np.pi * k / planes
            along = np.cos(a) * across + np.sin(a) * other
            rows += [arm(place, s * along, length, rng, end) for s in (1.0, -1.0)]
    positions, forces = (np.vstack(column) for column in zip(*rows, strict=True))
    return Recording(np.arange(len(positions)) / RATE, positions, forces)


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
