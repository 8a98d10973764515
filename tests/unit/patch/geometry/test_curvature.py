"""Meusnier's and Euler's laws, and the quadrics that sections are of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.laws.patch_scenes import even_angles
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


@given(curvature, curvature, curvature, angle)
def test_orthogonal_normal_curvatures_sum_to_twice_mean_curvature(one, orthogonal, third, theta):
    """Any three normal curvatures belong to some surface, so no truth is needed."""
    angles = theta + np.array([0.0, np.pi / 2, np.pi / 4])
    k1, k2, *_ = curvatures_from_sections([one, orthogonal, third], angles, np.full(3, 0.1))
    assert k1 + k2 == pytest.approx(one + orthogonal, abs=1e-12)


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


def random_sections(rng):
    """Three angles at least 0.05 rad apart: below, digits are lost."""
    while True:
        angles = rng.uniform(0.0, np.pi, 3)
        if np.abs(np.sin(angles - np.roll(angles, 1))).min() > 0.05:
            return angles


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_any_three_sections_of_a_quadric_have_its_curvatures_and_directions(unit):
    """Euler's law gives the normal curvatures. Rounding grows with the square of the condition, at
    most 1e3 here; a direction is as uncertain as the curvatures over their difference."""
    rng = np.random.default_rng(0)
    for _ in range(1000):
        angles, theta = random_sections(rng), rng.uniform(0.0, np.pi)
        k2, k1 = np.sort(unit * rng.uniform(-1.0, 1.0, 2))
        sections = euler(k1, k2, angles - theta)
        found = curvatures_from_sections(sections, angles, np.full(3, 1e-12 * unit))
        size = abs(k1) + abs(k2)
        assert abs(found[0] - k1) < 1e-10 * size and abs(found[1] - k2) < 1e-10 * size
        assert abs(np.sin(found[2] - theta)) * (k1 - k2) < 1e-10 * size


def test_three_equal_sections_are_an_umbilic():
    """The paper's situation (a)."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        angles, k = random_sections(rng), rng.uniform(-1.0, 1.0)
        k1, k2, angle, _, umbilic, _ = curvatures_from_sections(
            np.full(3, k), angles, np.full(3, 1e-6)
        )
        assert umbilic
        assert (k1, k2, angle) == pytest.approx((k, k, 0.0), abs=1e-10)


@pytest.mark.parametrize("rotation", [0.0, np.pi, -np.pi])
def test_sections_of_one_direction_are_refused(rotation):
    """The paper's situation (b): two of the three equations are one."""
    angles, sections = np.array([0.3, 1.1, 0.3 + rotation]), np.array([0.1, -0.2, 0.1])
    with pytest.raises(ValueError, match="direction"):
        curvatures_from_sections(sections, angles, np.ones(3))


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_scatter_of_principal_curvatures_falls_with_the_sections(count):
    rng, angles, std = np.random.default_rng(count), even_angles(count), 1e-3
    truth = 2.0 * np.cos(angles - 0.4) ** 2 - np.sin(angles - 0.4) ** 2
    draws = np.array(
        [
            curvatures_from_sections(
                truth + std * rng.normal(size=count), angles, np.full(count, std)
            )[:3]
            for _ in range(3000)
        ]
    )
    # Four standard errors of a standard deviation from 3000 draws are 5 %.
    assert draws[:, 0].std() == pytest.approx(std * np.sqrt(3 / count), rel=0.1)
    assert draws[:, 1].std() == pytest.approx(std * np.sqrt(3 / count), rel=0.1)
    # k1 - k2 = 3; for three sections sqrt(2/3) std / (k1 - k2).
    assert draws[:, 2].std() == pytest.approx(np.sqrt(2 / count) * std / 3.0, rel=0.1)


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_umbilic_gap_is_a_bias_and_its_test_errs_as_often_as_stated(count):
    rng, angles, std, draws = np.random.default_rng(count), even_angles(count), 1e-3, 4000
    found = [
        curvatures_from_sections(-0.03 + std * rng.normal(size=count), angles, np.full(count, std))
        for _ in range(draws)
    ]
    gaps = np.array([k1 - k2 for k1, k2, *_ in found])
    # b and c are independent with variance 2 std^2/m: twice a Rayleigh mean, 2.05 std for m = 3,
    # known to 0.52/sqrt(draws) of itself.
    mean = 2.0 * np.sqrt(2.0 / count) * np.sqrt(np.pi / 2.0) * std
    assert gaps.mean() == pytest.approx(mean, rel=4.0 * 0.53 / np.sqrt(draws))
    rate = 0.05
    alarms = np.mean([not umbilic for *_, umbilic, _ in found])
    assert abs(alarms - rate) < 4.0 * np.sqrt(rate * (1.0 - rate) / draws)
