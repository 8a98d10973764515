"""From samples to a polynomial: a first choice of smoothness, its test, and other choices."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch.fit.darboux_fit import Solution, diverged, solve_in_darboux_frame
from touchatlas.patch.fit.reframe import raw_system, reframed
from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    coefficient_precision,
    leftover,
    log_evidence,
    log_prior,
    map_coefficients,
    scaled_noise,
    smoothness_grid,
)
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.fit.term_choice import Choice, candidates_of, choose_terms
from touchatlas.patch.geometry.polynomial import Basis, monge_basis

# Largest distance of a sample in a fit, over the patch radius: samples just outside still help at
# the rim.
FIT_REACH = 1.25
# Radii that are tried one after the other, over the first radius: steps of 0.8.
_RADIUS_LEVELS = (0.8, 0.64, 0.5, 0.4)

# Length ratio and z scale of a height of moderate smoothness.
_HEIGHT = np.array([0.5]), np.array([0.02])
# What is said of a fit that diverges.
BENT = "the contours bend too much for one patch; track shorter ones, or closer together"


@dataclass(frozen=True, eq=False)
class Choices:
    """The first choice of smoothness for a stack.

    Parameters
    ----------
    stack : Stack
        In the frames of first polynomials. Weights are those of F^2.
    mean : (1, t) float
        Coefficients in these frames.
    length_ratio, z_scale : (1,) float
        Most probable values.
    doubtful : (1,) bool
        Whether a test rejects the choice.
    log_posterior : (1, g) float
        Of each point of the smoothness grid, up to a constant.
    """

    stack: Stack
    mean: np.ndarray
    length_ratio: np.ndarray
    z_scale: np.ndarray
    doubtful: np.ndarray
    log_posterior: np.ndarray


def first_choices(
    stack: Stack, basis: Basis, bias: float, prior: SmoothnessPrior, strict: bool = False
) -> Choices:
    """Most probable length ratio and z scale for given terms, and whether a test rejects them.

    Parameters
    ----------
    stack : Stack
    basis : Basis
    bias : float, length
        Model error that the test allows, standard deviation; infinite counts as none.
    prior : SmoothnessPrior
    strict : bool
        Whether the size of the orders above the degree is tested, too.

    Raises
    ------
    UnfitError
        No sample is within reach, or the reach is zero.
    """
    stack = _in_reach(stack)
    noise = scaled_noise(stack.noise, stack.reach)
    stack, equations = _in_first_frames(stack, basis, noise)
    length_ratios, z_scales, precisions = smoothness_grid(basis)
    log_posterior, chi_square = _log_posterior(equations, basis, noise, stack.reach, prior)
    best = log_posterior.argmax(axis=1)
    allowed = (bias / (noise * stack.reach)) ** 2 if np.isfinite(bias) else 0.0
    count = equations.count
    # One good fit in forty exceeds two standard deviations.
    doubtful = chi_square > count * (1.0 + allowed) + 2.0 * np.sqrt(2.0 * count)
    mean = map_coefficients(equations, noise, precisions[best])
    if strict:
        doubtful |= leftover(basis, length_ratios[best]) > 5.0 * noise
    return Choices(*(stack, mean, length_ratios[best], z_scales[best], doubtful, log_posterior))


def _in_reach(stack: Stack) -> Stack:
    """The stack with weight 0 for samples out of reach."""
    if not stack.reach.min() > 0.0:
        raise UnfitError("a contour ends at the reference point; track past it to both sides")
    square = np.einsum("mni,mni->mn", stack.offsets, stack.offsets)
    near = square <= (FIT_REACH * stack.reach[:, None]) ** 2
    stack = replace(stack, weight=stack.weight * near)
    if not stack.weight.any(axis=1).all():
        raise UnfitError("no sample lies within the patch radius; sample more finely or allow more")
    return stack


def _in_first_frames(stack: Stack, basis: Basis, noise) -> tuple[Stack, NormalEquations]:
    """The stack in the Darboux frames of first polynomials, and the normal equations there."""
    precision = coefficient_precision(basis, *_HEIGHT)
    raw, terms = raw_system(stack, basis)
    mean = map_coefficients(raw.equations(), noise, precision)
    stack, samples = reframed(stack, basis, mean, terms=terms)
    stack = replace(stack, weight=stack.weight / samples.squared_gradient)
    return stack, samples.system(basis, stack.weight).equations()


def _log_posterior(equations: NormalEquations, basis: Basis, noise, reach, prior):
    """Log posterior (1, g) over the smoothness grid, and chi-square (1,) where it is largest.

    Where chi-square is large, no terms of this degree explain the residuals. There the noise is
    enlarged to explain them, and terms in z are excluded: they would fit such fine detail.
    """
    length_ratios, z_scales, precisions = smoothness_grid(basis)
    density = log_prior(prior, length_ratios, reach[:, None])
    evidence, chi_square = log_evidence(equations[:, None], noise[:, None], precisions)
    found = evidence + density
    best = found.argmax(axis=1)
    chi_square = chi_square[np.arange(len(best)), best]
    per_sample = chi_square / equations.count
    if per_sample[0] > 1.3:
        # Noise is taken to be larger than stated.
        spread = noise * np.sqrt(per_sample)
        evidence, _ = log_evidence(equations[:, None], spread[:, None], precisions)
        heights_only = np.where(z_scales > z_scales.min(), -np.inf, 0.0)
        found = evidence + density + heights_only
    return found, chi_square


def solve_choices(choices: Choices, basis: Basis) -> Solution:
    """The polynomial in its Darboux frame; one that diverges is fitted again as a height.

    Raises
    ------
    UnfitError
        The height diverges, too.
    """
    stack, mean = choices.stack, choices.mean
    for length_ratio, z_scale in ((choices.length_ratio, choices.z_scale), _HEIGHT):
        solution = solve_in_darboux_frame(stack, basis, mean, stack.weight, length_ratio, z_scale)
        if not diverged(stack, solution.stack):
            return solution
        mean = 0.0 * mean
    raise UnfitError(BENT)


def shrunk(stack: Stack, basis: Basis, bias: float, floor: float, prior) -> Choices:
    """One patch, made smaller until the test accepts its terms, or to the floor (a length)."""
    reach = stack.reach
    for level in _RADIUS_LEVELS:
        smaller = np.maximum(level * reach, min(floor, reach[0]))
        choices = first_choices(replace(stack, reach=smaller), basis, bias, prior)
        if level * reach[0] <= floor or not choices.doubtful[0]:
            break
    return choices


def with_terms_chosen(
    choices: Choices, basis: Basis, prior: SmoothnessPrior, candidates: tuple[Basis, ...]
) -> tuple[Choices, Choice]:
    """The most probable terms of one patch, made smaller where its residuals are large.

    The choices are those of the basis in the second record.
    """
    whole = choices.stack
    for level in (*_RADIUS_LEVELS, None):
        chosen, choice = _chosen(choices, basis, prior, candidates)
        noise = float(scaled_noise(choices.stack.noise, choices.stack.reach)[0])
        # Residuals above three deviations of the noise and 3e-3 of the radius are explained by no
        # terms.
        large = choice.residual_rms > max(3.0 * noise, 3e-3)
        if not large or level is None:
            break
        # Terms in z would follow such fine detail, and oscillate between the curves.
        basis = monge_basis(basis.degree)
        candidates = candidates_of(True) if len(candidates) > 1 else (basis,)
        choices = first_choices(replace(whole, reach=level * whole.reach), basis, np.inf, prior)
    return chosen, choice


def _chosen(choices: Choices, basis: Basis, prior, candidates) -> tuple[Choices, Choice]:
    """The most probable of the candidates, as choices for the solver and as a record."""
    stack, samples = reframed(choices.stack, basis, choices.mean)
    noise, radius = float(scaled_noise(stack.noise, stack.reach)[0]), float(stack.reach[0])
    choice = choose_terms(
        samples.feet[0], samples.value[0], stack.weight[0], noise, radius, prior, candidates
    )
    stack = replace(stack, weight=choice.weight[None])
    chosen = replace(
        choices,
        stack=stack,
        mean=choice.mean[None],
        length_ratio=np.array([choice.length_ratio]),
        z_scale=np.array([choice.z_scale]),
    )
    return chosen, choice
