"""A probe qualified by a recording: readings along scan lines on a ball."""

from dataclasses import replace

import numpy as np

from touchatlas.planner.drivers.fitted_ball import LEAST_POINTS
from touchatlas.planner.drivers.qualification import Qualification, qualify, white_std
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.drivers.replay import times_in_contact
from touchatlas.planner.tracking.options import TrackingOptions
from touchatlas.planner.tracking.time_series import smoothed


def qualify_recording(
    recording: Recording,
    ball_radius: float,
    least: float = TrackingOptions().least,
    window: float = TrackingOptions().window,
    **known,
) -> Qualification:
    """What a recording of scan lines on a ball tells of a probe.

    Readings are smoothed as those of samples are. The noise of the force would make the stiffness
    seem larger: errors of the variable that explains shrink its coefficient (Fuller, Measurement
    error models, 1987, section 1.1). White noise is that of the readings themselves.

    Parameters
    ----------
    recording : Recording
    ball_radius : float, length
    least : float, N
        Readings with less force are in the air.
    window : float, s
    known
        What else ``qualify`` takes.

    Raises
    ------
    ValueError
        As ``qualify``, or the tip was never in contact for two windows of time.
    """
    size = np.sqrt((recording.forces**2).sum(axis=1))
    parts = [
        np.hstack([recording.times[part, None], recording.positions[part], recording.forces[part]])
        for part in times_in_contact(recording.times, size > least, window)
        if np.ptp(recording.times[part]) >= 2.0 * window
    ]
    if not parts:
        raise ValueError(
            f"the force is never above {least:g} N for {2.0 * window:g} s; give a smaller --least, "
            "or record scan lines on the ball"
        )
    noise, force = (white_std([part[:, k : k + 3] for part in parts]) for k in (1, 4))
    rows = [_even(part[:, 1:], _count(part[:, 0], window), noise) for part in parts]
    kept = np.concatenate(rows)
    if len(kept) < LEAST_POINTS:
        raise ValueError(
            "the tip never goes evenly along the ball; record scan lines without pauses and corners"
        )
    found = qualify(kept[:, :3], ball_radius, kept[:, 3:], scanned=True, **known)
    tip = replace(found.tip, noise_std=noise, force_std=force, error_std=0.0)
    rms = float(np.hypot(found.tip.noise_std, found.tip.error_std))
    left = tip.sample_std(_count(parts[0][:, 0], window))
    return replace(found, tip=replace(tip, error_std=float(np.sqrt(max(rms**2 - left**2, 0.0)))))


def _count(times, window: float) -> int:
    """How many readings a window holds: an odd number, enough for two parabolas."""
    return max(9, 2 * round(0.5 * window / float(np.median(np.diff(times)))) + 1)


def _even(both, count: int, noise: float, sure: float = 3.5) -> np.ndarray:
    """(k, 6) smoothed positions and forces, where a window of half the length agrees with them to
    so many deviations: elsewhere the path has a corner, or the tip bounces.

    A parabola is half as sure at its ends, and there the force is not yet even.
    """
    from scipy.ndimage import minimum_filter1d

    if len(both) < 2 * count:
        return np.zeros((0, 6))
    half = 2 * (count // 4) + 1
    whole, short = smoothed(both, count), smoothed(both, half)
    off = np.sqrt(((whole - short)[:, :3] ** 2).sum(axis=1))
    agrees = off <= sure * np.sqrt(3.0) * 1.5 * noise / np.sqrt(half)
    # Two windows may agree on a slope of a bounce: they have to all around.
    agrees = minimum_filter1d(agrees.astype(np.uint8), count, mode="nearest") > 0
    inner = np.zeros(len(both), bool)
    inner[count // 2 : -(count // 2)] = True
    return np.asarray(whole[inner & (agrees | (noise == 0.0))])
