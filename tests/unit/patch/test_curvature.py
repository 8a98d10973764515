"""Laws of Meusnier and Euler, and the paper's appendix A against least squares."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.laws.appendix_a import curvatures_of_three_sections
from touchatlas.patch.geometry.curvature import (
    curvatures_from_sections,
    normal_curvature,
    normal_from_tangents,
    principal_directions,
)

curvature = st.floats(-1.0, 1.0)
angle = st.floats(0.0, np.pi)


def euler(k1, k2, theta):
    return k1 * np.cos(theta) ** 2 + k2 * np.sin(theta) ** 2


@given(curvature, curvature, angle, st.floats(0.15, 1.0), st.floats(0.15, 1.0))
def test_appendix_a_and_least_squares_agree(k, gap, turn, first, second):
    """Two routes to one answer; 1e-9 because sections 0.15 rad apart cost two digits each."""
    k1, k2 = max(k, gap), min(k, gap)
    if k1 - k2 < 1e-3:
        return
    angles = np.array([0.0, first, first + second])
    sections = euler(k1, k2, angles - turn)
    a1, a2, a_angle = curvatures_of_three_sections(sections, angles)
    b1, b2, b_angle, *_ = curvatures_from_sections(sections, angles, np.full(3, 1e-12))
    assert abs(a1 - k1) < 1e-9 and abs(a2 - k2) < 1e-9
    assert abs(b1 - k1) < 1e-9 and abs(b2 - k2) < 1e-9
    # A direction is known to the error of the curvatures over their difference.
    assert abs(np.sin(a_angle - turn)) < 1e-9 / (k1 - k2)
    assert abs(np.sin(b_angle - turn)) < 1e-9 / (k1 - k2)


def test_three_equal_sections_are_an_umbilic():
    assert curvatures_of_three_sections([0.2, 0.2, 0.2], [0.0, 1.0, 2.0]) == (0.2, 0.2, 0.0)
    k1, k2, direction, _, umbilic, _ = curvatures_from_sections(
        np.full(3, 0.2), np.array([0.0, 1.0, 2.0]), np.full(3, 0.01)
    )
    assert umbilic and direction == 0.0 and k1 == pytest.approx(k2)


@pytest.mark.parametrize("angles", [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0 + np.pi]])
def test_repeated_directions_are_refused(angles):
    with pytest.raises(ValueError, match="direction"):
        curvatures_of_three_sections([0.1, 0.2, 0.3], angles)
    with pytest.raises(ValueError, match="distinct directions"):
        curvatures_from_sections(np.array([0.1, 0.2, 0.3]), np.array(angles), np.full(3, 0.1))


def test_two_sections_are_refused():
    with pytest.raises(ValueError, match="2 sections"):
        curvatures_from_sections(np.zeros(2), np.array([0.0, 1.0]), np.ones(2))


def test_even_sections_have_condition_root_two_and_the_stated_scatter():
    angles = np.pi / 3 * np.arange(3)
    *_, std, _, condition = curvatures_from_sections(
        euler(2.0, -1.0, angles - 0.3), angles, np.full(3, 0.01)
    )
    assert condition == pytest.approx(np.sqrt(2.0), rel=1e-12)
    # Design matrix with even angles: variances s^2/3 of H and 2 s^2/3 of b: std of k is s.
    assert std == pytest.approx([0.01, 0.01], rel=1e-12)


def test_scatter_of_principal_curvatures_follows_the_stated_std():
    rng = np.random.default_rng(1)
    angles = np.array([0.1, 1.0, 2.3])
    truth = euler(2.0, -1.0, angles - 0.4)
    noise, draws = 0.01, 4000
    values = np.array(
        [
            curvatures_from_sections(truth + noise * rng.normal(size=3), angles, np.full(3, noise))[
                :2
            ]
            for _ in range(draws)
        ]
    )
    *_, std, _, _ = curvatures_from_sections(truth, angles, np.full(3, noise))
    # The standard error of a standard deviation is 1/sqrt(2 n): 4 of them.
    assert values.std(axis=0) == pytest.approx(std, rel=4.0 / np.sqrt(2 * draws))


def test_umbilic_test_has_its_stated_false_alarm_rate():
    rng = np.random.default_rng(2)
    angles, draws = np.pi / 3 * np.arange(3), 4000
    missed = np.mean(
        [
            not curvatures_from_sections(
                -0.03 + 0.001 * rng.normal(size=3), angles, np.full(3, 0.001)
            )[4]
            for _ in range(draws)
        ]
    )
    assert abs(missed - 0.05) < 4.0 * np.sqrt(0.05 * 0.95 / draws)


@given(curvature, curvature, angle)
def test_orthogonal_normal_curvatures_sum_to_twice_mean_curvature(k, other, theta):
    k1, k2 = max(k, other), min(k, other)
    assert euler(k1, k2, theta) + euler(k1, k2, theta + np.pi / 2) == pytest.approx(
        k1 + k2, abs=1e-12
    )


@given(st.floats(0.0, 1.4))
def test_oblique_sections_of_a_ball_have_its_normal_curvature(tilt):
    """A plane that leans by t cuts a ball of radius r in a circle of radius r cos t."""
    r = 33.0
    toward_centre = np.array([[np.sin(tilt), 0.0, -np.cos(tilt)]])
    got = normal_curvature(toward_centre / (r * np.cos(tilt)), np.array([0.0, 0.0, 1.0]))
    assert got == pytest.approx([-1.0 / r], rel=1e-12)


def test_normal_minimises_the_sum_of_squares():
    rng = np.random.default_rng(3)
    tangents = rng.normal(size=(4, 3)) * [1.0, 1.0, 0.05]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    normal = normal_from_tangents(tangents, np.array([0.0, 0.0, 1.0]))
    best = ((tangents @ normal) ** 2).sum()
    others = rng.normal(size=(2000, 3))
    others /= np.linalg.norm(others, axis=1)[:, None]
    assert (((tangents @ others.T) ** 2).sum(axis=0) >= best).all()


def test_parallel_tangents_are_refused():
    with pytest.raises(ValueError, match="same tangent"):
        normal_from_tangents(np.array([[1.0, 0, 0], [-1.0, 0, 0], [1.0, 0, 0]]), np.ones(3))


def test_principal_directions_diagonalise():
    shape = np.array([[1.0, 0.4], [0.4, -2.0]])
    k1, k2, theta = principal_directions(shape)
    e1, e2 = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
    assert shape @ e1 == pytest.approx(k1 * e1, abs=1e-14)
    assert shape @ e2 == pytest.approx(k2 * e2, abs=1e-14)
    assert k1 > k2
