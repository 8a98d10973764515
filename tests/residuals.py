"""Samples of saddles with a residual drawn from its own law, for the tests of residuals."""

import numpy as np

from touchatlas.atlas.residual.binned_samples import PatchSamples
from touchatlas.atlas.residual.gaussian_process import matern
from touchatlas.patch.fit.smoothness import coefficient_precision
from touchatlas.patch.geometry.polynomial import graded_basis, monomials

BASIS = graded_basis(4)


NOISE, AMPLITUDE, LENGTH = 1e-3, 8e-3, 0.35


def samples_at(feet, height, noise=NOISE):
    terms = monomials(BASIS, *np.moveaxis(feet, -1, 0))[: BASIS.size]
    shape = height.shape
    return PatchSamples(feet, terms, height, np.ones(shape), np.full(shape[0], noise))


def places_on_a_saddle(rng, m, n):
    """(m, n, 3) points of a saddle over the unit disc."""
    radius, angle = np.sqrt(rng.uniform(size=(m, n))), rng.uniform(0, 2 * np.pi, (m, n))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([x, y, 0.1 * x * x - 0.2 * y * y], axis=-1)


def prior_precision(m, length_ratio=0.5):
    return coefficient_precision(BASIS, np.full(m, length_ratio), np.full(m, 1.0))


def drawn(rng, m, n, noise=NOISE):
    """Samples of saddles with a residual drawn from its own law, and the heights without noise."""
    feet = places_on_a_saddle(rng, m, n)
    apart = np.linalg.norm(feet[:, :, None] - feet[:, None], axis=-1)
    covariance = AMPLITUDE**2 * matern(apart / LENGTH) + 1e-14 * np.eye(n)
    bumps = (np.linalg.cholesky(covariance) @ rng.normal(size=(m, n, 1)))[..., 0]
    exact = feet[..., 2] + bumps
    return samples_at(feet, exact + noise * rng.normal(size=(m, n)), noise), exact


def some_of(samples, columns):
    """Some samples of every patch."""
    return PatchSamples(
        *(samples.feet[:, columns], samples.terms[:, :, columns], samples.height[:, columns]),
        *(samples.weight[:, columns], samples.noise),
    )


def full(m, value):
    return np.full(m, float(value))
