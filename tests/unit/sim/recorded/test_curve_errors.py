"""Curves that are not of one surface, and points out of order: refused, or held by deviations."""

from functools import cache

import numpy as np
import pytest

from tests.truths import graph_contours, quadric_height
from touchatlas.patch import fit_patch
from touchatlas.patch.fit.displacement import (
    displaced,
    displacement_covariance,
    estimate_displacements,
    prior_of,
)
from touchatlas.sim.recorded.curve_errors import check_order, offset_deviation
from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.fit_file import _fit
from touchatlas.sim.recorded.recording import prepare
from touchatlas.sim.study.scenes import SURFACES, draw_scene

K1, K2 = -0.017, -0.042


def curves(seed, noise=0.02, shape="elliptic"):
    rng = np.random.default_rng(seed)
    found = graph_contours(SHAPES[shape], 12.0, 25, noise, rng)
    return [Curve(name, c.points, None) for name, c in zip("abc", found, strict=True)], rng


SHAPES = {
    "elliptic": quadric_height(K1, K2, 0.4),
    "saddle": quadric_height(-K1, K2, 0.4),
    "cylinder": quadric_height(0.0, K2, 0.4),
}


# Each shape, and each size but the middle one; the other cases are slow.
QUICK = [("elliptic", 0.05), ("saddle", 3.0), ("cylinder", 3.0)]
OTHERS = [(shape, size) for shape in SHAPES for size in (0.05, 0.3, 3.0)]
OTHERS = [pytest.param(*case, marks=pytest.mark.slow) for case in OTHERS if case not in QUICK]


@pytest.mark.parametrize(("shape", "size"), [*QUICK, *OTHERS])
def test_deviations_hold_the_truth_where_one_of_three_curves_is_displaced(shape, size):
    """One of three curves is displaced by 2.5 to 150 noises, half of the times upwards and half of
    the times to any side. A normal number is beyond three deviations in 0.3 %: of 20 fits, one may
    be. The deviations are no excuse: they stay below a tenth of the larger curvature."""
    held, deviations = [], []
    for seed in range(20):
        recorded, rng = curves(seed, shape=shape)
        side = rng.normal(size=3) if seed % 2 else np.array([0.0, 0.0, 1.0])
        j = rng.integers(3)
        moved = recorded[j].points + size * side / np.linalg.norm(side)
        recorded[j] = Curve(recorded[j].name, moved, None)
        recording = prepare(recorded)
        patch, _ = _fit("map", recording, np.array([0.0, 0.0, 1.0]))
        found = np.array([patch.curvatures.k1, patch.curvatures.k2])
        truth = {"elliptic": [K1, K2], "saddle": [-K1, K2], "cylinder": [0.0, K2]}[shape]
        if seed % 2 == 0 and size > 0.1:
            assert "curves do not meet" in recording.flags
        if "curves do not meet" in recording.flags:
            held.append((np.abs(found - truth) < 3.0 * patch.curvatures.std).all())
            deviations.append(patch.curvatures.std.max())
    assert np.mean(held) >= 0.95 - 1e-9
    assert np.median(deviations) < 0.1 * abs(K2)


def test_failed_contacts_are_not_called_out_of_order():
    s = np.linspace(-8.0, 8.0, 31)
    curve = np.stack([s, 0.0 * s, -s * s / 50.0], axis=1)
    curve[[3, 17, 24], 2] -= 20.0
    with pytest.raises(ValueError, match=r"3 of 31 points far off .* points 4, 18, 25\)"):
        check_order("a", curve, 0.01)
    with pytest.raises(ValueError, match="in no order of travel"):
        check_order("a", np.random.default_rng(0).permutation(curve), 0.01)


