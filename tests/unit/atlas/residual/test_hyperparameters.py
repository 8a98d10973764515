"""Amplitude and correlation length of residuals, on surfaces drawn with known ones."""

import numpy as np
import pytest

from tests.residuals import (
    AMPLITUDE,
    BASIS,
    LENGTH,
    NOISE,
    drawn,
    full,
    places_on_a_saddle,
    samples_at,
)
from touchatlas.atlas.residual.gaussian_process import (
    residual_at,
    solve_residual,
)
from touchatlas.atlas.residual.hyperparameters import (
    ResidualScale,
    independent_equations,
    learn_residual_scale,
    residual_evidence,
)
from touchatlas.patch.fit.smoothness import coefficient_precision, posterior


def test_residual_scale_is_learned_from_surfaces_drawn_with_it():
    """Medians of 12 patches; one patch holds so few correlation lengths that it knows them within
    a factor of two, and the grids have steps of 2.2 and 2."""
    samples, _ = drawn(np.random.default_rng(9), 12, 160)
    residual_scale = learn_residual_scale(BASIS, samples, full(12, 1))
    assert AMPLITUDE / 2.5 < residual_scale.amplitude < 2.5 * AMPLITUDE
    assert LENGTH / 2.1 < residual_scale.length < 2.1 * LENGTH


def test_scaling_the_radius_scales_amplitude_and_length():
    samples, _ = drawn(np.random.default_rng(10), 2, 60)
    one, twice = (learn_residual_scale(BASIS, samples, full(2, radius)) for radius in (1.0, 2.0))
    assert twice.amplitude == pytest.approx(2.0 * one.amplitude, rel=1e-12)
    assert twice.length == pytest.approx(2.0 * one.length, rel=1e-12)
    evidence = [
        residual_evidence(BASIS, samples, t, full(2, r)) for t, r in ((one, 1.0), (twice, 2.0))
    ]
    assert evidence[0].gain == pytest.approx(evidence[1].gain, rel=1e-9)


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 3.0, 10.0])
def test_quadrics_with_noise_get_no_residual(amplitude):
    """For amplitudes from below the noise to far above it: no more than one patch in forty."""
    rng = np.random.default_rng(11)
    feet = places_on_a_saddle(rng, 80, 120)
    samples = samples_at(feet, feet[..., 2] + NOISE * rng.normal(size=(80, 120)))
    found = residual_evidence(BASIS, samples, ResidualScale(amplitude * NOISE, LENGTH), full(80, 1))
    assert np.mean(found.needed) <= 0.025


def test_smooth_surfaces_give_no_amplitude_above_the_noise():
    rng = np.random.default_rng(12)
    feet = places_on_a_saddle(rng, 12, 120)
    samples = samples_at(feet, feet[..., 2] + NOISE * rng.normal(size=(12, 120)))
    assert learn_residual_scale(BASIS, samples, full(12, 1)).amplitude < 2.0 * NOISE


def test_bumps_finer_than_the_patch_get_a_residual():
    rng = np.random.default_rng(13)
    feet = places_on_a_saddle(rng, 8, 160)
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
def test_residual_scale_is_of_lengths(amplitude, length):
    with pytest.raises(ValueError, match="amplitude, length"):
        ResidualScale(amplitude, length)


def test_evidence_of_no_residual_scale_is_refused():
    samples, _ = drawn(np.random.default_rng(14), 1, 30)
    with pytest.raises(ValueError, match="amplitude 0"):
        residual_evidence(BASIS, samples, ResidualScale(), full(1, 1))
