"""Tests of curves against each other: exact laws where nothing is wrong, and what they see."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest, norm

from tests.truths import graph_contours, quadric_height
from touchatlas.patch import Contour, SamplingPlane
from touchatlas.patch.fit.residual_tests import disagreement, excess_scatter, normal_deviate

NOISE, COUNT, CURVES = 1e-3, 15, 3
HEIGHT = quadric_height(-0.2, -0.4)


@pytest.mark.parametrize("freedom", [3, 6, 16, 50])
def test_a_chi_square_becomes_a_normal_number_of_the_same_probability(freedom):
    """Wilson and Hilferty's formula errs most for few degrees of freedom, far out: by 0.05."""
    for z in (0.0, 1.0, 2.0, 3.3):
        chi_square = chi2.isf(norm.sf(z), freedom)
        assert normal_deviate(chi_square, freedom) == pytest.approx(z, abs=0.06)


def fitted(rng, offset: float = 0.0):
    """Residuals, designs, places and covariance of random coefficients that are fitted with their
    own prior; the first curve is displaced from the others by an offset in noises."""
    place = np.linspace(-1.0, 1.0, COUNT)
    angles = np.pi / CURVES * np.arange(CURVES)
    x, y = np.outer(np.cos(angles), place).ravel(), np.outer(np.sin(angles), place).ravel()
    design = 20.0 * np.stack([x**0, x, y, x * x, x * y, y * y, x**3, x**2 * y, x * y**2, y**3]).T
    z = design @ rng.normal(size=10) + rng.normal(size=len(x))
    z[:COUNT] += offset
    covariance = np.linalg.inv(design.T @ design + np.eye(10))
    residual = z - design @ covariance @ design.T @ z
    curves = np.arange(CURVES)[:, None] * COUNT + np.arange(COUNT)
    return (
        [residual[i] for i in curves],
        [design[i] for i in curves],
        [place] * CURVES,
        covariance,
    )


def test_curves_of_one_surface_disagree_as_a_normal_number():
    """Kolmogorov and Smirnov's test of 300 fits; the seed is fixed, so that it always holds."""
    rng = np.random.default_rng(0)
    assert kstest([disagreement(*fitted(rng)) for _ in range(300)], "norm").pvalue > 0.01


def test_units_and_empty_curves_change_nothing():
    residuals, designs, places, covariance = fitted(np.random.default_rng(2), 3.0)
    one = disagreement(residuals, designs, places, covariance)
    far = [1e6 * place + 1e8 for place in places]
    assert disagreement(residuals, designs, far, covariance) == pytest.approx(one, rel=1e-5)
    empty = np.zeros(0), np.zeros((0, 10)), np.zeros(0)
    more = [[*old, new] for old, new in zip((residuals, designs, places), empty, strict=True)]
    assert disagreement(*more, covariance) == pytest.approx(one, rel=1e-12)
    assert disagreement([empty[0]], [empty[1]], [empty[2]], covariance) == 0.0


def touch(seed: int, noise: float = NOISE):
    return graph_contours(HEIGHT, 1.0, 19, noise, np.random.default_rng(seed))


def test_scatter_across_planes_is_that_of_the_noise():
    """The largest of three normal numbers: 3.3 is exceeded once in 700."""
    found = np.array([excess_scatter(touch(seed)) for seed in range(200)])
    assert (found > 3.3).mean() <= 0.01 and 0.5 < found.mean() < 1.2


def test_a_plane_that_is_stated_wrongly_and_points_put_on_planes_scatter_no_more():
    one, *others = touch(0)
    wrong = SamplingPlane(one.plane.point, np.array([0.0, 0.8, 0.6]))
    turned = Contour(one.points, wrong, one.noise_std, one.ends)
    assert excess_scatter((turned, *others)) == excess_scatter((one, *others))
    flat = Contour(one.points_in_plane, one.plane, one.noise_std, one.ends)
    assert excess_scatter((flat, *others)) < 3.3
    assert np.isfinite(excess_scatter(touch(0, noise=0.0)))
