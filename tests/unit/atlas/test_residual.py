"""Trend plus residual against the joint Gaussian it stands for, and on surfaces drawn from it."""

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from tests.explored import explored
from touchatlas.atlas.residual.binned_samples import SIDE, PatchSamples, merged
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
    ResidualScale,
    independent_equations,
    learn_residual_scale,
    residual_evidence,
)
from touchatlas.atlas.residual.learn_residuals import samples_of
from touchatlas.patch.fit.smoothness import coefficient_precision, log_evidence, posterior
from touchatlas.patch.geometry.polynomial import graded_basis, monomials

BASIS = graded_basis(4)
NOISE, AMPLITUDE, LENGTH = 1e-3, 8e-3, 0.35


def samples_at(feet, height, noise=NOISE):
    terms = monomials(BASIS, *np.moveaxis(feet, -1, 0))[: BASIS.size]
    shape = height.shape
    return PatchSamples(feet, terms, height, np.ones(shape), np.full(shape[0], noise))


def places(rng, m, n):
    """(m, n, 3) points of a saddle over the unit disc."""
    radius, angle = np.sqrt(rng.uniform(size=(m, n))), rng.uniform(0, 2 * np.pi, (m, n))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([x, y, 0.1 * x * x - 0.2 * y * y], axis=-1)


def prior_precision(m, turn=0.5):
    return coefficient_precision(BASIS, np.full(m, turn), np.full(m, 1.0))


def drawn(rng, m, n, noise=NOISE):
    """Samples of saddles with a residual drawn from its own law, and the heights without noise."""
    feet = places(rng, m, n)
    apart = np.linalg.norm(feet[:, :, None] - feet[:, None], axis=-1)
    covariance = AMPLITUDE**2 * matern(apart / LENGTH) + 1e-14 * np.eye(n)
    bumps = (np.linalg.cholesky(covariance) @ rng.normal(size=(m, n, 1)))[..., 0]
    exact = feet[..., 2] + bumps
    return samples_at(feet, exact + noise * rng.normal(size=(m, n)), noise), exact


def part(samples, columns):
    """Some samples of every patch."""
    return PatchSamples(
        *(samples.feet[:, columns], samples.terms[:, :, columns], samples.height[:, columns]),
        *(samples.weight[:, columns], samples.noise),
    )


def full(m, value):
    return np.full(m, float(value))


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
    known, new = part(samples, slice(60)), part(samples, slice(60, None))
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


def test_exact_samples_are_met():
    """Within the share of the amplitude that no sample is believed beyond."""
    samples, exact = drawn(np.random.default_rng(3), 4, 120, noise=1e-9)
    mean, covariance, residual = solve_residual(
        samples, full(4, AMPLITUDE), full(4, LENGTH), prior_precision(4)
    )
    g, _, shared = residual_at(residual, samples.feet)
    met = np.einsum("mt,tmq->mq", mean, samples.terms) + g
    assert np.abs(met - exact).max() < 3e-3 * AMPLITUDE
    deviation = np.sqrt(joint_variance(residual, covariance, samples.terms, shared))
    assert deviation.max() < 3e-3 * AMPLITUDE


def test_predicted_deviation_is_the_scatter_of_samples_held_out():
    """Squares of 40 x 30 errors over their predicted variances; those of one patch are
    dependent, so the bounds are of one tenth as many."""
    samples, exact = drawn(np.random.default_rng(4), 40, 150)
    known, new = part(samples, slice(120)), part(samples, slice(120, None))
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
    points = places(rng, 2, 50)
    gradient, step = residual_at(residual, points)[1], 1e-5
    for axis in range(3):
        ahead, behind = points.copy(), points.copy()
        ahead[..., axis] += step
        behind[..., axis] -= step
        slope = (residual_at(residual, ahead)[0] - residual_at(residual, behind)[0]) / (2 * step)
        assert gradient[..., axis] == pytest.approx(slope, rel=1e-5, abs=1e-7)


def test_what_fills_the_stack_says_nothing():
    samples, _ = drawn(np.random.default_rng(6), 2, 60)
    weight = samples.weight.copy()
    weight[1, 40:] = 0.0
    filled = PatchSamples(samples.feet, samples.terms, samples.height, weight, samples.noise)
    options = full(2, AMPLITUDE), full(2, LENGTH)
    mean, covariance, residual = solve_residual(filled, *options, prior_precision(2))
    short = part(samples[np.array([1])], slice(40))
    expected = solve_residual(short, *(o[:1] for o in options), prior_precision(1))
    assert mean[1:] == pytest.approx(expected[0], rel=1e-6, abs=1e-9)
    assert covariance[1:] == pytest.approx(expected[1], rel=1e-6, abs=1e-12)
    points = places(np.random.default_rng(7), 1, 20)
    g, gradient, shared = residual_at(residual[np.array([1])], points)
    assert g == pytest.approx(residual_at(expected[2], points)[0], abs=1e-9)
    amplitude, length = options
    short_scale = trend_equations(short, amplitude[:1], correlation(short, length[:1]))[1]
    scale = trend_equations(filled, amplitude, correlation(filled, length))[1]
    assert scale[1:] == pytest.approx(short_scale)


