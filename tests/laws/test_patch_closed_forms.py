"""fit_patch against closed forms, and against its own predicted deviations."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, UP, ball_height, graph_contours, quadric_height
from touchatlas.patch import Contour, ContourEnd, FitOptions, Patch, SamplingPlane, fit_patch


def disc(radius, fraction, count=200):
    """Even points of the disc of ``fraction * radius``."""
    i = np.arange(count) + 0.5
    r, a = fraction * radius * np.sqrt(i / count), i * np.pi * (3 - np.sqrt(5))
    return r * np.cos(a), r * np.sin(a)


def height_error(patch, height, fraction=0.7):
    x, y = disc(patch.radius, fraction)
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


@dataclass(frozen=True)
class Draw:
    """A patch, and the height that it was fitted to."""

    patch: Patch
    height: Callable


K1, K2, ANGLE = 0.02, -0.03, 0.3


@pytest.fixture(scope="module")
def family() -> list[Draw]:
    """Patches of smooth surfaces of the family that the prior describes."""
    draws = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        cubic, quartic = rng.normal(size=4) * 1e-4, rng.normal(size=5) * 1e-6
        quadric = quadric_height(K1, K2, ANGLE)

        def height(x, y, cubic=cubic, quartic=quartic, quadric=quadric):
            powers = sum(c * x ** (3 - j) * y**j for j, c in enumerate(cubic))
            powers = powers + sum(c * x ** (4 - j) * y**j for j, c in enumerate(quartic))
            return quadric(x, y) + powers

        contours = graph_contours(height, 12.0, 19, 0.02, rng)
        draws.append(Draw(fit_patch(np.zeros(3), contours, UP).patch, height))
    return draws


def test_intervals_of_95_per_cent_hold_as_often(family):
    """92 to 98 % of heights between the curves, as in tests/studies, within three standard errors
    of the mean: heights of one patch err together, so each patch counts once."""
    held = []
    for draw in family:
        x, y = disc(draw.patch.radius, 0.75, 60)
        points = np.column_stack([x, y, draw.height(x, y)])
        error = np.abs(draw.patch.signed_distance(points))
        held.append(np.mean(error <= 1.96 * draw.patch.deviation(points)))
    slack = 3.0 * np.std(held) / np.sqrt(len(held))
    assert 0.92 - slack <= np.mean(held) <= 0.98 + slack


def test_curvatures_and_direction_err_as_their_deviations_say(family):
    """Errors over deviations have rms one. The family's width is only estimated by the evidence,
    hence a quarter either way; the rms of 150 draws is known to 6 %."""
    errors = []
    for draw in family:
        c = draw.patch.curvatures
        e1 = c.directions[0] * np.sign(c.directions[0][0])
        angle = np.arctan2(e1[1], e1[0]) - ANGLE
        errors.append(np.array([c.k1 - K1, c.k2 - K2, angle]) / [*c.std, c.direction_std])
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert rms == pytest.approx(np.ones(3), abs=0.25)


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


@pytest.mark.parametrize("degree", [3, 4, 5, 6])
def test_a_height_of_the_degree_of_the_options_is_exact_and_one_degree_less_is_not(degree):
    """Seven sections determine all 28 coefficients of degree 6."""
    rng = np.random.default_rng(degree)
    orders = [(d - j, j) for d in range(2, degree + 1) for j in range(d + 1)]
    sizes = 0.1 * rng.normal(size=len(orders)) * 10.0 ** (1.0 - np.sum(orders, axis=1))

    def height(x, y):
        return sum(c * x**i * y**j for c, (i, j) in zip(sizes, orders, strict=True))

    angles = np.pi / 7 * np.arange(7)
    contours = graph_contours(height, 10.0, 31, 0.0, rng, angles)
    errors = []
    for tried in (degree - 1, degree):
        options = FitOptions(tried, height_only=True, adaptive=False)
        # The floor and the bias keep the radius and the weights of all samples.
        kept = {"bias": 1e-5, "radius_floor": 10.0}
        patch = fit_patch(np.zeros(3), contours, UP, options=options, **kept).patch
        errors.append(np.abs(height_error(patch, height)).max())
    # Exact contacts have a noise of 1e-6 of the radius, and the prior pulls by that much.
    assert errors[1] < 1e-5 * 10.0 < 0.1 * errors[0]
