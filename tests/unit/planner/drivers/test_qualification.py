"""A ball of known radius tells radius, stiffness and noise of a probe."""

import numpy as np
import pytest

from touchatlas.planner.drivers.fitted_ball import fit_ball, form_1x25, pattern_1x25
from touchatlas.planner.drivers.qualification import qualify

BALL, TIP, CENTRE = 12.5, 1.0, np.array([3.0, -4.0, 50.0])


def scan_lines(count=4000, forces=(0.2, 0.6)):
    """Directions (n, 3) along meridians of a half ball, and forces along them that swell."""
    t = np.linspace(0.0, 1.0, count)
    polar, turn = 0.5 * np.pi * np.abs(np.cos(5 * np.pi * t)), 2.0 * np.pi * np.floor(5 * t) / 5
    u = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], 1)
    swell = forces[0] + (forces[1] - forces[0]) * np.sin(37.0 * t) ** 2
    return u, swell[:, None] * u


def test_the_pattern_has_25_places_and_is_that_of_its_axis():
    """Angles from the pole are 0, 22.5, 45, 67.5 and 90 degrees; a rotation of the axis rotates
    it."""
    u = pattern_1x25([0.0, 0.0, 1.0])
    angles, counts = np.unique(np.degrees(np.arccos(u[:, 2])).round(6), return_counts=True)
    np.testing.assert_allclose(angles, [0.0, 22.5, 45.0, 67.5, 90.0])
    np.testing.assert_array_equal(counts, [1, 4, 8, 4, 8])
    other = pattern_1x25([3.0, 0.0, 4.0])
    np.testing.assert_allclose(other @ [0.6, 0.0, 0.8], u[:, 2], atol=1e-12)
    # No two places are nearer than twice the angle within which a point belongs to one.
    assert np.degrees(np.arccos(np.sort(u @ u.T, axis=1)[:, -2])).min() > 2 * 11.25


def test_the_ball_is_the_minimum_of_squares():
    """Moved in any direction, the sum of squares grows."""
    rng = np.random.default_rng(0)
    points = CENTRE + (BALL + TIP) * pattern_1x25([0, 0, 1.0]) + 0.01 * rng.normal(size=(25, 3))
    ball = fit_ball(points)

    def squares(centre, radius):
        return ((np.linalg.norm(points - centre, axis=1) - radius) ** 2).sum()

    least = squares(ball.centre, ball.radius)
    for k in range(3):
        for step in (-1e-5, 1e-5):
            assert squares(ball.centre + step * np.eye(3)[k], ball.radius) > least
            assert squares(ball.centre, ball.radius + step) > least


def test_radius_and_noise_are_found_within_their_deviations():
    """Over 200 balls the errors in units of the stated deviation have the deviation 1, within four
    standard errors (0.2); so has the radius no bias beyond four of its own."""
    rng = np.random.default_rng(1)
    noise, found = 0.005, []
    for _ in range(200):
        points = CENTRE + (BALL + TIP) * pattern_1x25([0, 0, 1.0])
        result = qualify(points + noise * rng.normal(size=points.shape), BALL)
        found.append(
            [(result.tip.radius - TIP) / result.tip.radius_std, result.tip.noise_std / noise]
        )
    errors, noises = np.array(found).T
    assert errors.std() == pytest.approx(1.0, abs=0.2)
    assert abs(errors.mean()) < 4.0 / np.sqrt(200)
    # A deviation of 21 degrees of freedom scatters by 1 / sqrt(42) = 0.15.
    assert noises.mean() == pytest.approx(1.0, abs=4 * 0.15 / np.sqrt(200) + 0.012)


def test_form_is_the_range_of_the_25_points():
    """One place that is too high by d, at the pole, where it moves the ball least: the range is d
    less what the fit takes up, which the hat matrix tells."""
    u = pattern_1x25([0, 0, 1.0])
    high = np.zeros(25)
    high[0] = 0.01
    jacobian = np.hstack([-u, -np.ones((25, 1))])
    left = high - jacobian @ np.linalg.lstsq(jacobian, high, rcond=None)[0]
    points = CENTRE + (BALL + TIP + high)[:, None] * u
    # The linear fit errs by the square of the error over the radius.
    assert qualify(points, BALL).form_1x25 == pytest.approx(np.ptp(left), abs=2 * 0.01**2 / BALL)


