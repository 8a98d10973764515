"""fit_patch: from contours around a reference point to a patch, the steps in order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch.choice import candidates_of, choose_terms
from touchatlas.patch.contour import Contour
from touchatlas.patch.darboux import (
    Solution,
    map_coefficients,
    raw_samples,
    reframed,
    solve_in_darboux_frame,
)
from touchatlas.patch.frame import DarbouxFrame
from touchatlas.patch.patch import Patch
from touchatlas.patch.polynomial import (
    Basis,
    LocalPolynomial,
    graded_basis,
    monge_basis,
)
from touchatlas.patch.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    coefficient_precision,
    leftover,
    log_evidence,
    log_prior,
    scaled_noise,
    smoothness_grid,
)
from touchatlas.patch.start import Stack, UnfitError, start_stack

# Chi-square a sample beyond which the noise is taken to be larger than stated.
_MISFIT = 1.3
# Turn and bend with which the first frame is found.
_FIRST_SMOOTHNESS = (np.array([0.5]), np.array([0.3]))
# And those for a patch that ran away with what the evidence chose.
_TAME_SMOOTHNESS = (np.array([0.5]), np.array([0.02]))
# Samples this much farther out than the patch reaches still help to fit it.
_FIT_REACH = 1.25
# The first choice of terms is doubtful when chi-square is this many deviations too large, or
# when what the degree leaves out at the rim is this many deviations of the noise.
_DOUBT, _DOUBTFUL_LEFTOVER = 3.0, 10.0
# Residuals over the radius, and over the noise, beyond which no terms fit.
_TORN, _TORN_NOISE = 3e-3, 3.0
_RADIUS_LEVELS = (0.8, 0.64, 0.5, 0.4)


@dataclass(frozen=True)
class FitOptions:
    """How a patch is fitted.

    Parameters
    ----------
    degree : int
        Of the polynomial; what is tried first when ``adaptive``.
    height_only : bool
        A Monge polynomial, without terms in z.
    adaptive : bool
        Where those terms do not hold, degree 2 to 6.
    core : float
        Share of its radius to which a patch claims to cover: its outline.
    """

    degree: int = 4
    height_only: bool = False
    adaptive: bool = True
    core: float = 0.75

    @property
    def basis(self) -> Basis:
        """The terms that are tried first."""
        return monge_basis(self.degree) if self.height_only else graded_basis(self.degree)


@dataclass(frozen=True, eq=False)
class PatchFit:
    """A patch, and what is needed to go on learning it.

    Parameters
    ----------
    patch : Patch
    equations : NormalEquations
        In coordinates scaled by the patch radius.
    turn, bend : float
        Of its smoothness prior.
    outliers : int
        Samples that were left out as bad contacts.
    """

    patch: Patch
    equations: NormalEquations
    turn: float
    bend: float
    outliers: int


def fit_patch(
    point,
    contours: tuple[Contour, ...],
    outward,
    shared: np.ndarray | None = None,
    bias: float = np.inf,
    radius_limit: float = np.inf,
    radius_floor: float = 0.0,
    prior: SmoothnessPrior = SmoothnessPrior(),
    options: FitOptions = FitOptions(),
) -> PatchFit:
    """Patch around a reference point from the contours tracked through it.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point, on or near every contour.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    shared : (n, 3) float, length, world, optional
        Further samples of the same sheet, of earlier contours or single contacts.
    bias : float, length
        Residuals beyond the noise that are borne before the radius is reduced.
    radius_limit : float, length
        The patch is made no larger than this.
    radius_floor : float, length
        Contours that end nearer than this, or residuals, make the patch no smaller.
    prior : SmoothnessPrior
    options : FitOptions

    Returns
    -------
    PatchFit

    Raises
    ------
    UnfitError
        Contours too short, too few, or in fewer than three directions.

    Notes
    -----
    The paper, section 2, up to its equation (1); then a maximum-a-posteriori polynomial of
    all orders in place of equation (5), in the frame that the polynomial itself defines.
    """
    stack = start_stack([point], [contours], [outward])
    stack = replace(stack, reach=np.clip(stack.reach, radius_floor, radius_limit))
    if shared is not None and len(shared):
        offsets = np.concatenate([stack.offsets, shared[None] - stack.origin[:, None]], axis=1)
        across = np.concatenate([stack.across, np.zeros((1, len(shared), 3))], axis=1)
        weight = np.concatenate([stack.weight, np.ones((1, len(shared)))], axis=1)
        stack = replace(stack, offsets=offsets, across=across, weight=weight)
    return _fit_stack(stack, bias, radius_floor, prior, options)[0]


def fit_patches(
    points,
    contour_sets: Sequence[tuple[Contour, ...]],
    outwards,
    prior: SmoothnessPrior = SmoothnessPrior(),
    options: FitOptions = FitOptions(),
) -> list[PatchFit]:
    """Many patches in one call: each what ``fit_patch`` finds, in a fraction of its time.

    Parameters
    ----------
    points : (m, 3) float, length, world
    contour_sets : m tuples of Contour
    outwards : (m, 3) float, world
    prior : SmoothnessPrior
    options : FitOptions

    Raises
    ------
    UnfitError
        As ``fit_patch`` does, when any of them cannot be fitted.
    """
    if not len(contour_sets):
        return []
    stack = start_stack(points, contour_sets, outwards)
    return _fit_stack(stack, np.inf, 0.0, prior, options)


def _fit_stack(stack: Stack, bias, floor, prior, options: FitOptions) -> list[PatchFit]:
    """All fits: together where the first choice of terms holds, else one by one."""
    basis = options.basis
    stack, mean, turn, bend, doubtful = _first_choice(stack, basis, bias, prior)
    again = _shrunk if np.isfinite(bias) else _with_terms_chosen
    if again is _with_terms_chosen:
        noise = scaled_noise(stack.noise, stack.reach)
        doubtful |= leftover(basis, turn) > _DOUBTFUL_LEFTOVER * noise
    found = {
        i: again(stack[[i]], mean[[i]], bias, floor, prior, options)
        for i in np.flatnonzero(doubtful).tolist()
    }
    good = np.flatnonzero(~doubtful)
    if len(good):
        fits = _solved(stack[good], basis, mean[good], turn[good], bend[good], options)
        found |= dict(zip(good.tolist(), fits, strict=True))
    return [found[i] for i in range(len(doubtful))]


def _first_choice(stack: Stack, basis: Basis, bias, prior):
    """The stack in a frame of a first polynomial; coefficients, turn and bend of highest
    evidence there; whether chi-square doubts them."""
    stack = _in_reach(stack)
    noise = scaled_noise(stack.noise, stack.reach)
    precision = coefficient_precision(basis, *_FIRST_SMOOTHNESS)
    mean = map_coefficients(raw_samples(stack).equations(basis, stack.weight), noise, precision)
    stack, samples = reframed(stack, basis, mean)
    stack = replace(stack, weight=stack.weight / samples.stretch)
    equations = samples.equations(basis, stack.weight)

    turns, bends, precisions = smoothness_grid(basis)
    believed = log_prior(prior, turns, stack.reach[:, None])
    evidence, chi_square = log_evidence(equations[:, None], noise[:, None], precisions)
    best = (evidence + believed).argmax(axis=1)
    chi_square = chi_square[np.arange(len(best)), best]
    misfit = chi_square / equations.count
    if misfit.max() > _MISFIT:
        # What no terms of this degree explain must not speak for any of them, and for those in
        # z least: detail so fine is no turning on.
        rough = misfit > _MISFIT
        spread = noise * np.sqrt(np.maximum(misfit, 1.0))
        evidence, _ = log_evidence(equations[:, None], spread[:, None], precisions)
        straight = np.where(rough[:, None] & (bends > bends.min()), -np.inf, 0.0)
        best = (evidence + believed + straight).argmax(axis=1)
    borne = (bias / (noise * stack.reach)) ** 2 if np.isfinite(bias) else 0.0
    limit = equations.count * (1.0 + borne) + _DOUBT * np.sqrt(2.0 * equations.count)
    doubtful = chi_square > limit
    mean = map_coefficients(equations, noise, precisions[best])
    return stack, mean, turns[best], bends[best], doubtful


def _in_reach(stack: Stack) -> Stack:
    """The stack without weight for samples out of reach."""
    square = np.einsum("mni,mni->mn", stack.offsets, stack.offsets)
    near = square <= (_FIT_REACH * stack.reach[:, None]) ** 2
    return replace(stack, weight=stack.weight * near)


def _shrunk(stack: Stack, _, bias, floor, prior, options: FitOptions) -> PatchFit:
    """One patch, made smaller until its terms hold, with a bias that is borne."""
    reach = stack.reach
    for share in _RADIUS_LEVELS:
        least = share == _RADIUS_LEVELS[-1] or share * reach[0] <= floor
        stack, mean, turn, bend, doubtful = _first_choice(
            replace(stack, reach=np.maximum(share * reach, min(floor, reach[0]))),
            options.basis,
            bias,
            prior,
        )
        if least or not doubtful[0]:
            break
    return _solved(stack, options.basis, mean, turn, bend, options)[0]


def _with_terms_chosen(stack: Stack, mean, bias, floor, prior, options) -> PatchFit:
    """One patch with the terms that evidence chooses, made smaller only where it would tear."""
    whole, basis, height_only = stack, options.basis, options.height_only
    for share in (*_RADIUS_LEVELS, None):
        candidates = candidates_of(height_only) if options.adaptive else (basis,)
        stack, samples = reframed(stack, basis, mean)
        noise, radius = float(scaled_noise(stack.noise, stack.reach)[0]), float(stack.reach[0])
        choice = choose_terms(
            samples.feet[0], samples.lift[0], stack.weight[0], noise, radius, prior, candidates
        )
        torn = choice.residual_rms > max(_TORN_NOISE * noise, _TORN)
        if not torn or share is None:
            break
        # Detail this fine is no turning on: terms in z could only swing.
        height_only, basis = True, monge_basis(options.degree)
        smaller = replace(whole, reach=share * whole.reach)
        stack, mean, *_ = _first_choice(smaller, basis, bias, prior)
    turn, bend = np.array([choice.turn]), np.array([choice.bend])
    stack = replace(stack, weight=choice.weight[None])
    fits = _solved(stack, choice.basis, choice.mean[None], turn, bend, options)
    return replace(fits[0], outliers=choice.outliers)


def _solved(stack: Stack, basis, mean, turn, bend, options: FitOptions) -> list[PatchFit]:
    """The patches in their Darboux frames; again, and nearly straight, where these ran away."""
    solution = solve_in_darboux_frame(stack, basis, mean, stack.weight, turn, bend)
    fits = _fits(solution, options)
    for i in np.flatnonzero(_ran_away(stack, solution.stack)).tolist():
        tame = solve_in_darboux_frame(
            *(stack[[i]], basis, 0.0 * mean[[i]], stack.weight[[i]], *_TAME_SMOOTHNESS)
        )
        if _ran_away(stack[[i]], tame.stack)[0]:
            raise UnfitError(
                "the contours bend too much for one patch; track shorter ones, or closer together"
            )
        fits[i] = _fits(tame, options)[0]
    return fits


def _ran_away(before: Stack, after: Stack) -> np.ndarray:
    """(m,) whether frames left what the first polynomial showed: by 60 degrees, or half R."""
    shift = after.origin - before.origin
    upright = np.einsum("mi,mi->m", before.axes[:, 2], after.axes[:, 2])
    # Not finite counts as gone.
    return ~((upright > 0.5) & ((shift * shift).sum(axis=1) < (0.5 * before.reach) ** 2))


def _fits(solution: Solution, options: FitOptions) -> list[PatchFit]:
    """The records of a solution."""
    stack, basis = solution.stack, solution.basis
    beyond = leftover(basis, solution.turn)
    return [
        PatchFit(
            Patch(
                -1,
                DarbouxFrame(stack.origin[i], stack.axes[i]),
                LocalPolynomial(basis, solution.mean[i], radius),
                solution.covariance[i],
                radius,
                options.core,
                float(stack.noise[i]),
                float(solution.residual[i] * radius),
                int(solution.equations.count[i]),
                float(stack.condition[i]),
                float(beyond[i]),
            ),
            solution.equations[i],
            float(solution.turn[i]),
            float(solution.bend[i]),
            0,
        )
        for i, radius in enumerate(stack.reach.tolist())
    ]
