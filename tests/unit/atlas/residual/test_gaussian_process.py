"""Trend plus residual against the joint Gaussian that it stands for."""

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from tests.residuals import (
    AMPLITUDE,
    LENGTH,
    NOISE,
    drawn,
    full,
    places_on_a_saddle,
    prior_precision,
    some_of,
)
from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.gaussian_process import (
    correlation,
    joint_variance,
    matern,
    residual_at,
    sample_covariance,
    solve_residual,
    trend_equations,
)
from touchatlas.atlas.residual.hyperparameters import (
    independent_equations,
)
from touchatlas.patch.fit.smoothness import log_evidence, posterior


def test_zero_amplitude_leaves_the_trend_alone():
    """Two routes to the same sums: by covariance and by weights; 1e-9 for 15 digits lost to
    the condition of the gram."""
    samples, _ = drawn(np.random.default_rng(0), 3, 80)
    precision = prior_precision(3)
    mean, covariance, residual = solve_residual(samples, full(3, 0), full(3, LENGTH), precision)
    alone, log_scale = independent_equations(samples)
    expected = posterior(alone.gram, alone.rhs, np.ones(3), precision)
    assert mean == pytest.approx(expected[0], rel=1e-7, abs=1e-9)
    assert covariance == pytest.approx(expected[1], rel=1e-7, abs=1e-12)
    g, gradient, shared = residual_at(residual, samples.feet)
    assert (g == 0).all() and (gradient == 0).all()
    trend = np.einsum("tmq,mts,smq->mq", samples.terms, covariance, samples.terms)
    assert joint_variance(residual, covariance, samples.terms, shared) == pytest.approx(trend)
    equations, scale = trend_equations(samples, full(3, 0), correlation(samples, full(3, LENGTH)))
    assert scale == pytest.approx(log_scale) and equations.sum_of_squares == pytest.approx(
        alone.sum_of_squares
    )


def test_evidence_is_the_density_of_the_joint_gaussian():
    samples, _ = drawn(np.random.default_rng(1), 2, 60)
    precision = prior_precision(2)
    alike = correlation(samples, full(2, LENGTH))
    equations, log_scale = trend_equations(samples, full(2, AMPLITUDE), alike)
    found = log_evidence(equations, np.ones(2), precision)[0] + log_scale
    matrices = sample_covariance(samples, full(2, AMPLITUDE), full(2, LENGTH))
    for i, matrix in enumerate(matrices):
        terms = samples.terms[:, i]
        joint = matrix + terms.T @ (terms / precision[i][:, None])
        density = multivariate_normal(np.zeros(60), joint).logpdf(samples.height[i])
        assert found[i] == pytest.approx(density + 30.0 * np.log(2 * np.pi), rel=1e-8)


def test_mean_and_variance_are_those_of_the_joint_gaussian_given_the_samples():
    """Conditional mean and variance at new points, the trend's prior part of the covariance.

    The direct route inverts a matrix of condition 1e6 n, so six digits are left of it.
    """
    samples, _ = drawn(np.random.default_rng(2), 1, 100)
    known, new = some_of(samples, slice(60)), some_of(samples, slice(60, None))
    precision = prior_precision(1)
    mean, covariance, residual = solve_residual(
        known, full(1, AMPLITUDE), full(1, LENGTH), precision
    )
    g, _, shared = residual_at(residual, new.feet)
    found = np.einsum("mt,tmq->mq", mean, new.terms) + g
    variance = joint_variance(residual, covariance, new.terms, shared)

    apart = np.linalg.norm(samples.feet[0][:, None] - samples.feet[0], axis=-1)
    terms = samples.terms[:, 0]
    prior = AMPLITUDE**2 * matern(apart / LENGTH) + terms.T @ (terms / precision[0][:, None])
    noise = NOISE**2 + (1e-3 * AMPLITUDE) ** 2
    gain = np.linalg.solve(prior[:60, :60] + noise * np.eye(60), prior[:60, 60:]).T
    assert found[0] == pytest.approx(gain @ known.height[0], abs=1e-6)
    expected = np.diag(prior[60:, 60:] - gain @ prior[:60, 60:])
    assert variance[0] == pytest.approx(expected, rel=1e-4, abs=1e-10)


