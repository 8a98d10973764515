"""Samples of time series: where they are, how far apart, and how sure."""

import numpy as np
import pytest

from touchatlas.planner import Tip
from touchatlas.planner.tracking.time_series import TimeSeries, samples_of, smoothed

RADIUS, FEED, RATE = 30.0, 10.0, 250.0
ACROSS = np.array([0.0, 1.0, 0.0])


def around_a_ball(tip: Tip, friction: float = 0.0, rng=None, length: float = 40.0) -> TimeSeries:
    """A tip that travels along a great circle of a ball of radius 30 about the origin."""
    count = int(length / FEED * RATE)
    travelled = np.arange(count) * FEED / RATE
    angle = travelled / (RADIUS + tip.radius)
    # Along y x n.
    n = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    along = np.stack([np.cos(angle), 0 * angle, -np.sin(angle)], axis=1)
    force = 0.4 * (n - friction * along)
    position = (RADIUS + tip.radius) * n - force / tip.stiffness
    if rng is not None:
        position = position + tip.noise_std * rng.normal(size=n.shape)
        force = force + tip.force_std * rng.normal(size=n.shape)
    return TimeSeries(np.arange(count) / RATE, position, force, travelled)


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_contacts_lie_on_the_surface_whatever_the_friction(friction):
    """A chord of 2 x 0.75 has the direction of the circle, but at the ends of the arm it is off by
    a = 0.75 / 2 / 32 rad = 0.7 degrees, and so is the normal; the contact by 2 a^2 / 2 = 1.4e-4.
    A parabola through 41 readings is off a circle by h^4 / 8 R^3 * 3/35 < 1e-6."""
    tip = Tip(noise_std=1e-3)
    found = samples_of(around_a_ball(tip, friction), ACROSS, tip, 0.16, 0.05, 2.5, np.pi)
    contacts = found.contacts(tip.radius)
    assert np.abs(np.linalg.norm(contacts, axis=1) - RADIUS).max() < 2e-4
    true = contacts / np.linalg.norm(contacts, axis=1)[:, None]
    assert np.degrees(np.arccos((true * found.normals).sum(axis=1).clip(-1, 1))).max() < 0.8


def test_samples_are_a_step_apart_and_the_first_is_the_contact():
    tip = Tip()
    found = samples_of(around_a_ball(tip), ACROSS, tip, 0.16, 0.05, 2.5, np.pi)
    gaps = np.linalg.norm(np.diff(found.centres, axis=0), axis=1)
    assert np.allclose(gaps, 2.5, atol=2.5 / 16 + FEED / RATE) and len(found.centres) == 16
    assert np.allclose(found.centres[0], [0.0, 0.0, RADIUS + tip.radius], atol=1e-4)


def test_samples_are_closer_where_the_normal_turns():
    """The path turns by 2.5 / 32 rad = 4.5 degrees a step; two degrees ask for samples between."""
    tip = Tip()
    found = samples_of(around_a_ball(tip), ACROSS, tip, 0.16, 0.05, 2.5, np.radians(2.0))
    turned = np.arccos((found.normals[1:] * found.normals[:-1]).sum(axis=1).clip(-1, 1))
    assert np.degrees(turned).max() < 2.0 + 4.5 / 8 + 0.1


def test_readings_without_force_give_no_samples():
    tip, series = Tip(), around_a_ball(Tip())
    lost = (series.travelled > 10.0) & (series.travelled < 20.0)
    forces = np.where(lost[:, None], 0.0, series.forces)
    series = TimeSeries(series.times, series.positions, forces, series.travelled)
    found = samples_of(series, ACROSS, tip, 0.16, 0.05, 2.5, np.pi)
    gaps = np.linalg.norm(np.diff(found.centres, axis=0), axis=1)
    assert gaps.max() > 7.5 and np.median(gaps) == pytest.approx(2.5, abs=0.2)


def test_stated_noise_is_the_scatter_of_samples():
    """600 distances; the standard error of a deviation of n numbers is 1 / sqrt(2 n) = 3 %."""
    tip, rng = Tip(), np.random.default_rng(2)
    offs = []
    for _ in range(40):
        found = samples_of(around_a_ball(tip, 0.15, rng), ACROSS, tip, 0.16, 0.05, 2.5, np.pi)
        offs += [*(np.linalg.norm(found.contacts(tip.radius), axis=1) - RADIUS)[1:]]
    assert np.std(offs) == pytest.approx(found.noise_std, rel=0.12)
    assert abs(np.mean(offs)) < 4.0 * found.noise_std / np.sqrt(len(offs)) + 1e-4


def test_parabolas_stay():
    at = np.linspace(-1, 1, 50)[:, None]
    values = 1.0 - 2.0 * at + 3.0 * at**2
    assert np.allclose(smoothed(values, 11), values)


def over_an_edge(tip: Tip, rng) -> TimeSeries:
    """A tip that travels over a sharp edge in the plane y = 0: 3 along x, a quarter of a circle of
    its radius about the edge, 3 down."""
    quarter = 0.5 * np.pi * tip.radius
    travelled = np.arange(int((6.0 + quarter) / FEED * RATE)) * FEED / RATE
    angle = np.clip((travelled - 3.0) / tip.radius, 0.0, 0.5 * np.pi)
    n = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    x, z = np.minimum(travelled - 3.0, 0.0), np.minimum(3.0 + quarter - travelled, 0.0)
    position = np.stack([x, 0 * x, z], axis=1) + (tip.radius - 0.4 / tip.stiffness) * n
    position += tip.noise_std * rng.normal(size=n.shape)
    return TimeSeries(np.arange(len(n)) / RATE, position, 0.4 * n, travelled)


def test_stated_noise_is_that_of_fewer_readings_where_the_path_bends():
    """The first sample is at the end of its parabola, and counts elsewhere. The deviation of 100
    arms of 5 samples of 3 coordinates is good to 1 / sqrt(2 * 1500) = 2 %; where noise decides
    between two windows they differ by the limit for that, which may add a tenth."""
    tip, rng = Tip(radius=0.5, force_std=0.0, noise_std=0.002), np.random.default_rng(3)
    arms = [
        samples_of(over_an_edge(tip, rng), ACROSS, tip, 0.16, 0.05, 1.0, np.pi) for _ in range(100)
    ]
    centres = np.array([arm.centres[1:] for arm in arms])
    stated = np.sqrt(np.mean([arm.noise_std**2 for arm in arms]))
    assert np.sqrt(centres.var(axis=0, ddof=1).mean()) == pytest.approx(stated, rel=0.1)
    assert stated > 1.1 * tip.sample_std(41)
