"""fit_paper, the paper's steps from sections to patch, against closed forms."""

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, UP, ball_height, graph_contours, moved, quadric_height
from touchatlas.patch import Penalty, fit_paper
from touchatlas.patch.paper.fit_paper import MULTIPLIER_FRACTION
from touchatlas.sim.study.cases import random_rotation

K1, K2, ANGLE = 0.017, -0.042, 0.4


def contours_of(height, noise=0.0, seed=0, **more):
    return graph_contours(height, 12.0, 25, noise, np.random.default_rng(seed), **more)


def error_between(patch, height):
    """Mean error over the disc of 0.7 radii."""
    i = np.arange(200) + 0.5
    r, a = 0.7 * patch.radius * np.sqrt(i / 200), i * np.pi * (3 - np.sqrt(5))
    x, y = r * np.cos(a), r * np.sin(a)
    return np.abs(patch.signed_distance(np.column_stack([x, y, height(x, y)]))).mean()


@pytest.mark.parametrize("penalty", Penalty)
@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_quadric_gives_its_frame_and_fixed_quadric(penalty, tilt):
    contours = contours_of(quadric_height(K1, K2, ANGLE), tilt=tilt)
    patch = fit_paper(np.zeros(3), contours, UP, penalty)
    # Tilted sections of a quadric are no parabolas, so their curvatures err with the window.
    slack = 1e-9 if tilt == 0.0 else 2e-4
    assert patch.curvatures.k1 == pytest.approx(K1, abs=slack)
    assert patch.curvatures.k2 == pytest.approx(K2, abs=slack)
    e1 = patch.frame.axes[0]
    assert abs(e1 @ [np.cos(ANGLE), np.sin(ANGLE), 0.0]) == pytest.approx(1.0, abs=10 * slack)
    orders = patch.polynomial.basis.orders
    assert patch.polynomial.coefficients[orders < 2].tolist() == [0.0, 0.0, 0.0]


def test_least_squares_is_exact_on_a_quadric_and_folds_under_noise():
    height = quadric_height(K1, K2, ANGLE)
    exact = fit_paper(np.zeros(3), contours_of(height), UP, Penalty.NONE)
    assert error_between(exact, height) < 1e-9
    errors = {
        penalty: np.mean(
            [
                error_between(
                    fit_paper(np.zeros(3), contours_of(ball_height, 0.02, s), UP, penalty),
                    ball_height,
                )
                for s in range(10)
            ]
        )
        for penalty in Penalty
    }
    assert errors[Penalty.NONE] > 2.0 * errors[Penalty.TOTAL_CURVATURE]
    assert errors[Penalty.TOTAL_CURVATURE] > 2.0 * errors[Penalty.EXCESS_CURVATURE]


def test_the_data_residual_grows_with_the_multiplier():
    contours = contours_of(quadric_height(K1, K2, ANGLE), 0.02)
    residuals = [
        fit_paper(np.zeros(3), contours, UP, Penalty.TOTAL_CURVATURE, lam).residual_rms
        for lam in (0.0, 0.03, 0.3, 3.0)
    ]
    assert residuals == sorted(residuals)
    plain = fit_paper(np.zeros(3), contours, UP, Penalty.NONE)
    assert residuals[0] == pytest.approx(plain.residual_rms, rel=1e-6)


@pytest.mark.parametrize("penalty", Penalty)
def test_rigid_motion_and_scale_leave_the_patch_the_same(penalty):
    contours = contours_of(quadric_height(K1, K2, ANGLE), 0.02)
    rotation, shift = random_rotation(np.random.default_rng(1)), np.array([5.0, 80.0, -3.0])
    one = fit_paper(np.zeros(3), contours, UP, penalty)
    two = fit_paper(shift, moved(contours, rotation, shift, 50.0), rotation @ UP, penalty)
    assert two.curvatures.k1 * 50.0 == pytest.approx(one.curvatures.k1, rel=1e-9)
    assert two.residual_rms == pytest.approx(50.0 * one.residual_rms, rel=1e-9)
    points = one.frame.to_world(np.random.default_rng(2).uniform(-5, 5, size=(20, 3)))
    there = 50.0 * points @ rotation.T + shift
    # Identities but for rounding, which the solver's condition of 1e6 may enlarge.
    moved_by = two.signed_distance(there) / 50.0 - one.signed_distance(points)
    assert np.abs(moved_by).max() < 1e-9 * one.radius
    assert two.deviation(there) == pytest.approx(50.0 * one.deviation(points), rel=1e-9)


def test_umbilic_takes_the_mean_of_both_curvatures():
    patch = fit_paper(np.zeros(3), contours_of(ball_height, 0.02), UP, Penalty.NONE)
    k1, k2, std = patch.curvatures.k1, patch.curvatures.k2, patch.curvatures.std
    assert k1 == pytest.approx(k2, rel=1e-12) and patch.curvatures.umbilic
    # The quadratic through a circular arc of 21 degrees either way is 1 % off.
    assert abs(k1 + 1.0 / BALL_RADIUS) < 4.0 * std[0] + 0.02 / BALL_RADIUS


def test_errors_of_normal_and_curvature_are_as_large_as_told():
    """Over 200 draws; the medians, since windows are chosen by the residuals."""
    tilts, curvature_errors = [], []
    for seed in range(200):
        contours = contours_of(quadric_height(K1, K2, ANGLE), 0.02, seed)
        patch = fit_paper(np.zeros(3), contours, UP, Penalty.NONE)
        tilts.append((patch.frame.normal[:2] ** 2).sum() / np.trace(patch.covariance[1:3, 1:3]))
        curvature_errors.append(abs(patch.curvatures.k2 - K2) / patch.curvatures.std[1])
    # A median of 200 deviates by a tenth.
    assert np.sqrt(np.mean(tilts)) == pytest.approx(1.0, abs=0.3)
    assert np.median(curvature_errors) / 0.6745 == pytest.approx(1.0, abs=0.4)


def test_what_no_curve_sees_is_uncertain():
    patch = fit_paper(np.zeros(3), contours_of(ball_height, 0.02), UP, Penalty.NONE)
    on, between = (
        patch.frame.origin + 0.8 * patch.radius * np.array([np.cos(a), np.sin(a), 0.0])
        for a in (0.0, np.pi / 6)
    )
    along, across = patch.deviation(np.array([on, between]))
    assert across > 10.0 * along


@pytest.mark.parametrize(
    ("angles", "words"),
    [([0.0, 0.0, 0.0], "same tangent"), ([0.0, 1.0], "2 sections"), ([0, 0, 1], "three distinct")],
)
def test_too_few_directions_are_refused(angles, words):
    with pytest.raises(ValueError, match=words):
        fit_paper(np.zeros(3), contours_of(ball_height, angles=angles), UP, Penalty.NONE)


def test_the_default_multiplier_is_the_papers_at_a_radius_of_20():
    assert pytest.approx(0.3) == MULTIPLIER_FRACTION * 20.0**2