def test_more_points_give_the_form_of_those_of_the_pattern():
    rng = np.random.default_rng(2)
    u = rng.normal(size=(3000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    points = (BALL + TIP) * u
    assert qualify(points, BALL).form_1x25 == pytest.approx(0.0, abs=1e-9)
    cap = points[u[:, 2] > 0.5]
    result = qualify(cap, BALL)
    assert result.form_1x25 is None
    assert "do not cover" in result.said[0]
    assert form_1x25(points, fit_ball(points), [1.0, 1.0, 0.0]) is not None


def test_forces_that_vary_tell_stiffness_and_radius_at_once():
    """The tip is held by a beam of 2 N/mm: where it would be unbent is the ball less F / k."""
    rng = np.random.default_rng(3)
    u, forces = scan_lines()
    unbent = CENTRE + (BALL + TIP) * u - forces / 2.0
    result = qualify(unbent + 0.005 * rng.normal(size=u.shape), BALL, forces, scanned=True)
    tip = result.tip
    assert abs(tip.radius - TIP) < 4 * tip.radius_std < 0.004
    assert abs(tip.stiffness / 2.0 - 1.0) < 4 * tip.stiffness_std < 0.04
    assert tip.noise_std == pytest.approx(0.005, rel=0.05)
    # The largest of 4,000 normal errors is about 3.5 deviations to either side.
    assert result.form_scan == pytest.approx(7.0 * 0.005, rel=0.3)


def test_forces_by_the_tip_are_turned_round():
    u, forces = scan_lines()
    unbent = CENTRE + (BALL + TIP) * u - forces / 2.0
    result = qualify(unbent, BALL, -forces, scanned=True)
    assert result.tip.stiffness == pytest.approx(2.0, rel=1e-6)
    assert "taken as those of the tip" in result.said[0]


def test_an_even_force_tells_no_stiffness_and_what_is_stated_is_kept():
    """Radius and bending by an even force are one sum."""
    rng = np.random.default_rng(4)
    u, forces = scan_lines(forces=(0.4, 0.4))
    points = CENTRE + (BALL + TIP) * u - forces / 2.0 + 0.005 * rng.normal(size=u.shape)
    with pytest.raises(ValueError, match=r"0\.4 to 0\.4 N do not tell"):
        qualify(points, BALL, forces, scanned=True)
    result = qualify(
        points,
        BALL,
        forces,
        radius=0.9,
        stiffness=2.0,
        stiffness_std=0.05,
        scanned=True,
    )
    assert result.tip.radius == pytest.approx(TIP, abs=0.002)
    assert result.size == pytest.approx(0.2, abs=0.004)
    assert "stated one is kept" in result.said[0]


def test_errors_that_neighbours_share_make_the_radius_less_sure():
    """Waves of 0.01 with a period of 200 readings: the white part is what was added."""
    rng = np.random.default_rng(5)
    u, _ = scan_lines()
    wave = 0.01 * np.sin(np.arange(len(u)) / 32.0)
    points = CENTRE + (BALL + TIP + wave)[:, None] * u
    tip = qualify(points + 0.002 * rng.normal(size=u.shape), BALL, scanned=True).tip
    assert tip.noise_std == pytest.approx(0.002, rel=0.1)
    assert tip.error_std == pytest.approx(0.01 / np.sqrt(2.0), rel=0.1)
    assert abs(tip.radius - TIP) < 4 * tip.radius_std


@pytest.mark.parametrize(
    "points, ball, words",
    [
        (pattern_1x25([0, 0, 1.0]), 2.0, "see radius, diameter"),
        (pattern_1x25([0, 0, 1.0])[-8:], 0.5, "touch it all around"),
        (pattern_1x25([0, 0, 1.0])[:5], 0.5, "too few"),
        (pattern_1x25([0, 0, 1.0]), 0.0, "must be more than 0"),
        (np.random.default_rng(6).normal(size=(8, 3)) * [1, 1, 0.3], 0.5, "lie on no ball"),
    ],
)
def test_what_tells_no_ball_is_refused_in_a_sentence(points, ball, words):
    with pytest.raises(ValueError, match=words):
        qualify(points, ball)


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"stiffness": 0.0}, "stiffness is 0.0; it must be more than 0"),
        ({"stiffness": np.nan}, "stiffness is nan"),
        ({"axis": (0.0, 0.0, 0.0)}, "it must have a direction"),
        ({"radius": np.nan}, "stated radius is nan"),
    ],
)
def test_what_is_stated_of_a_probe_has_to_be_possible(known, words):
    u = pattern_1x25([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=words):
        qualify((BALL + TIP) * u, BALL, 0.4 * u, **({"stiffness": 2.0} | known))


def test_points_of_a_body_that_is_no_ball_are_doubted():
    """An ellipsoid of axes 13, 13.5 and 14 is off by a hundred times the noise, in waves; points of
    a ball in any order, with noise or but rounded, are not doubted."""
    rng, along = np.random.default_rng(0), np.linspace(0.0, 20.0, 100)
    polar = 0.5 * along / along[-1] * np.pi
    rings = np.stack(
        [np.sin(polar) * np.cos(along), np.sin(polar) * np.sin(along), np.cos(polar)], 1
    )
    noise = 0.003 * rng.normal(size=rings.shape)
    body = qualify([13.0, 13.5, 14.0] * rings + noise, BALL)
    assert any("miss their ball alike" in sentence for sentence in body.said)
    for points in (13.5 * rings, 13.5 * rings + noise):
        assert not any("alike" in sentence for sentence in qualify(points, BALL).said)