def test_merged_samples_keep_polynomials_and_weight():
    """Means of a polynomial's heights are its coefficients times means of its monomials."""
    rng = np.random.default_rng(8)
    feet = places(rng, 3, 3000)
    samples = samples_at(feet, np.zeros((3, 3000)))
    coefficients = rng.normal(size=(3, BASIS.size))
    height = np.einsum("mt,tmn->mn", coefficients, samples.terms)
    weight = rng.uniform(0.5, 1.0, (3, 3000))
    weight[2, 100:] = 0.0
    few = merged(
        PatchSamples(feet, samples.terms, height, weight, samples.noise), np.full(len(feet), SIDE)
    )
    assert few.weight.shape[1] <= 224 and np.count_nonzero(few.weight[2]) <= 100
    assert few.weight.sum(axis=1) == pytest.approx(weight.sum(axis=1))
    fitted = np.einsum("mt,tmn->mn", coefficients, few.terms)
    assert few.height[few.used] == pytest.approx(fitted[few.used], abs=1e-12)


def test_texture_is_learned_from_its_own_surfaces():
    """Medians of 12 patches; one patch of so few waves knows them within a factor of two, and
    the grids have steps of 2.2 and 2."""
    samples, _ = drawn(np.random.default_rng(9), 12, 160)
    residual_scale = learn_residual_scale(BASIS, samples, full(12, 1))
    assert AMPLITUDE / 2.5 < residual_scale.amplitude < 2.5 * AMPLITUDE
    assert LENGTH / 2.1 < residual_scale.length < 2.1 * LENGTH


def test_scaling_the_radius_scales_the_texture():
    samples, _ = drawn(np.random.default_rng(10), 2, 60)
    one, twice = (learn_residual_scale(BASIS, samples, full(2, radius)) for radius in (1.0, 2.0))
    assert twice.amplitude == pytest.approx(2.0 * one.amplitude, rel=1e-12)
    assert twice.length == pytest.approx(2.0 * one.length, rel=1e-12)
    rough = [
        residual_evidence(BASIS, samples, t, full(2, r)) for t, r in ((one, 1.0), (twice, 2.0))
    ]
    assert rough[0].gain == pytest.approx(rough[1].gain, rel=1e-9)


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 3.0, 10.0])
def test_quadrics_with_noise_get_no_residual(amplitude):
    """Of textures from below the noise to far above it: no more than one patch in forty."""
    rng = np.random.default_rng(11)
    feet = places(rng, 80, 120)
    samples = samples_at(feet, feet[..., 2] + NOISE * rng.normal(size=(80, 120)))
    found = residual_evidence(BASIS, samples, ResidualScale(amplitude * NOISE, LENGTH), full(80, 1))
    assert np.mean(found.needed) <= 0.025


def test_smooth_surfaces_teach_no_texture():
    rng = np.random.default_rng(12)
    feet = places(rng, 12, 120)
    samples = samples_at(feet, feet[..., 2] + NOISE * rng.normal(size=(12, 120)))
    assert learn_residual_scale(BASIS, samples, full(12, 1)).amplitude < 2.0 * NOISE


def test_bumps_finer_than_the_patch_get_a_residual():
    rng = np.random.default_rng(13)
    feet = places(rng, 8, 160)
    bumps = 5.0 * NOISE * np.sin(9.0 * feet[..., 0]) * np.cos(8.0 * feet[..., 1])
    exact = feet[..., 2] + bumps
    samples = samples_at(feet, exact + NOISE * rng.normal(size=exact.shape))
    residual_scale = learn_residual_scale(BASIS, samples, full(8, 1))
    found = residual_evidence(BASIS, samples, residual_scale, full(8, 1))
    assert found.needed.all()
    precision = coefficient_precision(BASIS, found.length_ratio, found.z_scale)
    with_residual, _, residual = solve_residual(
        samples, found.amplitude, full(8, residual_scale.length), precision
    )
    alone, _ = independent_equations(samples)
    trend, _ = posterior(alone.gram, alone.rhs, np.ones(8), precision)

    def error(mean, g=0.0):
        return np.sqrt(np.mean((np.einsum("mt,tmn->mn", mean, samples.terms) + g - exact) ** 2))

    assert error(with_residual, residual_at(residual, feet)[0]) < NOISE < 0.5 * error(trend)


@pytest.mark.parametrize("amplitude, length", [(-1.0, 1.0), (1.0, 0.0), (np.nan, 1.0)])
def test_texture_is_of_lengths(amplitude, length):
    with pytest.raises(ValueError, match="amplitude, length"):
        ResidualScale(amplitude, length)


def test_roughness_of_no_texture_is_refused():
    samples, _ = drawn(np.random.default_rng(14), 1, 30)
    with pytest.raises(ValueError, match="amplitude 0"):
        residual_evidence(BASIS, samples, ResidualScale(), full(1, 1))


def test_a_fine_texture_takes_more_samples_and_a_coarse_one_as_many():
    """Squares are a third of the length of the texture: a sixteenth to an eighth of a radius."""
    atlas = explored("torus").atlas
    table, rows = atlas.table, atlas.table.rows[:20]
    radius = float(table.radius[rows].max())

    def count(residual_scale):
        return np.count_nonzero(
            samples_of(table, atlas.membership, rows, residual_scale).used, axis=1
        )

    usual, long = count(None), count(ResidualScale(1.0, radius))
    assert (usual == long).all()
    fine, finest = (
        count(ResidualScale(1.0, 0.28 * radius)),
        count(ResidualScale(1.0, 1e-3 * radius)),
    )
    assert usual.sum() < fine.sum() < finest.sum()
