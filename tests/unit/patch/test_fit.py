"""fit_patch against closed forms, invariances, order of error and its own deviations."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import (
    BALL_RADIUS,
    ball_height,
    graph_contours,
    moved,
    quadric_height,
    random_rotation,
)
from touchatlas.patch.fit.fit_patch import FitOptions, fit_patch
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane

UP = np.array([0.0, 0.0, 1.0])


def disc(radius, share, count=200):
    """Even points of the disc of ``share * radius``."""
    i = np.arange(count) + 0.5
    r, a = share * radius * np.sqrt(i / count), i * np.pi * (3 - np.sqrt(5))
    return r * np.cos(a), r * np.sin(a)


def height_error(patch, height, share=0.7):
    x, y = disc(patch.radius, share)
    return patch.signed_distance(np.column_stack([x, y, height(x, y)]))


def test_quadric_patch_is_exact():
    """z = (k1 u^2 + k2 v^2)/2 is in the model; the prior on orders 3 and 4 pulls to zero,
    which is the truth, and the data are exact."""
    k1, k2, angle = 0.017, -0.042, 0.4
    height = quadric_height(k1, k2, angle)
    contours = graph_contours(height, 10.0, 19, 0.0, np.random.default_rng(0))
    patch = fit_patch(np.zeros(3), contours, UP).patch
    assert patch.curvatures.k1 == pytest.approx(k1, abs=1e-8)
    assert patch.curvatures.k2 == pytest.approx(k2, abs=1e-8)
    e1 = patch.curvatures.directions[0]
    assert abs(e1 @ [np.cos(angle), np.sin(angle), 0.0]) == pytest.approx(1.0, abs=1e-9)
    assert np.abs(height_error(patch, height)).max() < 1e-6
    assert patch.frame.axes @ patch.frame.axes.T == pytest.approx(np.eye(3), abs=1e-12)


def test_ball_has_negative_equal_curvatures_and_is_umbilic():
    rng = np.random.default_rng(1)
    contours = graph_contours(ball_height, 15.0, 19, 0.02, rng)
    curvatures = fit_patch(np.zeros(3), contours, UP).patch.curvatures
    assert curvatures.umbilic
    for value, std in zip((curvatures.k1, curvatures.k2), curvatures.std, strict=True):
        # Four deviations, and the umbilic bias of about two (k1 is the larger by definition).
        assert abs(value + 1.0 / BALL_RADIUS) < 6.0 * std


def test_rigid_motion_and_scale_leave_the_patch_the_same():
    rng = np.random.default_rng(2)
    height = quadric_height(0.02, -0.03, 0.3)
    contours = graph_contours(height, 12.0, 19, 0.02, rng)
    rotation, shift, scale = random_rotation(rng), np.array([5.0, 80.0, -3.0]), 7.5
    one = fit_patch(np.zeros(3), contours, UP).patch
    two = fit_patch(shift, moved(contours, rotation, shift, scale), rotation @ UP).patch
    assert two.radius == pytest.approx(scale * one.radius, rel=1e-9)
    assert two.curvatures.k1 * scale == pytest.approx(one.curvatures.k1, rel=1e-9)
    assert two.residual_rms == pytest.approx(scale * one.residual_rms, rel=1e-6)
    x, y = disc(one.radius, 0.9)
    points = np.column_stack([x, y, height(x, y) + 0.1])
    there = scale * points @ rotation.T + shift
    assert two.signed_distance(there) == pytest.approx(
        scale * one.signed_distance(points), abs=1e-8 * scale
    )
    assert two.deviation(there) == pytest.approx(scale * one.deviation(points), rel=1e-6)
    assert two.normal(there) == pytest.approx(one.normal(points) @ rotation.T, abs=1e-8)


def test_halving_the_radius_divides_the_error_by_two_to_the_degree_plus_one():
    """On a cubic-quintic graph with five sections, so that a quartic is determined."""

    def height(x, y):
        return 1e-2 * x * x - 6e-3 * y * y + 2e-5 * x**5 + 1e-5 * x**2 * y**3

    errors = []
    for reach in (8.0, 4.0):
        contours = graph_contours(
            height, reach, 41, 0.0, np.random.default_rng(3), angles=np.pi / 5 * np.arange(5)
        )
        patch = fit_patch(np.zeros(3), contours, UP).patch
        errors.append(np.sqrt(np.mean(height_error(patch, height) ** 2)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.2)


def test_deviation_holds_the_error_it_promises():
    """95 % intervals of height between the curves, over draws: a smooth surface from the
    family the prior speaks of. Heights within one patch are correlated, so the share is
    averaged over many patches."""
    held, draws = [], 60
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        cubic, quartic = rng.normal(size=4) * 1e-4, rng.normal(size=5) * 1e-6

        def height(x, y, cubic=cubic, quartic=quartic):
            powers = sum(c * x ** (3 - j) * y**j for j, c in enumerate(cubic))
            powers = powers + sum(c * x ** (4 - j) * y**j for j, c in enumerate(quartic))
            return 0.012 * x * x - 0.008 * y * y + powers

        contours = graph_contours(height, 15.0, 25, 0.02, rng)
        patch = fit_patch(np.zeros(3), contours, UP).patch
        x, y = disc(patch.radius, 0.75, 60)
        points = np.column_stack([x, y, height(x, y)])
        held.append(
            np.mean(np.abs(patch.signed_distance(points)) <= 1.96 * patch.deviation(points))
        )
    assert 0.85 < np.mean(held) < 0.995


def test_radius_shrinks_where_a_quartic_cannot_hold():
    def wavy(x, y):
        return 0.5 * np.sin(x / 2.0)

    contours = graph_contours(wavy, 20.0, 61, 0.02, np.random.default_rng(5))
    patch = fit_patch(np.zeros(3), contours, UP, bias=0.01).patch
    assert patch.radius < 0.5 * 20.0
    plain = graph_contours(quadric_height(0.01, 0.01), 20.0, 61, 0.02, np.random.default_rng(5))
    assert fit_patch(np.zeros(3), plain, UP, bias=0.01).patch.radius > 0.9 * 20.0


def test_hard_ends_do_not_limit_the_radius():
    contours = graph_contours(ball_height, 10.0, 21, 0.0, np.random.default_rng(6))
    first = contours[0]
    cut = Contour(
        first.points[8:],
        first.plane,
        0.0,
        (ContourEnd.LOST_CONTACT, ContourEnd.LENGTH_REACHED),
    )
    whole = fit_patch(np.zeros(3), contours, UP).patch.radius
    hard = fit_patch(np.zeros(3), (cut, *contours[1:]), UP).patch.radius
    assert hard == pytest.approx(whole, rel=1e-12)
    soft = replace(cut, ends=(ContourEnd.TURNED_AWAY, ContourEnd.LENGTH_REACHED))
    assert fit_patch(np.zeros(3), (soft, *contours[1:]), UP).patch.radius < 0.3 * whole


def test_fit_refuses_parallel_sections():
    contours = graph_contours(
        ball_height, 10.0, 19, 0.02, np.random.default_rng(7), angles=[0.0, 0.0, 0.0]
    )
    with pytest.raises(ValueError, match="same tangent|distinct directions"):
        fit_patch(np.zeros(3), contours, UP)


def test_fit_refuses_two_sections():
    contours = graph_contours(
        ball_height, 10.0, 19, 0.02, np.random.default_rng(8), angles=[0.0, 1.0]
    )
    with pytest.raises(ValueError, match="2 sections"):
        fit_patch(np.zeros(3), contours, UP)


def test_core_option_sets_the_outline():
    contours = graph_contours(ball_height, 10.0, 19, 0.0, np.random.default_rng(9))
    patch = fit_patch(np.zeros(3), contours, UP, options=FitOptions(core=0.6)).patch
    distances = np.linalg.norm(patch.outline - patch.frame.origin, axis=1)
    # Three fixed-point steps for the ring: error (slope^2/4)^3 of the radius.
    assert distances == pytest.approx(np.full(24, 0.6 * patch.radius), rel=1e-4)


def test_curvatures_and_direction_err_as_their_deviations_say():
    """Surfaces of the family that the prior speaks of: errors over deviations have rms one. The
    family's width is only guessed by the evidence, hence a quarter either way."""
    k1, k2, angle, errors = 0.02, -0.03, 0.3, []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        cubic, quartic = rng.normal(size=4) * 1e-4, rng.normal(size=5) * 1e-6
        quadric = quadric_height(k1, k2, angle)

        def height(x, y, cubic=cubic, quartic=quartic, quadric=quadric):
            powers = sum(c * x ** (3 - j) * y**j for j, c in enumerate(cubic))
            powers = powers + sum(c * x ** (4 - j) * y**j for j, c in enumerate(quartic))
            return quadric(x, y) + powers

        contours = graph_contours(height, 12.0, 19, 0.02, rng)
        c = fit_patch(np.zeros(3), contours, UP).patch.curvatures
        e1 = c.directions[0] * np.sign(c.directions[0][0])
        turn = np.arctan2(e1[1], e1[0]) - angle
        errors.append(np.array([c.k1 - k1, c.k2 - k2, turn]) / [*c.std, c.direction_std])
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert rms == pytest.approx(np.ones(3), abs=0.25)


