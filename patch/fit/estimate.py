"""From a stack of samples to solved polynomials: first choice, doubts, and what is done then."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from touchatlas.patch.fit.darboux_fit import (
    Solution,
    joined,
    map_coefficients,
    raw_samples,
    reframed,
    solve_in_darboux_frame,
)
from touchatlas.patch.fit.smoothness import (
    SmoothnessPrior,
    coefficient_precision,
    leftover,
    log_evidence,
    log_prior,
    scaled_noise,
    smoothness_grid,
)
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.fit.term_choice import Choice, candidates_of, choose_terms
from touchatlas.patch.geometry.polynomial import Basis, monge_basis

# Chi-square a sample beyond which the noise is taken to be larger than stated.
_MISFIT = 1.3
# Turn and bend with which the first frame is found.
_FIRST_SMOOTHNESS = (np.array([0.5]), np.array([0.02]))
# And those for a patch that ran away with what the evidence chose.
_TAME_TURN, _TAME_BEND = 0.5, 0.02
# Samples this much farther out than the patch reaches still help to fit it.
_FIT_REACH = 1.25
# The first choice of terms is doubtful when chi-square is this many deviations too large, or
# when what the degree leaves out at the rim is this many deviations of the noise.
_DOUBT, _DOUBTFUL_LEFTOVER = 2.0, 5.0
# Residuals over the radius, and over the noise, beyond which no terms fit.
_TORN, _TORN_NOISE = 3e-3, 3.0
_RADIUS_LEVELS = (0.8, 0.64, 0.5, 0.4)


@dataclass(frozen=True, eq=False)
class Choices:
    """First choices for a stack of fits.

    Parameters
    ----------
    stack : Stack
        In the frames of first polynomials; weights are of the squares of F.
    mean : (m, t) float
        Coefficients there.
    length_ratio, z_scale : (m,) float
        Of highest evidence.
    doubtful : (m,) bool
        Whether chi-square speaks against them.
    """

    stack: Stack
    mean: np.ndarray
    length_ratio: np.ndarray
    z_scale: np.ndarray
    doubtful: np.ndarray

    def __getitem__(self, rows) -> "Choices":
        """Some of them."""
        return Choices(
            *(self.stack[rows], self.mean[rows], self.length_ratio[rows], self.z_scale[rows]),
            self.doubtful[rows],
        )


def first_choices(
    stack: Stack, basis: Basis, bias: float, prior: SmoothnessPrior, strict: bool = False
) -> Choices:
    """Turn and bend of highest evidence for terms that are given.

    Parameters
    ----------
    stack : Stack
    basis : Basis
    bias : float, length
        Residuals beyond the noise that are no ground for doubt; infinite for none.
    prior : SmoothnessPrior
    strict : bool
        What the degree leaves out is ground for doubt, too.

    Raises
    ------
    UnfitError
        When no sample is within reach, or the reach is zero.
    """
    if not stack.reach.min() > 0.0:
        raise UnfitError("a contour ends at the reference point; track past it to both sides")
    stack = _in_reach(stack)
    if not stack.weight.any(axis=1).all():
        raise UnfitError("no sample lies within the patch radius; sample more finely or allow more")
    noise = scaled_noise(stack.noise, stack.reach)
    precision = _first_precision(basis)
    raw = raw_samples(stack).system(basis, stack.weight).equations()
    mean = map_coefficients(raw, noise, precision)
    stack, samples = reframed(stack, basis, mean)
    stack = replace(stack, weight=stack.weight / samples.stretch)
    equations = samples.system(basis, stack.weight).equations()

    length_ratios, z_scales, precisions = smoothness_grid(basis)
    believed = log_prior(prior, length_ratios, stack.reach[:, None])
    evidence, chi_square = log_evidence(equations[:, None], noise[:, None], precisions)
    best = (evidence + believed).argmax(axis=1)
    chi_square = chi_square[np.arange(len(best)), best]
    misfit = chi_square / equations.count
    if misfit.max() > _MISFIT:
        # What no terms of this degree explain must not speak for any of them, and for those in
        # z least: detail so fine is no turning on.
        rough = misfit > _MISFIT
        spread = (noise * np.sqrt(misfit))[rough]
        evidence, _ = log_evidence(equations[rough][:, None], spread[:, None], precisions)
        straight = np.where(z_scales > z_scales.min(), -np.inf, 0.0)
        believed = np.broadcast_to(believed, (len(rough), len(length_ratios)))[rough]
        best[rough] = (evidence + believed + straight).argmax(axis=1)
    borne = (bias / (noise * stack.reach)) ** 2 if np.isfinite(bias) else 0.0
    limit = equations.count * (1.0 + borne) + _DOUBT * np.sqrt(2.0 * equations.count)
    doubtful = chi_square > limit
    mean = map_coefficients(equations, noise, precisions[best])
    if strict:
        doubtful |= leftover(basis, length_ratios[best]) > _DOUBTFUL_LEFTOVER * noise
    return Choices(stack, mean, length_ratios[best], z_scales[best], doubtful)


@lru_cache
def _first_precision(basis: Basis) -> np.ndarray:
    """(1, t) prior precision with which the first frame is found."""
    return coefficient_precision(basis, *_FIRST_SMOOTHNESS)


def _in_reach(stack: Stack) -> Stack:
    """The stack without weight for samples out of reach."""
    square = np.einsum("mni,mni->mn", stack.offsets, stack.offsets)
    near = square <= (_FIT_REACH * stack.reach[:, None]) ** 2
    return replace(stack, weight=stack.weight * near)


def solve_choices(choices: Choices, basis: Basis) -> Solution:
    """Polynomials in their Darboux frames; again, and nearly straight, where these ran away.

    Raises
    ------
    UnfitError
        When even the straight ones run away.
    """
    stack = choices.stack
    solution = solve_in_darboux_frame(
        stack, basis, choices.mean, stack.weight, choices.length_ratio, choices.z_scale
    )
    gone = _ran_away(stack, solution.stack)
    if not gone.any():
        return solution
    away, rest = np.flatnonzero(gone), np.flatnonzero(~gone)
    tame = solve_in_darboux_frame(
        *(stack[away], basis, 0.0 * choices.mean[away], stack.weight[away]),
        *(np.full(len(away), _TAME_TURN), np.full(len(away), _TAME_BEND)),
    )
    if _ran_away(stack[away], tame.stack).any():
        raise UnfitError(
            "the contours bend too much for one patch; track shorter ones, or closer together"
        )
    return joined([rest, away], [solution[rest], tame]) if len(rest) else tame


def _ran_away(before: Stack, after: Stack) -> np.ndarray:
    """(m,) whether frames left what the first polynomial showed: by 60 degrees, or half R."""
    shift = after.origin - before.origin
    upright = np.einsum("mi,mi->m", before.axes[:, 2], after.axes[:, 2])
    # Not finite counts as gone.
    return ~((upright > 0.5) & ((shift * shift).sum(axis=1) < (0.5 * before.reach) ** 2))


def shrunk(stack: Stack, basis: Basis, bias: float, floor: float, prior) -> Solution:
    """One patch, made smaller until its terms hold, with a bias that is borne."""
    reach = stack.reach
    for share in _RADIUS_LEVELS:
        smaller = np.maximum(share * reach, min(floor, reach[0]))
        choices = first_choices(replace(stack, reach=smaller), basis, bias, prior)
        if share * reach[0] <= floor or not choices.doubtful[0]:
            break
    return solve_choices(choices, basis)


def with_terms_chosen(
    choices: Choices, basis: Basis, prior: SmoothnessPrior, candidates: tuple[Basis, ...]
) -> tuple[Solution, int]:
    """One patch with the terms that evidence chooses, made smaller only where it would tear.

    Returns
    -------
    Solution
    outliers : int
        Samples that were left out.
    """
    whole = choices.stack
    for share in (*_RADIUS_LEVELS, None):
        chosen, choice = _chosen(choices, basis, prior, candidates)
        noise = float(scaled_noise(choices.stack.noise, choices.stack.reach)[0])
        torn = choice.residual_rms > max(_TORN_NOISE * noise, _TORN)
        if not torn or share is None:
            break
        # Detail this fine is no turning on: terms in z could only swing.
        basis = monge_basis(basis.degree)
        candidates = candidates_of(True) if len(candidates) > 1 else (basis,)
        choices = first_choices(replace(whole, reach=share * whole.reach), basis, np.inf, prior)
    return solve_choices(chosen, choice.basis), choice.outliers


def with_smoothness_chosen(choices: Choices, basis: Basis, prior: SmoothnessPrior) -> Solution:
    """One patch of given terms and radius, though these do not hold out to the rim: samples count
    the less, the more of them the degree leaves out."""
    return solve_choices(_chosen(choices, basis, prior, (basis,))[0], basis)


def _chosen(choices: Choices, basis: Basis, prior, candidates) -> tuple[Choices, Choice]:
    stack, samples = reframed(choices.stack, basis, choices.mean)
    noise, radius = float(scaled_noise(stack.noise, stack.reach)[0]), float(stack.reach[0])
    choice = choose_terms(
        samples.feet[0], samples.lift[0], stack.weight[0], noise, radius, prior, candidates
    )
    stack = replace(stack, weight=choice.weight[None])
    length_ratio, z_scale = np.array([choice.length_ratio]), np.array([choice.z_scale])
    return Choices(stack, choice.mean[None], length_ratio, z_scale, choices.doubtful), choice
