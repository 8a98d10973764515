"""The diagnosis names what was done to a touch, and leaves good touches alone."""

import json

import numpy as np
import pytest

from tests.truths import ORIGIN, UP, graph_contours, moved, quadric_height
from touchatlas.patch import Contour, DiagnosisLimits, SamplingPlane, diagnose, fit_patch
from touchatlas.patch.fit.advice import ADVICE
from touchatlas.sim.study.cases import random_rotation

NOISE = 1e-3
HEIGHT = quadric_height(-0.2, -0.4, 0.3)


def touch(seed=0, height=HEIGHT, angles=None, reach=1.0):
    rng = np.random.default_rng(seed)
    return graph_contours(height, reach, 19, NOISE, rng, angles=angles)


def diagnosed(contours):
    return diagnose(fit_patch(ORIGIN, contours, UP).patch, contours)


def shifted(contour, off):
    return Contour(contour.points + off, contour.plane, contour.noise_std, contour.ends)


def test_good_touches_are_not_doubted():
    """One false alarm in a thousand for each of ten tests: at most two in sixty touches."""
    assert sum(bool(diagnosed(touch(seed)).doubts) for seed in range(60)) <= 2


@pytest.mark.parametrize(
    ("limit", "number", "doubt"),
    [
        ("condition", "condition", "poor sections"),
        ("miss", "miss", "contradiction"),
        ("off_plane", "off_plane", "off plane"),
        ("unlike", "unlike", "unlike curves"),
    ],
)
def test_a_patch_is_doubted_where_a_number_exceeds_its_limit(limit, number, doubt):
    contours = touch()
    patch = fit_patch(ORIGIN, contours, UP).patch
    found = getattr(diagnose(patch, contours), number)
    for factor, doubts in ((0.99, {doubt}), (1.01, set())):
        limits = DiagnosisLimits(**{limit: factor * found})
        assert {doubt} & set(diagnose(patch, contours, limits).doubts) == doubts


def test_a_curve_beside_the_others_is_doubted():
    one, *others = touch()
    found = diagnosed((shifted(one, 20 * NOISE * UP), *others))
    assert {"misfit", "contradiction"} & set(found.doubts)


@pytest.mark.parametrize("size", [6, 10, 20, 50, 200])
@pytest.mark.parametrize("count", [3, 4, 5])
def test_the_curve_beside_the_others_is_named_and_without_it_curvatures_are_right(size, count):
    """Also where the fit leaves the whole curve out as bad contacts. Advice on what the curve
    explains would mend nothing. Two numbers exceed four deviations once in 8,000."""
    for seed in range(4):
        curves = list(touch(seed, angles=np.deg2rad([0, 60, 120, 30, 90][:count])))
        which = seed % count
        curves[which] = shifted(curves[which], (-1) ** seed * size * NOISE * UP)
        found = diagnosed(tuple(curves))
        assert "contradiction" in found.doubts and found.displaced == (which,)
        assert len(found.advice) == 1 and found.advice[0].startswith(f"Curve {which} (")
        if count > 3:
            rest = tuple(c for i, c in enumerate(curves) if i != which)
            patch = fit_patch(ORIGIN, rest, UP).patch
            known = patch.curvatures
            errors = np.array([known.k1, known.k2]) - [-0.2, -0.4]
            assert (np.abs(errors) < 4.0 * known.std).all()
            assert not {"contradiction", "misfit", "bad contacts"} & set(
                diagnose(patch, rest).doubts
            )


def test_two_of_five_curves_beside_the_others_are_named():
    curves = list(touch(angles=np.deg2rad([0, 60, 120, 30, 90])))
    for i, size in ((1, 20.0), (4, -35.0)):
        curves[i] = shifted(curves[i], size * NOISE * UP)
    assert diagnosed(tuple(curves)).displaced == (1, 4)


def test_no_curve_is_named_where_none_can_be_told():
    """Three curves at three heights: each may be the right one."""
    one, two, three = touch()
    apart = one, shifted(two, 20 * NOISE * UP), shifted(three, 40 * NOISE * UP)
    assert "contradiction" in diagnosed(apart).doubts and not diagnosed(apart).displaced


def test_a_curve_that_the_fit_leaves_out_is_a_contradiction_though_all_meet():
    """One of five curves turned by 10 degrees about the common point: all heights there agree, and
    which curve the fit leaves out is chance, so that none is named."""
    flat = touch(3, angles=np.deg2rad([0, 60, 120, 30, 90]))
    tilted = touch(3, lambda x, y: HEIGHT(x, y) + 0.17 * x, angles=[0.0])
    found = diagnosed((*tilted, *flat[1:]))
    assert "contradiction" in found.doubts and not found.displaced


