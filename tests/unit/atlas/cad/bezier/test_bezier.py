"""Bezier curves and faces: the same points from other control points, and kept sides."""

import numpy as np
import pytest

from touchatlas.atlas.cad.bezier.bezier import (
    bernstein,
    bernstein_slopes,
    coons,
    curve_points,
    face_points,
    face_slopes,
    halves,
    hermite,
)

T = np.linspace(0.0, 1.0, 11)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("degree", [1, 3, 5])
def test_bernstein_polynomials_sum_to_one_and_their_slopes_to_zero(degree):
    assert bernstein(degree, T).sum(axis=1) == pytest.approx(1.0, abs=1e-14)
    assert bernstein_slopes(degree, T).sum(axis=1) == pytest.approx(0.0, abs=1e-13)


def test_slopes_are_differences_of_points(rng):
    control, step = rng.normal(size=(4, 4, 3)), 1e-6
    u, v = np.array([0.3, 0.7]), np.array([0.2, 0.9])
    by_u, by_v = face_slopes(control, u, v)
    near = face_points(control, u + step, v) - face_points(control, u - step, v)
    assert by_u == pytest.approx(near / (2.0 * step), abs=1e-7)
    near = face_points(control, u, v + step) - face_points(control, u, v - step)
    assert by_v == pytest.approx(near / (2.0 * step), abs=1e-7)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_halves_are_the_same_curve(rng, degree):
    control = rng.normal(size=(degree + 1, 3))
    first, second = halves(control)
    assert curve_points(first, T) == pytest.approx(curve_points(control, 0.5 * T), abs=1e-13)
    assert curve_points(second, T) == pytest.approx(curve_points(control, 0.5 + 0.5 * T), abs=1e-13)


def test_a_raised_degree_is_the_same_curve(rng):
    ends = rng.normal(size=(4, 3))
    cubic, quintic = (curve_points(hermite(*ends, degree), T) for degree in (3, 5))
    assert quintic == pytest.approx(cubic, abs=1e-13)


def test_a_coons_face_has_the_sides_that_it_is_made_of(rng):
    corners, sides = rng.normal(size=(4, 3)), rng.normal(size=(4, 4, 3))
    sides[:, 0], sides[:, -1] = corners, np.roll(corners, -1, axis=0)
    face, zero = coons(sides), np.zeros(len(T))
    for k, (u, v) in enumerate(
        [(T, zero), (zero + 1.0, T), (1.0 - T, zero + 1.0), (zero, 1.0 - T)]
    ):
        assert face_points(face, u, v) == pytest.approx(curve_points(sides[k], T), abs=1e-13)
