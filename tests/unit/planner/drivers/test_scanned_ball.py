"""Scan lines on a ball as a recording: smoothed readings, and the noise of single ones."""

import numpy as np
import pytest

from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.scanned_ball import qualify_recording

BALL, TIP, STIFFNESS, RATE = 12.5, 1.0, 2.0, 250.0


def scan(noise=0.005, force_noise=0.02, forces=(0.35, 0.45), jump=0.0, seed=0):
    """Six meridians at 10 mm/s, each at one of two forces, with air between."""
    rng, rows = np.random.default_rng(seed), []
    turns = np.arange(-0.5 * np.pi, 0.5 * np.pi, 10.0 / RATE / (BALL + TIP))
    for k in range(6):
        along = np.array([np.cos(k), np.sin(k), 0.0])
        n = np.outer(np.sin(turns), along) + np.outer(np.cos(turns), [0.0, 0.0, 1.0])
        force = forces[k % 2] * n
        places = (BALL + TIP) * n - force / STIFFNESS
        places[len(n) // 2 : len(n) // 2 + 5] += jump * n[len(n) // 2]
        rows += [np.hstack([places, force]), np.zeros((60, 6))]
    rows = np.vstack(rows)
    rows += np.hstack([np.full(3, noise), np.full(3, force_noise)]) * rng.normal(size=rows.shape)
    return Recording(np.arange(len(rows)) / RATE, rows[:, :3], rows[:, 3:], "mm")


def test_noise_of_the_force_does_not_make_the_stiffness_larger():
    """Forces differ by 0.1 N, their noise is 0.02: of single readings the compliance would shrink
    by 1 / (1 + 0.02^2 / 0.05^2), 14 %; of 41 smoothed ones by 0.8 %, less than four deviations."""
    tip = qualify_recording(scan(), BALL, least=0.2).tip
    assert abs(tip.radius - TIP) < 4 * tip.radius_std < 0.02
    assert abs(tip.stiffness / STIFFNESS - 1.0) < 4 * tip.stiffness_std < 0.1
    assert tip.noise_std == pytest.approx(0.005, rel=0.05)
    assert tip.force_std == pytest.approx(0.02, rel=0.05)


def test_form_is_that_of_smoothed_readings():
    """The largest of some thousand normal errors is about 3.5 deviations to either side; those of
    41 readings are 1.5 / sqrt(41) of 0.005, and of the force."""
    found = qualify_recording(scan(force_noise=0.001), BALL, least=0.2)
    assert found.form_scan == pytest.approx(7.0 * 0.005 * 1.5 / np.sqrt(41), rel=0.3)
    assert found.tip.error_std < 0.001


def test_readings_about_a_bounce_are_left_out():
    """Five readings in each line are 0.5 mm off the ball. What is smoothed across them is gone, no
    more than two windows of 41 to either side; what is left has the form without a bounce."""
    whole, cut = (qualify_recording(scan(jump=jump), BALL, least=0.2) for jump in (0.0, 0.5))
    assert 6 * 5 < whole.points - cut.points < 6 * (4 * 41 + 5)
    assert cut.tip.noise_std == pytest.approx(0.005, rel=0.05)
    assert cut.form_scan < 2.0 * whole.form_scan


def test_a_recording_without_scan_lines_is_refused():
    with pytest.raises(ValueError, match="never above 9 N for 0.32 s"):
        qualify_recording(scan(), BALL, least=9.0)
    held = scan()
    rng = np.random.default_rng(1)
    wild = held.positions + np.cumsum(rng.normal(size=held.positions.shape) ** 5, axis=0)
    with pytest.raises(ValueError, match=r"goes evenly|do not tell|lie on a ball"):
        qualify_recording(Recording(held.times, wild, held.forces), BALL, least=0.2)
