"""Curves that are not of one surface, and points out of order: refused, or held by deviations."""

import numpy as np
import pytest

from tests.truths import graph_contours, quadric_height
from touchatlas.sim.recorded.contour_file import Curve
from touchatlas.sim.recorded.curve_offsets import check_order, offset_deviation
from touchatlas.sim.recorded.fit_file import _fit
from touchatlas.sim.recorded.recording import prepare
from touchatlas.sim.study.scenes import SURFACES, draw_scene

K1, K2 = -0.017, -0.042


def curves(seed, noise=0.02):
    rng = np.random.default_rng(seed)
    found = graph_contours(quadric_height(K1, K2, 0.4), 12.0, 25, noise, rng)
    return [Curve(name, c.points, None) for name, c in zip("abc", found, strict=True)], rng


@pytest.mark.parametrize("size", [0.05, 0.2, 1.0, 3.0])
def test_deviations_hold_the_truth_where_one_of_three_curves_is_displaced(size):
    """Twelve displacements up, and twelve to any side. A normal number is beyond 4 once in 16,000;
    up to four deviations are allowed for what the prior adds."""
    for seed in range(24):
        recorded, rng = curves(seed)
        side = rng.normal(size=3) if seed % 2 else np.array([0.0, 0.0, 1.0])
        j = rng.integers(3)
        moved = recorded[j].points + size * side / np.linalg.norm(side)
        recorded[j] = Curve(recorded[j].name, moved, None)
        recording = prepare(recorded)
        patch, _ = _fit("map", recording, np.array([0.0, 0.0, 1.0]))
        found = np.array([patch.curvatures.k1, patch.curvatures.k2])
        assert (np.abs(found - [K1, K2]) < 4.0 * patch.curvatures.std).all(), seed
        if seed % 2 == 0 and size > 0.1:
            assert "curves do not meet" in recording.flags


def test_the_offset_is_that_of_the_curves_and_scales_with_them():
    recorded, _ = curves(1, noise=1e-4)
    recorded[0] = Curve("a", recorded[0].points + [0.0, 0.0, 0.9], None)
    for scale in (1.0, 1000.0):
        scaled = [Curve(c.name, scale * c.points, None) for c in recorded]
        recording = prepare(scaled, 1e-4 * scale)
        # Heights 0.9, 0, 0 have a standard deviation of 0.9 / sqrt(3), whatever point is between.
        offset = scale * 0.9 / np.sqrt(3.0)
        found = offset_deviation(recording.point, recording.contours, 1e-4 * scale)
        assert found == pytest.approx(offset, rel=0.02)
        # Shared by all 25 points of a curve, it is no smaller in their mean.
        assert recording.contours[0].noise_std == pytest.approx(5.0 * offset, rel=0.02)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.02, 0.1])
def test_curves_of_one_surface_are_not_called_displaced(noise):
    """Of 48 draws at one in 1,000 each, one or more in 20 is."""
    for surface in SURFACES:
        for k in range(4):
            scene = draw_scene(surface, noise, 0.3 * (k % 2), np.random.default_rng([1, k]))
            contours = zip("abcdef", scene.contours, strict=False)
            recording = prepare([Curve(name, c.points, None) for name, c in contours], noise)
            assert "curves do not meet" not in recording.flags, (surface, k)


def test_shuffled_points_are_refused_for_what_they_are():
    for seed in range(10):
        recorded, rng = curves(seed)
        mixed = recorded[1].points[rng.permutation(25)]
        with pytest.raises(ValueError, match="points of curve 'b' are in no order of travel"):
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