def test_a_displacement_is_found_and_its_effect_does_not_fall_with_the_number_of_points():
    """Four curves of a quadric, of which one is lifted: the others are moved by a quarter of it the
    other way, because a common displacement is that of the surface. The height keeps the deviation
    of the mean of four displacements, whatever the number of points."""
    heights = {}
    up = np.array([0.0, 0.0, 1.0])
    for count in (25, 100):
        rng = np.random.default_rng(3)
        angles = np.deg2rad([0.0, 45.0, 90.0, 135.0])
        found = graph_contours(SHAPES["elliptic"], 12.0, count, 0.001, rng, angles=angles)
        contours = displaced(found, 0.3 * np.outer([0, 1, 0, 0], up))
        shifts = estimate_displacements(np.zeros(3), contours, up, 0.3)
        assert shifts @ up == pytest.approx(0.3 * np.array([-0.25, 0.75, -0.25, -0.25]), abs=0.02)
        moved = displaced(contours, -shifts)
        fit = fit_patch(np.zeros(3), moved, up)
        more = displacement_covariance(fit.patch, moved, 0.3, prior_of(fit))
        assert (np.linalg.eigvalsh(more) > -1e-9 * np.abs(more).max()).all()
        heights[count] = fit.patch.radius * np.sqrt(more[0, 0])
    assert heights[25] == pytest.approx(0.5 * 0.3, rel=0.05)
    assert heights[100] == pytest.approx(heights[25], rel=0.02)


def test_the_offset_is_that_of_the_curves_and_scales_with_them():
    recorded, _ = curves(1, noise=1e-4)
    recorded[0] = Curve("a", recorded[0].points + [0.0, 0.0, 0.9], None)
    for scale in (1.0, 1000.0):
        scaled = [Curve(c.name, scale * c.points, None) for c in recorded]
        recording = prepare(scaled, 1e-4 * scale)
        # Heights 0.9, 0, 0 have a standard deviation of 0.9 / sqrt(3), whatever point is between;
        # Student's t of two degrees of freedom holds 95 % at 4.303, a normal number at 1.96.
        offset = scale * 0.9 / np.sqrt(3.0) * 4.303 / 1.96
        found = offset_deviation(recording.point, recording.contours, 1e-4 * scale)
        assert found == pytest.approx(offset, rel=0.02)
        assert recording.displacement_std == pytest.approx(offset, rel=0.02)
        assert recording.contours[0].noise_std == 1e-4 * scale


@cache
def exact_points(surface, k):
    """Points of the curves of a scene without noise, which is dear to draw."""
    scene = draw_scene(surface, 0.0, 0.3 * (k % 2), np.random.default_rng([1, k]))
    return [c.points for c in scene.contours]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.02, 0.1])
def test_curves_of_one_surface_are_not_called_displaced(noise):
    """Of 24 draws at one in 1,000 each, one or more in 40 is."""
    for surface in SURFACES:
        for k in range(2):
            rng = np.random.default_rng([2, k])
            noisy = [p + noise * rng.normal(size=p.shape) for p in exact_points(surface, k)]
            named = zip("abc", noisy, strict=True)
            recording = prepare([Curve(name, points, None) for name, points in named], noise)
            assert "curves do not meet" not in recording.flags, (surface, k)


def test_shuffled_points_are_refused_for_what_they_are():
    for seed in range(10):
        recorded, rng = curves(seed)
        mixed = recorded[1].points[rng.permutation(25)]
        with pytest.raises(ValueError, match="curve 'b' has its points in no order of travel"):
            prepare([recorded[0], Curve("b", mixed, None), recorded[2]])


def test_swapped_neighbours_are_refused_and_named():
    points = curves(3)[0][0].points.copy()
    check_order("a", points, 0.02)
    points[[10, 11]] = points[[11, 10]]
    with pytest.raises(ValueError, match="goes to and fro at its points 11 and 12"):
        check_order("a", points, 0.02)


def test_what_honest_recordings_hold_is_no_disorder():
    points = curves(3)[0][0].points
    bad = points.copy()
    bad[7] += [0.0, 0.0, 8.0]
    half = len(points) // 2
    outward_twice = np.concatenate([points[half:], points[:half][::-1]])
    dense = np.linspace(0.0, 1.0, 4000)[:, None] * [1.0, 0, 0]
    dense = dense + 0.02 * np.random.default_rng(0).normal(size=dense.shape)
    for honest in (points, bad, outward_twice, dense, points[::6]):
        check_order("a", honest, 0.02)
