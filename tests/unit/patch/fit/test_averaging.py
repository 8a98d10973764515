"""What is not known of the smoothness widens what no sample determines, and nothing else."""

import numpy as np
import pytest

from tests.truths import graph_contours, quadric_height
from touchatlas.patch.fit.angular_waves import waves
from touchatlas.patch.fit.averaging import averaged
from touchatlas.patch.fit.estimate import first_choices, solve_choices
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    smoothness_grid,
)
from touchatlas.patch.fit.start import start_stack
from touchatlas.patch.geometry.polynomial import graded_basis, monomials

UP, BASIS = np.array([0.0, 0.0, 1.0]), graded_basis(4)


@pytest.fixture(scope="module")
def solved():
    contours = graph_contours(quadric_height(-0.2, -0.4), 1.0, 19, 1e-3, np.random.default_rng(0))
    choices = first_choices(
        start_stack(np.zeros(3), contours, UP), BASIS, np.inf, SmoothnessPrior()
    )
    return choices, solve_choices(choices, BASIS)


def test_one_certain_smoothness_adds_no_more_than_student_s_t(solved):
    """With two degrees of freedom and nothing seen: their 97.5 % quantile is 4.303."""
    choices, solution = solved
    certain = np.where(choices.log_posterior == choices.log_posterior.max(), 0.0, -np.inf)
    wider = averaged(solution, certain, smoothness_grid(BASIS)[2])
    added, rows = (wider.covariance - solution.covariance)[0], waves(BASIS)[1]
    precision = coefficient_precision(BASIS, solution.length_ratio, solution.z_scale)[0]
    most = ((4.303 / 1.960) ** 2 - 1.0) * rows**2 @ (1.0 / precision)
    assert (np.einsum("wi,ij,wj->w", rows, added, rows) <= most).all()


def test_slopes_and_curvatures_keep_their_covariance(solved):
    choices, solution = solved
    wider = averaged(solution, choices.log_posterior, smoothness_grid(BASIS)[2])
    assert (wider.covariance[0, :6, :6] == solution.covariance[0, :6, :6]).all()


def test_the_curves_stay_known_and_the_places_between_become_less_sure(solved):
    """At the samples of a contour the variance grows by less than a twentieth of the noise's; at
    the rim it grows by a fifth and more of what it was."""
    choices, solution = solved
    wider = averaged(solution, choices.log_posterior, smoothness_grid(BASIS)[2])
    added = (wider.covariance - solution.covariance)[0]
    seen = solution.stack.scaled()[0]
    seen = seen[(seen**2).sum(axis=1) < 0.75**2]
    noise = float(solution.stack.noise[0] / solution.stack.reach[0])
    terms = monomials(BASIS, *seen.T)[: BASIS.size]
    assert np.max((terms * (added @ terms)).sum(axis=0)) < 0.05 * noise**2
    angle = np.linspace(0.0, np.pi, 60)
    rim = monomials(BASIS, 0.75 * np.cos(angle), 0.75 * np.sin(angle), 0.0 * angle)[: BASIS.size]
    before = (rim * (solution.covariance[0] @ rim)).sum(axis=0)
    assert np.max((rim * (added @ rim)).sum(axis=0) / before) > 0.2