def test_good_curves_miss_each_other_by_noise():
    """The largest of three misses in a touch exceeds four deviations once in 5,000, and curves of
    a rotated and scaled touch miss each other by the same."""
    worst = [diagnosed(touch(seed)).miss for seed in range(60)]
    # The largest of three half-normal numbers is 1.33 in the mean, that of sixty to 0.08.
    assert max(worst) < 4.0 and np.mean(worst) == pytest.approx(1.33, abs=0.3)
    rotation = random_rotation(np.random.default_rng(3))
    there = moved(touch(0), rotation, ORIGIN, 1e3)
    found = diagnose(fit_patch(ORIGIN, there, rotation @ UP).patch, there)
    assert found.miss == pytest.approx(worst[0], rel=1e-3)


def test_a_curve_in_another_unit_is_doubted():
    one, *others = touch()
    larger = moved((one,), np.eye(3), ORIGIN, 25.4)[0]
    larger = Contour(larger.points, larger.plane, NOISE, larger.ends)
    assert "unlike curves" in diagnosed((larger, *others)).doubts


@pytest.mark.parametrize("angle", [2.0, 4.0])
def test_a_curve_that_was_rotated_about_the_point_is_doubted(angle):
    """Its tangent leaves that of the others by 35 and 70 noises at its ends."""
    one, *others = touch()
    axis, turn = np.cross(one.plane.normal, UP), np.deg2rad(angle)
    across = np.cross(one.plane.normal, axis)
    rows = np.stack([np.cos(turn) * axis + np.sin(turn) * across, one.plane.normal])
    rotation = np.stack([axis, one.plane.normal]).T @ rows + np.outer(
        across, np.cos(turn) * across - np.sin(turn) * axis
    )
    turned = moved((one,), rotation, ORIGIN)[0]
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    found = diagnosed((turned, *others))
    assert {"contradiction", "misfit"} & set(found.doubts)
    # All three still cross in the point, and any two tangents have a plane: none can be named.
    assert not found.displaced


def test_a_curve_off_its_plane_is_doubted():
    one, *others = touch()
    plane = SamplingPlane(ORIGIN, np.array([0.0, np.cos(0.4), np.sin(0.4)]))
    wrong = Contour(one.points, plane, NOISE, one.ends)
    assert "off plane" in diagnosed((wrong, *others)).doubts


def test_waves_that_the_patch_does_not_follow_are_doubted():
    """Four noises high, three samples a wave."""
    found = diagnosed(touch(height=lambda x, y: HEIGHT(x, y) + 0.004 * np.sin(20.0 * x + 20.0 * y)))
    assert {"misfit", "waves"} & set(found.doubts)


def test_near_planes_are_doubted_and_the_weakest_direction_is_across_them():
    """Planes within 8 degrees of the x axis say least along y."""
    angles = np.deg2rad([-8.0, 0.0, 8.0])
    found = diagnosed(touch(angles=angles))
    assert "poor sections" in found.doubts and found.condition > 10.0
    assert abs(found.weakest_direction[1]) > 0.8


def test_the_weakest_direction_lies_between_the_curves():
    """Three planes 60 degrees apart are weakest 30 degrees off them, to the grid of 7.5."""
    found = diagnosed(touch())
    angle = np.rad2deg(np.arctan2(found.weakest_direction[1], found.weakest_direction[0]))
    assert abs(angle % 60.0 - 30.0) < 15.0


def test_a_curve_in_the_weakest_direction_lowers_the_deviation_there():
    contours = touch()
    found = diagnosed(contours)
    direction = np.arctan2(found.weakest_direction[1], found.weakest_direction[0])
    more = touch(1, angles=[direction])
    assert diagnosed((*contours, *more)).weakest_deviation < 0.7 * found.weakest_deviation


def test_k_changes_its_sign_over_half_of_a_cubic_cylinder():
    """z = -x^2/2 + y^3/6 has K = -y: another sign on one side than on the other. K = 0 at the
    origin, so the patch is moved by the noise to either side."""
    found = diagnosed(touch(height=lambda x, y: -0.5 * x * x + (y + 0.05) ** 3 / 6.0))
    assert found.sign_changes == pytest.approx(0.5, abs=0.15)


def test_no_unit_and_no_frame_changes_a_diagnosis():
    contours = touch()
    rotation, scale = random_rotation(np.random.default_rng(2)), 1e4
    there = moved(contours, rotation, np.array([1e5, 0.0, 3.0]), scale)
    patch = fit_patch(np.array([1e5, 0.0, 3.0]), there, rotation @ UP).patch
    here, found = diagnosed(contours), diagnose(patch, there)
    assert found.doubts == here.doubts
    # The slope tolerance of a frame is half a deviation of the mean.
    assert found.weakest_deviation == pytest.approx(scale * here.weakest_deviation, rel=0.05)
    assert found.residual_ratio == pytest.approx(here.residual_ratio, rel=0.02)


def test_a_diagnosis_is_strict_json_with_a_sentence_for_each_doubt():
    found = diagnosed(touch(angles=np.deg2rad([-8.0, 0.0, 8.0]))).as_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["advice"] == [ADVICE[doubt] for doubt in found["doubts"]]
