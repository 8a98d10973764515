"""Hybrid control: what is controlled by force, what by position, and what friction leaves."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.planner import Reading, Tip, TrackingOptions
from touchatlas.planner.tracking.friction import (
    across_path,
    friction_of,
    normals_with_friction,
)
from touchatlas.planner.tracking.hybrid_control import (
    ControlState,
    centre_of,
    hybrid_control,
)

RNG = np.random.default_rng(0)
TIP, OPTIONS = Tip(), TrackingOptions(acceleration=1e9)


def frames(count: int = 50):
    """Random plane normals w and section normals n (count, 3), at right angles."""
    w, n = RNG.normal(size=(2, count, 3))
    w /= np.linalg.norm(w, axis=1)[:, None]
    n -= (n * w).sum(axis=1)[:, None] * w
    return w, n / np.linalg.norm(n, axis=1)[:, None]


def controlled(w, force, beside=0.0, before=None, options=OPTIONS, tip=TIP, steps=1, unit=1.0):
    """Velocities after some readings of a force (m, 3), the centres beside their planes."""
    centre = beside * w
    reading = Reading(0.0, centre - force / tip.stiffness, force)
    state = ControlState.at_rest(reading, before if before is not None else force, tip)
    velocity = np.zeros_like(w)
    for k in range(steps):
        reading = replace(reading, time=0.004 * (k + 1))
        velocity, state = hybrid_control(reading, np.zeros_like(w), w, 1.0, tip, options, state)
    return velocity, state


def test_a_force_at_its_set_point_is_fed_along_the_section():
    w, n = frames()
    velocity, state = controlled(w, 0.4 * n)
    assert np.allclose(velocity, 10.0 * np.cross(w, n), atol=1e-9)
    assert np.allclose(state.travelled, 0.04)


def test_force_is_controlled_along_the_normal_and_position_across_the_plane():
    """The part of the velocity along n depends on the force alone, that along w on the place."""
    w, n = frames()
    velocity, _ = controlled(w, 0.3 * n, beside=0.1)
    assert ((velocity * n).sum(axis=1) < 0.0).all()
    assert np.allclose((velocity * w).sum(axis=1), -0.1 * OPTIONS.hold)
    still, _ = controlled(w, 0.3 * n)
    assert np.allclose((velocity * n).sum(axis=1), (still * n).sum(axis=1))


def test_a_lost_surface_is_sought_along_the_last_normal():
    w, n = frames()
    velocity, state = controlled(w, 0.0 * n, before=n, steps=20)
    assert np.allclose(velocity, -OPTIONS.search_speed * n)
    # Of 20 periods of 4 ms the first five are within the 0.02 s after which it counts as lost.
    assert np.allclose(state.sought, 0.08 * OPTIONS.search_speed, atol=0.025 * 5.0)
    # Before, the tip creeps: a tenth of the feed.
    assert (state.travelled < 0.1 * OPTIONS.feed * 0.025).all()


def test_a_surface_that_is_lost_beyond_an_edge_is_sought_around_the_edge():
    """Half a turn about the last contact meets each section that goes on from there. The place off
    it is integrated with steps of 0.02 mm on a circle of 2.5 mm, which lead outward by 1 % in half
    a turn."""
    w, n = frames(5)
    forward = np.cross(w, n)
    _, state = controlled(w, 0.0 * n, before=n, steps=20)
    where, turned, period = 1.25 * TIP.radius * forward, np.zeros(5), 0.004
    for k in range(int(1.25 * np.pi * TIP.radius / (period * OPTIONS.search_speed))):
        reading = Reading(period * (21 + k), where, 0.0 * n)
        velocity, state = hybrid_control(reading, np.zeros_like(w), w, 1.0, TIP, OPTIONS, state)
        where = where + period * velocity
        turned = np.arctan2(-(where * n).sum(axis=1), (where * forward).sum(axis=1))
    assert np.allclose(turned, np.pi, atol=0.05)
    assert np.allclose(np.linalg.norm(where, axis=1), 1.25 * TIP.radius, rtol=0.02)


def test_velocities_have_the_unit_of_the_lengths():
    w, n = frames()
    force = 0.3 * n + 0.05 * w
    velocity, _ = controlled(w, force, beside=0.1)
    inch = 1.0 / 25.4
    scaled, _ = controlled(
        w, force, 0.1 * inch, tip=TIP.in_unit(inch), options=OPTIONS.in_unit(inch)
    )
    assert np.allclose(scaled, velocity * inch, rtol=1e-12)


def test_velocities_turn_with_the_machine():
    w, n = frames()
    turn, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    force = 0.3 * n + 0.05 * w
    velocity, _ = controlled(w, force, beside=0.1)
    turned, _ = controlled(w @ turn.T, force @ turn.T, beside=0.1)
    assert np.allclose(turned, velocity @ turn.T)


@pytest.mark.parametrize("friction", [0.0, 0.15, 0.3, 1.0])
def test_friction_along_the_path_leaves_the_normal(friction):
    """Of surfaces that lean out of the planes in which the tip travels: along w x n."""
    w, n = frames()
    n += RNG.uniform(-1.0, 1.0, 50)[:, None] * w
    n /= np.linalg.norm(n, axis=1)[:, None]
    along = np.cross(w, n)
    along /= np.linalg.norm(along, axis=1)[:, None]
    force = 0.4 * (n - friction * along)
    assert np.allclose(across_path(force, along), n, atol=1e-12)
    assert friction_of(force, along) == pytest.approx(friction, abs=1e-9)
    for k in range(5):
        found = normals_with_friction(force[k : k + 1], w[k], friction)
        assert np.allclose(found, n[k], atol=1e-12)


def test_a_centre_is_where_the_force_bends_it():
    """A beam of 2 N/mm under 0.4 N is bent by 0.2 mm."""
    _, n = frames()
    reading = Reading(0.0, np.zeros((50, 3)), 0.4 * n)
    assert np.allclose(centre_of(reading, TIP), 0.2 * n)


def test_forces_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="least, force, most are 0.5, 0.4, 1.5"):
        TrackingOptions(least=0.5)
    with pytest.raises(ValueError, match="stiffness is 0"):
        Tip(stiffness=0.0)
