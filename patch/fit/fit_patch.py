"""fit_patch: from contours around a reference point to a patch, the steps in order."""

from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.patch.fit.darboux_fit import Solution
from touchatlas.patch.fit.estimate import (
    Choices,
    first_choices,
    shrunk,
    solve_choices,
    with_terms_chosen,
)
from touchatlas.patch.fit.smoothness import NormalEquations, SmoothnessPrior, leftover
from touchatlas.patch.fit.start import Stack, UnfitError, start_stack
from touchatlas.patch.fit.term_choice import candidates_of
from touchatlas.patch.geometry.arrays import frozen_array, real
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import Basis, LocalPolynomial, graded_basis, monge_basis

# Share of the bias that is borne that counts as noise.
BORNE = 0.25
# The number of terms, 251 of this degree, grows with its cube, and time with the square of that:
# a touch takes 100 times as long as of degree 4.
_MOST_DEGREE = 12


@dataclass(frozen=True)
class FitOptions:
    """How a patch is fitted.

    Parameters
    ----------
    degree : int
        Of the polynomial, 2 to 12; what is tried first when ``adaptive``.
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

    def __post_init__(self) -> None:
        whole = isinstance(self.degree, int | np.integer)
        if not (whole and 2 <= self.degree <= _MOST_DEGREE and 0 < real(self.core) <= 1):
            raise ValueError(
                f"degree, core are {self.degree}, {self.core}; they must be an integer >= 2, "
                f"{_MOST_DEGREE} at most, and a share in (0, 1]"
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
    """A patch, and what is needed to go on learning it.

    Parameters
    ----------
    patch : Patch
    equations : NormalEquations
        In coordinates scaled by the patch radius.
    length_ratio, z_scale : float
        Of its smoothness prior.
    outliers : int
        Samples that were left out as bad contacts.
    """

    patch: Patch
    equations: NormalEquations
    length_ratio: float
    z_scale: float
    outliers: int


@contextmanager
def unsolvable_is_unfit():
    """Linear systems that cannot be solved, as of a polynomial that ran away, are UnfitErrors."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise UnfitError(
            "the contours bend too much for one patch; track shorter ones, or closer together"
        ) from error


def _check_lengths(bias: float, detail: float, radius_limit: float, radius_floor: float) -> None:
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
        Reference point, on or near every contour.
    contours : tuple of Contour
        Three or more in distinct directions.
    outward : (3,) float, world
        Any vector on the outer side.
    shared : (n, 3) float, length, world, optional
        Further samples of the same sheet, of earlier contours or single contacts.
    bias : float, length
        Residuals beyond the noise that are borne as if they were noise.
    detail : float, length
        Residuals beyond the noise that something else will explain: where ``bias`` is not enough
        they count as noise, up to this, before the radius is reduced.
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
    ValueError
        Any other argument not finite, of a wrong shape or sign, or ``outward`` tangent.

    Notes
    -----
    The paper, section 2, up to its equation (1); then a maximum-a-posteriori polynomial of
    all orders in place of equation (5), in the frame that the polynomial itself defines.
    """
    _check_lengths(bias, detail, radius_limit, radius_floor)
    stack = start_stack([point], [contours], [outward])
    reach = min(max(float(stack.reach[0]), radius_floor), radius_limit)
    if reach != stack.reach[0]:
        stack = replace(stack, reach=np.array([reach]))
    if shared is not None and len(shared):
        stack = _with_shared(stack, frozen_array(shared, (None, 3), "shared samples"))
    tolerant = bool(np.isfinite(bias))
    if tolerant:
        # Lack of fit that is borne is noise to the fit: exact data would else swing it between.
        stack = replace(stack, noise=np.hypot(stack.noise, BORNE * bias))
    choices = first_choices(stack, options.basis, bias, prior, strict=not tolerant)
    if not choices.doubtful[0]:
        return records(solve_choices(choices, options.basis), options)[0]
    cleaned = tuple(without_bad_contacts(c) for c in contours)
    bad = sum(len(c.points) for c in contours) - sum(len(c.points) for c in cleaned)
    if bad:
        again = fit_patch(
            *(point, cleaned, outward, shared, bias, detail, radius_limit, radius_floor),
            *(prior, options),
        )
        return replace(again, outliers=again.outliers + bad)
    if tolerant and detail > bias:
        # Detail that something else explains is noise to the polynomial: it must not follow it.
        stack = replace(stack, noise=np.hypot(stack.noise, detail))
        choices = first_choices(stack, options.basis, detail, prior)
        if not choices.doubtful[0]:
            return records(solve_choices(choices, options.basis), options)[0]
        bias = detail
    if tolerant:
        return records(shrunk(stack, options.basis, bias, radius_floor, prior), options)[0]
    return _with_terms_chosen(choices, prior, options)


def _with_shared(stack: Stack, shared) -> Stack:
    """A stack of one with further samples (n, 3), of no plane."""
    offsets = np.concatenate([stack.offsets, shared[None] - stack.origin[:, None]], axis=1)
    across = np.concatenate([stack.across, np.zeros((1, len(shared), 3))], axis=1)
    weight = np.concatenate([stack.weight, np.ones((1, len(shared)))], axis=1)
    return replace(stack, offsets=offsets, across=across, weight=weight)


def _with_terms_chosen(choices: Choices, prior, options: FitOptions) -> PatchFit:
    basis = options.basis
    candidates = candidates_of(options.height_only) if options.adaptive else (basis,)
    solution, outliers = with_terms_chosen(choices, basis, prior, candidates)
    return replace(records(solution, options)[0], outliers=outliers)


@unsolvable_is_unfit()
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
    choices = first_choices(stack, options.basis, np.inf, prior, strict=True)
    found = {
        i: fit_patch(points[i], contour_sets[i], outwards[i], prior=prior, options=options)
        for i in np.flatnonzero(choices.doubtful).tolist()
    }
    good = np.flatnonzero(~choices.doubtful)
    if len(good):
        fits = records(solve_choices(choices[good], options.basis), options)
        found |= dict(zip(good.tolist(), fits, strict=True))
    return [found[i] for i in range(len(stack.reach))]


def records(solution: Solution, options: FitOptions) -> list[PatchFit]:
    """The records of a solution."""
    stack, basis = solution.stack, solution.basis
    beyond = leftover(basis, solution.length_ratio)
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
            float(solution.length_ratio[i]),
            float(solution.z_scale[i]),
            0,
        )
        for i, radius in enumerate(stack.reach.tolist())
    ]
