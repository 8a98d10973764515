"""Curves of different noise, curves that repeat samples, and probes that did not move."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import ORIGIN, UP, graph_contours, quadric_height
from touchatlas.patch import Contour, UnfitError, fit_patch

NOISE = 1e-3
HEIGHT = quadric_height(-0.2, -0.4, 0.3)


def touch(noise=NOISE, seed=0):
    return graph_contours(HEIGHT, 1.0, 19, noise, np.random.default_rng(seed))


def error(fit) -> float:
    x, y = 0.7 * np.random.default_rng(1).uniform(-0.7, 0.7, (2, 200))
    points = np.column_stack([x, y, HEIGHT(x, y)])
    return float(np.sqrt(np.mean(fit.patch.signed_distance(points) ** 2)))


def test_a_curve_of_thirty_times_the_noise_spoils_little():
    """Said to have it, it errs less than said to have that of the others, in the mean of ten."""
    weighed, alike = [], []
    for seed in range(10):
        noisy = touch(30.0 * NOISE, seed)[0]
        others = touch(NOISE, seed + 100)[1:]
        weighed.append(error(fit_patch(ORIGIN, (noisy, *others), UP)))
        alike.append(error(fit_patch(ORIGIN, (replace(noisy, noise_std=NOISE), *others), UP)))
    assert np.mean(weighed) < 0.5 * np.mean(alike)


def test_an_exact_curve_among_noisy_ones_is_followed():
    exact, others = touch(0.0)[0], touch(NOISE, 3)[1:]
    patch = fit_patch(ORIGIN, (exact, *others), UP).patch
    inner = exact.points[np.abs(exact.points[:, 0]) < 0.7]
    assert np.abs(patch.signed_distance(inner)).max() < 0.1 * NOISE


def test_a_sample_that_repeats_counts_once():
    contours = touch()
    twice = tuple(replace(c, points=np.repeat(c.points, 2, axis=0)) for c in contours)
    one, two = fit_patch(ORIGIN, contours, UP).patch, fit_patch(ORIGIN, twice, UP).patch
    assert two.count == one.count
    assert (two.polynomial.coefficients == one.polynomial.coefficients).all()


def test_a_probe_that_did_not_move_is_refused():
    one, *others = touch()
    still = NOISE * np.random.default_rng(5).normal(size=(19, 3))
    with pytest.raises(UnfitError, match="noise alone"):
        fit_patch(ORIGIN, (Contour(still, one.plane, NOISE, one.ends), *others), UP)