def test_exact_samples_are_reproduced():
    """Within the fraction of the amplitude that every sample is taken to be off by."""
    samples, exact = drawn(np.random.default_rng(3), 4, 120, noise=1e-9)
    mean, covariance, residual = solve_residual(
        samples, full(4, AMPLITUDE), full(4, LENGTH), prior_precision(4)
    )
    g, _, shared = residual_at(residual, samples.feet)
    found = np.einsum("mt,tmq->mq", mean, samples.terms) + g
    assert np.abs(found - exact).max() < 3e-3 * AMPLITUDE
    deviation = np.sqrt(joint_variance(residual, covariance, samples.terms, shared))
    assert deviation.max() < 3e-3 * AMPLITUDE


def test_predicted_deviation_is_the_scatter_of_samples_held_out():
    """Squares of 40 x 30 errors over their predicted variances; those of one patch are
    dependent, so the bounds are of one tenth as many."""
    samples, exact = drawn(np.random.default_rng(4), 40, 150)
    known, new = some_of(samples, slice(120)), some_of(samples, slice(120, None))
    mean, covariance, residual = solve_residual(
        known, full(40, AMPLITUDE), full(40, LENGTH), prior_precision(40)
    )
    g, _, shared = residual_at(residual, new.feet)
    error = np.einsum("mt,tmq->mq", mean, new.terms) + g - exact[:, 120:]
    square = error**2 / joint_variance(residual, covariance, new.terms, shared)
    low, high = chi2.ppf([0.001, 0.999], 120) / 120
    assert low < square.mean() < high
    assert 0.92 < np.mean(square < 1.96**2) < 0.98


def test_gradient_is_that_of_the_mean():
    """Central differences; the error of the step, 1e-5 of the length, squared, is 1e-9 of it."""
    rng = np.random.default_rng(5)
    samples, _ = drawn(rng, 2, 80)
    residual = solve_residual(samples, full(2, AMPLITUDE), full(2, LENGTH), prior_precision(2))[2]
    points = places_on_a_saddle(rng, 2, 50)
    gradient, step = residual_at(residual, points)[1], 1e-5
    for axis in range(3):
        ahead, behind = points.copy(), points.copy()
        ahead[..., axis] += step
        behind[..., axis] -= step
        slope = (residual_at(residual, ahead)[0] - residual_at(residual, behind)[0]) / (2 * step)
        assert gradient[..., axis] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_padding_of_weight_zero_changes_nothing():
    samples, _ = drawn(np.random.default_rng(6), 2, 60)
    weight = samples.weight.copy()
    weight[1, 40:] = 0.0
    filled = PatchSamples(samples.feet, samples.terms, samples.height, weight, samples.noise)
    options = full(2, AMPLITUDE), full(2, LENGTH)
    mean, covariance, residual = solve_residual(filled, *options, prior_precision(2))
    short = some_of(samples[np.array([1])], slice(40))
    expected = solve_residual(short, *(o[:1] for o in options), prior_precision(1))
    assert mean[1:] == pytest.approx(expected[0], rel=1e-6, abs=1e-9)
    assert covariance[1:] == pytest.approx(expected[1], rel=1e-6, abs=1e-12)
    points = places_on_a_saddle(np.random.default_rng(7), 1, 20)
    g, gradient, shared = residual_at(residual[np.array([1])], points)
    assert g == pytest.approx(residual_at(expected[2], points)[0], abs=1e-9)
    amplitude, length = options
    short_scale = trend_equations(short, amplitude[:1], correlation(short, length[:1]))[1]
    scale = trend_equations(filled, amplitude, correlation(filled, length))[1]
    assert scale[1:] == pytest.approx(short_scale)
