"""fit_patch: the most probable patch, given contours through a reference point."""

from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch.fit.averaging import averaged, averaged_again
from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.patch.fit.darboux_fit import Solution
from touchatlas.patch.fit.estimate import (
    BENT,
    Choices,
    first_choices,
    shrunk,
    solve_choices,
    with_terms_chosen,
)
from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    SmoothnessPrior,
    leftover,
    smoothness_grid,
)
from touchatlas.patch.fit.start import Stack, UnfitError, start_stack
from touchatlas.patch.fit.term_choice import DEGREES, candidates_of
from touchatlas.patch.geometry.arrays import frozen_array, real
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import Basis, LocalPolynomial, graded_basis, monge_basis


@dataclass(frozen=True)
class FitOptions:
    """How a patch is fitted.

    Parameters
    ----------
    degree : int
        Degree of the polynomial, 2 to 6. It is the first one that is tried when ``adaptive``.
    height_only : bool
        Whether the polynomial is a height, without terms in z.
    adaptive : bool
        Whether the evidence chooses among degrees 2 to 6 where the first one is doubtful.
    core : float
        Fraction of its radius within which a patch covers the surface.
    """

    degree: int = 4
    height_only: bool = False
    adaptive: bool = True
    core: float = 0.75

    def __post_init__(self) -> None:
        whole = isinstance(self.degree, int | np.integer)
        if not (whole and self.degree in DEGREES and 0 < real(self.core) <= 1):
            raise ValueError(
                f"degree, core are {self.degree}, {self.core}; they must be an integer from "
                f"{DEGREES[0]} to {DEGREES[-1]} and a fraction in (0, 1], as 4 and 0.75 are"
            )
        if not all(isinstance(x, bool | np.bool_) for x in (self.height_only, self.adaptive)):
            raise ValueError(
                f"height_only, adaptive are {self.height_only!r}, {self.adaptive!r}; they must be "
                "True or False"
            )

    @property
    def basis(self) -> Basis:
        """The terms that are tried first."""
        return monge_basis(self.degree) if self.height_only else graded_basis(self.degree)


@dataclass(frozen=True, eq=False)
class PatchFit:
    """A patch, with what later samples need to update it.

    Parameters
    ----------
    patch : Patch
    equations : NormalEquations
        In coordinates scaled by the patch radius.
    length_ratio, z_scale : float
        Parameters of its smoothness prior.
    outliers : int
        Number of samples that were left out as bad contacts.
    """

    patch: Patch
    equations: NormalEquations
    length_ratio: float
    z_scale: float
    outliers: int


