"""A caller's mistakes, and data that determine nothing, end in one sentence, never in NaN."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import ORIGIN, UP, graph_contours
from touchatlas.patch import (
    Contour,
    ContourEnd,
    DiagnosisLimits,
    Penalty,
    SamplingPlane,
    UnfitError,
    diagnose,
    fit_paper,
    fit_patch,
)


def bowl(noise=1e-3, height=lambda x, y: -0.3 * (x * x + y * y), **more):
    return graph_contours(height, 1.0, 21, noise, np.random.default_rng(0), **more)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"point": np.full(3, np.nan)}, "NaN"),
        ({"point": np.zeros(2)}, "shape"),
        ({"outward": np.full(3, np.nan)}, "NaN"),
        ({"outward": np.zeros(2)}, "shape"),
        ({"outward": ORIGIN}, "zero or tangent"),
        ({"shared": np.full((1, 3), np.nan)}, "NaN"),
        ({"shared": np.zeros((2, 2))}, "shape"),
        ({"shared": np.zeros(3)}, "shape"),
        ({"bias": -1.0}, "lengths"),
        ({"bias": np.nan}, "lengths"),
        ({"radius_limit": 0.0}, "lengths"),
        ({"radius_limit": -1.0}, "lengths"),
        ({"radius_limit": np.nan}, "lengths"),
        ({"radius_floor": np.nan}, "lengths"),
        ({"radius_floor": np.inf}, "lengths"),
        ({"options": 3}, "give a SmoothnessPrior and FitOptions, or leave both"),
        ({"prior": None}, "give a SmoothnessPrior and FitOptions, or leave both"),
    ],
)
def test_a_wrong_argument_is_named(changes, sentence):
    arguments = {"point": ORIGIN, "contours": bowl(), "outward": UP} | changes
    with pytest.raises(ValueError, match=sentence) as caught:
        fit_patch(**arguments)
    assert not isinstance(caught.value, UnfitError)


def test_shared_samples_may_be_a_list():
    fit_patch(ORIGIN, bowl(), UP, shared=[[0.1, 0.1, -0.006]])


@pytest.mark.parametrize("fit", [fit_patch, lambda *a: fit_paper(*a, Penalty.NONE)])
@pytest.mark.parametrize(
    ("contours", "outward", "words"),
    [
        (bowl(0.0, height=lambda x, y: 0.0 * x), [1.0, 0.0, 0.0], "zero or tangent"),
        (None, UP, "got NoneType among the contours.*give a tuple"),
        ([None] * 3, UP, "got NoneType among the contours.*give a tuple"),
        ((*bowl()[:2], np.zeros((5, 3))), UP, "got ndarray among the contours.*give a tuple"),
    ],
)
def test_what_neither_fit_can_take_is_refused_by_both(fit, contours, outward, words):
    with pytest.raises(ValueError, match=words):
        fit(ORIGIN, contours, outward)


@pytest.mark.parametrize("penalty", [None, "none", np.nan, Penalty.NONE.value])
def test_a_penalty_of_the_paper_is_a_penalty(penalty):
    with pytest.raises(ValueError, match="penalty is of type .*; give a Penalty"):
        fit_paper(ORIGIN, bowl(), UP, penalty)


@pytest.mark.parametrize("limit", [np.nan, -1.0, "4", None, np.ones(2)])
def test_limits_of_a_diagnosis_are_numbers(limit):
    with pytest.raises(ValueError, match="miss is .*; it must be a finite number"):
        DiagnosisLimits(miss=limit)


@pytest.mark.parametrize("wrong", [10**400, [[1, 2, 3], [4, 5]], np.datetime64("2020-01-01"), 1j])
def test_points_are_real_numbers(wrong):
    with pytest.raises(ValueError, match="point is .*; real numbers are needed"):
        fit_patch(wrong, bowl(), UP)


def test_large_components_of_a_normal_overflow_nothing():
    with pytest.raises(ValueError, match="must be a unit vector"):
        SamplingPlane(ORIGIN, [1e308] * 3)


def test_a_diagnosis_is_of_a_patch_and_contours():
    fitted = fit_patch(ORIGIN, bowl(), UP)
    with pytest.raises(ValueError, match="got PatchFit for the patch; give a Patch"):
        diagnose(fitted, bowl())
    with pytest.raises(ValueError, match="got NoneType among the contours.*give a tuple"):
        diagnose(fitted.patch, None)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.zeros(3), r"shape \(3,\).*\(n, 3\)"),
        (np.zeros((1, 2)), r"shape \(1, 2\).*\(n, 3\)"),
        (0.0, r"shape \(\).*\(n, 3\)"),
        ([[0.0, 0.0, np.nan]], "NaN"),
    ],
)
def test_points_are_rows_of_three_finite_numbers(points, words):
    patch = fit_patch(ORIGIN, bowl(), UP).patch
    frame = patch.frame
    for method in (patch.signed_distance, patch.normal, patch.deviation):
        with pytest.raises(ValueError, match=words):
            method(points)
        assert len(method(np.zeros((0, 3)))) == 0
    for method in (frame.to_local, frame.to_world):
        with pytest.raises(ValueError, match=words):
            method(points)


@pytest.mark.parametrize(
    ("points", "words"),
    [(np.zeros(2), r"\(n, 2\)"), ([[0.0, 0.0, 0.0]], "2"), ([[0, np.inf]], "NaN")],
)
def test_local_points_are_rows_of_two_finite_numbers(points, words):
    polynomial = fit_patch(ORIGIN, bowl(), UP).patch.polynomial
    for method in (polynomial.height, polynomial.gradient, polynomial.hessian):
        with pytest.raises(ValueError, match=words):
            method(points)
        assert len(method(np.zeros((0, 2)))) == 0


def test_contours_that_go_nowhere_are_refused():
    still = tuple(replace(c, points=np.zeros((9, 3))) for c in bowl())
    for point in (ORIGIN, np.array([0.1, 0.0, 0.0])):
        with pytest.raises(UnfitError):
            fit_patch(point, still, UP)
        with pytest.raises(ValueError, match="track further"):
            fit_paper(point, still, UP, Penalty.NONE)


def test_a_contour_that_ends_at_its_point_is_refused():
    contours = bowl(0.0)
    with pytest.raises(UnfitError, match="ends at the reference point"):
        fit_patch(contours[0].points[0], contours, UP)
    assert fit_patch(contours[0].points[0], contours, UP, radius_floor=0.5).patch.radius == 0.5


def test_a_radius_limit_below_the_sampling_is_refused():
    points = np.array([0.02, 0.02, 0.0])
    with pytest.raises(UnfitError, match="no sample"):
        fit_patch(points, bowl(), UP, radius_limit=1e-3)


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        # Singular but for rounding, which overflowed.
        ([0.0, 0.0, np.pi / 2], "directions"),
        ([0.0, np.pi / 2, 0.0, np.pi / 2, 0.0], "directions"),
        ([0.0, 0.0, 0.0], "same tangent|distinct directions"),
        ([0.0, 1.0], "2 sections"),
    ],
)
def test_sections_of_too_few_directions_are_refused(angles, words):
    for noise in (0.0, 1e-3):
        with pytest.raises(ValueError, match=words):
            fit_patch(ORIGIN, bowl(noise, angles=angles), UP)


def bump_of_nearly_parallel_sections():
    """Seed 182 of the fuzz: the point far off, sections six degrees apart."""
    contours = []
    for angle in 0.3 + 0.1 * np.arange(3):
        d, s = np.array([np.cos(angle), np.sin(angle), 0.0]), np.linspace(-1.0, 1.0, 13)
        points = s[:, None] * d + 0.3 * np.exp(-((s / 0.2) ** 2))[:, None] * UP
        plane = SamplingPlane(points[6], np.array([-d[1], d[0], 0.0]))
        contours.append(Contour(points, plane, 0.0, (ContourEnd.LENGTH_REACHED,) * 2))
    return tuple(contours)


@pytest.mark.parametrize("seed", range(40))
def test_no_linear_algebra_error_leaves_a_fit(seed):
    v = np.random.default_rng(seed).normal(size=3)
    contours = bump_of_nearly_parallel_sections()
    point = np.array([0.0, 0.0, 0.3]) + 0.5 * v / np.linalg.norm(v)
    try:
        patch = fit_patch(point, contours, UP).patch
    except UnfitError:
        return
    assert np.isfinite(patch.covariance).all()
    assert np.isfinite(patch.polynomial.coefficients).all()


def test_covariances_are_symmetric_to_the_last_digit():
    for noise in (0.0, 1e-3):
        contours = bowl(noise)
        covariance = fit_patch(ORIGIN, contours, UP).patch.covariance
        assert np.array_equal(covariance, covariance.T)
        covariance = fit_paper(ORIGIN, contours, UP, Penalty.NONE).covariance
        assert np.array_equal(covariance, covariance.T)


def test_one_exact_section_does_not_spoil_the_paper_fit():
    """Seeds 20436 and 20599 of the fuzz: one section exact, the others not, no noise stated."""
    noisy, exact = bowl(1e-3), bowl(0.0, height=lambda x, y: 0.0 * x)[0]
    contours = (exact, *(replace(c, noise_std=0.0) for c in noisy[1:]))
    for penalty in Penalty:
        covariance = fit_paper(ORIGIN, contours, UP, penalty).covariance
        assert np.diag(covariance).min() >= 0.0
        # The coefficient of x y is zero by equation (1), without any deviation.
        std = np.sqrt(np.diag(covariance)) + (np.diag(covariance) == 0.0)
        assert np.linalg.eigvalsh(covariance / np.outer(std, std)).min() > -1e-9


def test_the_paper_fit_names_what_is_missing():
    with pytest.raises(ValueError, match="0 sections"):
        fit_paper(ORIGIN, (), UP, Penalty.NONE)
    with pytest.raises(ValueError, match="NaN"):
        fit_paper(np.full(3, np.nan), bowl(), UP, Penalty.NONE)
