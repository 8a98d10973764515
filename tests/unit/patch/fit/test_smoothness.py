"""The smoothness prior, and what it adds where sections determine nothing."""

import numpy as np
import pytest
from scipy.linalg import eigh, subspace_angles

from tests.laws.patch_scenes import LENGTH, WavyGraph, contours_of, even_angles
from tests.truths import UP
from touchatlas.patch import PatchFit, fit_patch
from touchatlas.patch.fit.smoothness import SmoothnessPrior, coefficient_precision
from touchatlas.patch.geometry.polynomial import Z, evaluate, monge_basis, monomials


@pytest.mark.parametrize(("mean", "std"), [(0, 0), (0, -1), (0, np.nan), (np.nan, 1), (np.inf, 1)])
def test_a_prior_that_is_no_distribution_is_refused(mean, std):
    with pytest.raises(ValueError, match="log_std"):
        SmoothnessPrior(mean, std)


def line_products(angles, basis) -> np.ndarray:
    """(15, f) coefficients of l1 l2 ... lm times every monomial that keeps degree 4."""
    x, y = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 100))
    product = np.prod([np.cos(a) * y - np.sin(a) * x for a in angles], axis=0)
    if len(angles) > 4:
        return np.zeros((basis.size, 0))
    factors = monomials(monge_basis(4 - len(angles)), x, y, 0.0 * x)
    return np.linalg.lstsq(monomials(basis, x, y, 0.0 * x).T, (product * factors).T, rcond=None)[0]


@pytest.mark.parametrize(("sections", "unknown"), [(3, 3), (4, 1), (5, 0)])
def test_concurrent_sections_are_blind_to_products_of_their_lines_alone(sections, unknown):
    angles, basis, s = even_angles(sections), monge_basis(4), np.linspace(-1.0, 1.0, 41)
    x, y = np.outer(np.cos(angles), s).ravel(), np.outer(np.sin(angles), s).ravel()
    design = monomials(basis, x, y, 0.0 * x).T
    singular = np.linalg.svd(design, compute_uv=False)
    # Rounding on one side of the gap, a fraction of the largest one on the other.
    assert (singular < 1e-12 * singular[0]).sum() == unknown
    assert (singular > 1e-2 * singular[0]).sum() == basis.size - unknown
    products = line_products(angles, basis)
    assert np.linalg.matrix_rank(products) == products.shape[1] == unknown
    assert np.abs(design @ products).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
@pytest.mark.parametrize(("sections", "unknown"), [(3, 3), (4, 1), (5, 0)])
def test_deviation_is_large_along_what_sections_do_not_see_and_nowhere_else(
    sections, unknown, seed
):
    """Contacts without noise determine all that sections see. In C P^-1, the covariance after the
    data over the prior's, a direction w that sections do not see has eigenvalue 1, because
    C^-1 = P^-1 + (the information of the data)."""
    fit = fit_patch(np.zeros(3), contours_of(WavyGraph(seed), 0.8 * LENGTH, sections), UP)
    after, before = heights_covariance(fit)
    ratios, vectors = eigh(after, before)
    # In between is nothing. A ratio far below one: terms in z tie what is blind to what is seen.
    assert (ratios > 0.1).sum() == unknown and (ratios < 0.01).sum() == len(ratios) - unknown
    lines = [np.cos(even_angles(sections)), np.sin(even_angles(sections)), np.zeros(sections)]
    x, y, _ = fit.patch.frame.axes @ lines
    products = line_products(np.arctan2(y, x), monge_basis(4))
    blind = before @ vectors[:, ratios > 0.1]
    # An angle of what orders above 4 leave in the Taylor coefficients.
    assert unknown == 0 or subspace_angles(blind, products).max() < 0.02


def heights_covariance(fit: PatchFit):
    """Covariances (15, 15), after and before the data, of the coefficients up to degree 4 of the
    height that solves z = phi(x, y, z): terms in z repeat those without, so the surface may be
    known where its terms are not.

    A change dc of the terms raises the height by dc . terms / (1 - phi_z); its Taylor
    coefficients are of a fit of degree 8 over a small disc.
    """
    basis, coefficients = fit.patch.polynomial.basis, fit.patch.polynomial.coefficients
    x, y = 0.2 * np.random.default_rng(0).uniform(-1.0, 1.0, (2, 400))
    z = fit.patch.polynomial.height(fit.patch.radius * np.column_stack([x, y])) / fit.patch.radius
    upright = 1.0 - evaluate(basis, coefficients, x, y, z, (Z,))[0]
    raised = (monomials(basis, x, y, z)[: basis.size] / upright).T
    taylor = np.linalg.lstsq(monomials(monge_basis(8), x, y, z).T, raised, rcond=None)[0][:15]
    prior = np.diag(1.0 / coefficient_precision(basis, fit.length_ratio, fit.z_scale))
    return taylor @ fit.patch.covariance @ taylor.T, taylor @ prior @ taylor.T