def test_detail_that_is_explained_elsewhere_leaves_the_radius_alone():
    """Ripples of 0.2 on a bowl: without detail the patch shrinks until it can follow them; with
    it the curvatures at its centre are the bowl's, to the slope of ripples over the radius."""
    angles = np.pi * np.arange(3) / 3
    along = np.linspace(-20.0, 20.0, 61)
    contours = []
    for angle in angles:
        x, y = np.cos(angle) * along, np.sin(angle) * along
        z = -(x * x + y * y) / 200.0 + 0.2 * np.sin(1.3 * x + 0.4) * np.cos(1.1 * y)
        contours.append(
            Contour(
                np.stack([x, y, z - z[30]], axis=1),
                SamplingPlane(np.zeros(3), np.array([-np.sin(angle), np.cos(angle), 0.0])),
                0.01,
                (ContourEnd.LENGTH_REACHED, ContourEnd.LENGTH_REACHED),
            )
        )
    small = fit_patch(np.zeros(3), tuple(contours), UP, bias=0.02).patch
    large = fit_patch(np.zeros(3), tuple(contours), UP, bias=0.02, detail=0.5).patch
    assert small.radius < 0.5 * large.radius and large.radius > 0.95 * 20.0
    assert large.curvatures.k1 == pytest.approx(-0.01, abs=0.2 / 20.0)