@contextmanager
def unsolvable_is_unfit():
    """Raise UnfitError where a linear system has no solution, as in a diverged fit."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise UnfitError(BENT) from error


def _check_lengths(bias: float, detail: float, radius_limit: float, radius_floor: float) -> None:
    """ValueError for a length that has a wrong sign or is NaN."""
    if not (bias >= 0 and detail >= 0 and radius_limit > 0 and 0 <= radius_floor < np.inf):
        raise ValueError(
            f"bias, detail, radius_limit, radius_floor are {bias}, {detail}, {radius_limit}, "
            f"{radius_floor}; they must be lengths >= 0, >= 0, > 0, and >= 0 and finite"
        )


@unsolvable_is_unfit()
def fit_patch(
    point,
    contours: tuple[Contour, ...],
    outward,
    shared: np.ndarray | None = None,
    bias: float = np.inf,
    detail: float = 0.0,
    radius_limit: float = np.inf,
    radius_floor: float = 0.0,
    prior: SmoothnessPrior = SmoothnessPrior(),
    options: FitOptions = FitOptions(),
) -> PatchFit:
    """Patch around a reference point from the contours tracked through it.

    Parameters
    ----------
    point : (3,) float, length, world
        Reference point on or near every contour.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    shared : (n, 3) float, length, world, optional
        Further samples of the same surface sheet, from earlier contours or single contacts.
    bias : float, length
        Allowed model error, standard deviation. If it is finite, the radius is reduced until the
        residuals are explained by noise and bias. If it is infinite, terms are chosen instead.
    detail : float, length
        Standard deviation of detail that the caller models apart. If ``bias`` does not explain the
        residuals but detail does, it counts as noise and the radius is kept.
    radius_limit : float, length
        Largest radius of the patch.
    radius_floor : float, length
        Radius below which neither short contours nor residuals reduce the patch.
    prior : SmoothnessPrior
    options : FitOptions

    Returns
    -------
    PatchFit

    Raises
    ------
    UnfitError
        Contours too short, too few, or in fewer than three directions.
    ValueError
        Another argument is not finite or of a wrong type, shape or sign, or ``outward`` is tangent.

    Notes
    -----
    The paper, section 2, up to its equation (1). Then a maximum-a-posteriori polynomial of all
    orders takes the place of equation (5), in the frame that the polynomial itself defines.
    """
    _check_lengths(bias, detail, radius_limit, radius_floor)
    if not (isinstance(prior, SmoothnessPrior) and isinstance(options, FitOptions)):
        got = f"{type(prior).__name__} and {type(options).__name__}"
        raise ValueError(f"got {got}; give a SmoothnessPrior and FitOptions, or leave both out")
    stack = start_stack(point, contours, outward)
    reach = min(max(float(stack.reach[0]), radius_floor), radius_limit)
    stack = replace(stack, reach=np.array([reach]))
    if shared is not None and len(shared):
        stack = _with_shared(stack, frozen_array(shared, (None, 3), "shared samples"))
    has_bias = bool(np.isfinite(bias))
    if has_bias:
        # Exact samples with a model error would make the fit oscillate between the curves.
        stack = replace(stack, noise=np.hypot(stack.noise, 0.25 * bias))
    choices = first_choices(stack, options.basis, bias, prior, strict=not has_bias)
    if not choices.doubtful[0]:
        return _solved(choices, options.basis, options)
    cleaned = tuple(without_bad_contacts(c) for c in contours)
    bad = sum(len(c.points) for c in contours) - sum(len(c.points) for c in cleaned)
    if bad:
        again = fit_patch(
            *(point, cleaned, outward, shared, bias, detail, radius_limit, radius_floor),
            *(prior, options),
        )
        return replace(again, outliers=again.outliers + bad)
    if has_bias:
        return _within_bias(stack, bias, detail, radius_floor, prior, options)
    return _with_terms_chosen(choices, prior, options)


def _with_shared(stack: Stack, shared) -> Stack:
    """A stack of one fit with further samples (n, 3) of no plane."""
    offsets = np.concatenate([stack.offsets, shared[None] - stack.origin[:, None]], axis=1)
    across = np.concatenate([stack.across, np.zeros((1, len(shared), 3))], axis=1)
    weight = np.concatenate([stack.weight, np.ones((1, len(shared)))], axis=1)
    return replace(stack, offsets=offsets, across=across, weight=weight)


def _within_bias(stack: Stack, bias, detail, radius_floor, prior, options) -> PatchFit:
    """The patch whose residuals are noise, bias or detail, made smaller if necessary."""
    if detail > bias:
        # Detail counts as noise, so that the polynomial does not follow it.
        stack, bias = replace(stack, noise=np.hypot(stack.noise, detail)), detail
        choices = first_choices(stack, options.basis, bias, prior)
        if not choices.doubtful[0]:
            return _solved(choices, options.basis, options)
    choices = shrunk(stack, options.basis, bias, radius_floor, prior)
    return _solved(choices, options.basis, options)


def _with_terms_chosen(choices: Choices, prior, options: FitOptions) -> PatchFit:
    """The patch with the most probable terms, and the number of its outliers."""
    basis = options.basis
    candidates = candidates_of(options.height_only) if options.adaptive else (basis,)
    choices, choice = with_terms_chosen(choices, basis, prior, candidates)
    solution = averaged_again(solve_choices(choices, choice.basis), prior)
    return replace(_patch_fit(solution, options), outliers=choice.outliers)


def _solved(choices: Choices, basis: Basis, options: FitOptions) -> PatchFit:
    """The patch of one fit's choices."""
    precisions = smoothness_grid(basis)[2]
    solution = averaged(solve_choices(choices, basis), choices.log_posterior, precisions)
    return _patch_fit(solution, options)


def _patch_fit(solution: Solution, options: FitOptions) -> PatchFit:
    """The patch of the solution of one fit."""
    stack, basis = solution.stack, solution.basis
    radius = float(stack.reach[0])
    return PatchFit(
        Patch(
            -1,
            DarbouxFrame(stack.origin[0], stack.axes[0]),
            LocalPolynomial(basis, solution.mean[0], radius),
            solution.covariance[0],
            radius,
            options.core,
            float(stack.noise[0]),
            float(solution.residual[0] * radius),
            int(solution.equations.count[0]),
            float(stack.condition[0]),
            float(leftover(basis, solution.length_ratio)[0]),
        ),
        solution.equations[0],
        float(solution.length_ratio[0]),
        float(solution.z_scale[0]),
        0,
    )
