"""Kinks: where a contour runs over a sharp edge."""

import numpy as np
import pytest

from touchatlas.patch.geometry.kinks import SIDE, kinks
from touchatlas.sim.study.cases import random_rotation

ACROSS = np.array([0.0, 1.0, 0.0])


def curve(x, z, noise: float = 0.0, rng=None) -> np.ndarray:
    """(n, 3) points of a curve in the plane y = 0, with noise in that plane."""
    points = np.stack([x, np.zeros(len(x)), z], axis=1)
    if rng is not None:
        points += noise * rng.normal(size=points.shape) * [1.0, 0.0, 1.0]
    return points


def roof(at: float, slope: float, noise: float = 0.0, rng=None, count: int = 41) -> np.ndarray:
    """A ridge at ``at`` samples, with sides of slope ``slope``, in steps of one."""
    x = np.arange(count, dtype=float)
    return curve(x, -slope * np.abs(x - at), noise, rng)


def arc(radius: float, noise: float = 0.0, rng=None, count: int = 41) -> np.ndarray:
    """An arc of a circle in steps of one."""
    angle = np.arange(count) / radius
    return curve(radius * np.sin(angle), radius * np.cos(angle), noise, rng)


def parabola(radius: float, noise: float = 0.0, rng=None, count: int = 41) -> np.ndarray:
    x = np.arange(count) - 0.5 * count
    return curve(x, x * x / (2.0 * radius), noise, rng)


def polyline(corners, counts) -> np.ndarray:
    """Points of a line through corners (c, 2), so many a side, no point twice."""
    sides = [
        a + np.linspace(0.0, 1.0, n, endpoint=False)[:, None] * (b - a)
        for a, b, n in zip(corners[:-1], corners[1:], counts, strict=True)
    ]
    x, z = np.concatenate([*sides, corners[-1:]]).T
    return curve(x, z)


@pytest.mark.parametrize("slope", [0.2, 1.0])
@pytest.mark.parametrize("at", [12.0, 20.4])
def test_a_ridge_under_noise_is_found_within_a_sample(slope, at):
    """The ridge is of 18 standard deviations or more. The hinge that is off by one fits worse by
    about slope times step, ten deviations of the noise or more, so that none is off by two."""
    for seed in range(25):
        points = roof(at, slope, 0.02, np.random.default_rng(seed))
        found = kinks(points, ACROSS, 0.02)
        assert len(found) == 1
        assert abs(found[0] - at) <= 1.0


@pytest.mark.parametrize("slope", [0.9, 1.1])
def test_a_ridge_counts_from_five_degrees_on(slope):
    """The hinge of a roof of slope s turns by 2 s, as the tangent of an angle."""
    found = kinks(roof(20.0, 0.5 * slope * np.tan(np.deg2rad(5.0))), ACROSS, 1e-6)
    assert found.tolist() == ([20] if slope > 1.0 else [])


@pytest.mark.parametrize("noise", [0.05, 0.2])
@pytest.mark.parametrize(
    "smooth",
    # The hinge that the quartic term of a circle leaves is 0.23 a^3, a the angle of eight steps:
    # 0.015 at a = 0.4, where 5 degrees is 0.087.
    [
        lambda noise, rng: arc(SIDE / 0.4, noise, rng),
        lambda noise, rng: parabola(SIDE / 0.4, noise, rng),
        lambda noise, rng: roof(0.0, 0.3, noise, rng),
    ],
    ids=["arc", "parabola", "line"],
)
def test_no_smooth_curve_has_a_kink_under_the_noise_that_is_told(smooth, noise):
    """A false kink is at least 6.6 standard deviations, after the bias of 0.015: 4e-11 a sample."""
    for seed in range(40):
        points = smooth(noise, np.random.default_rng(seed))
        assert not len(kinks(points, ACROSS, noise))


def test_false_kinks_under_noise_that_is_not_told_are_as_rare_as_the_residuals_say():
    """Eight deviations, of Student's t with the degrees of freedom that a cubic and a hinge leave:
    12 within, 4e-6 a sample; 7 to 11 near the ends, 2e-4 for each of the two. In 200 lines of 41
    samples 0.1 are expected, and three or more have a chance of 2e-4."""
    false = 0
    for seed in range(200):
        points = roof(0.0, 0.3, 0.2, np.random.default_rng(seed))
        false += len(kinks(points, ACROSS, 0.0))
    assert false < 3


def test_a_kink_turned_moved_and_scaled_is_at_the_same_sample():
    rng = np.random.default_rng(4)
    points = roof(17.3, 0.4, 0.03, rng)
    found = kinks(points, ACROSS, 0.03)
    turn, shift = random_rotation(rng), 100.0 * rng.normal(size=3)
    for scale in (1e-3, 1e3):
        moved = scale * (points @ turn.T + shift)
        assert kinks(moved, turn @ ACROSS, scale * 0.03).tolist() == found.tolist()
    back = kinks(points[::-1], ACROSS, 0.03)
    assert (len(points) - 1 - back).tolist() == found.tolist() == [17]


def test_both_edges_of_a_slab_are_found():
    """Up one side, over the top, and down: two right angles, which share no window."""
    corners = np.array([[0.0, 0.0], [0.0, 20.0], [24.0, 20.0], [24.0, 0.0]])
    assert kinks(polyline(corners, [20, 24, 20]), ACROSS, 1e-3).tolist() == [20, 44]


def test_the_sharper_of_two_near_kinks_is_the_kink():
    """Nearer than eight samples, the window of each holds the other."""
    x = np.arange(60.0)
    points = curve(x, -0.5 * np.abs(x - 30.0) - 0.1 * np.abs(x - 35.0))
    assert kinks(points, ACROSS, 1e-3).tolist() == [30]


def test_every_second_sample_tells_the_same_to_two_samples():
    points = roof(41.0, 0.5, count=81)
    found = kinks(points, ACROSS, 1e-3, stride=2)
    assert len(found) == 1 and abs(found[0] - 41) <= 2


@pytest.mark.parametrize("count", range(7))
def test_fewer_than_seven_points_have_no_kink(count):
    """There are three samples to either side of a kink at least."""
    assert not len(kinks(roof(count // 2, 1.0, count=count), ACROSS, 1e-3))


def test_seven_points_have_one():
    assert kinks(roof(3.0, 1.0, count=7), ACROSS, 1e-3).tolist() == [3]
