"""refit_patch: the patch of samples of one surface sheet, from an approximate frame."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.fit.estimate import (
    BENT,
    first_choices,
    shrunk,
    solve_choices,
    solved,
    with_smoothness_chosen,
)
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, patch_fits, unsolvable_is_unfit
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.polynomial import Basis

_UNFIT = "no one polynomial holds the samples; make the patch smaller"
# Samples per coefficient in a first test. Doubled, it takes twice as long and finds misfits 0.8
# times as large.
_SAMPLES_PER_COEFFICIENT = 10
# Model error that the first test allows, in deviations of the noise: it adds 2.6
# deviations to the limit of chi-square for 210 samples. Doubled, misfits of one deviation are left
# to the full test.
_TEST_BIAS = 0.5


@unsolvable_is_unfit()
def refit_patch(
    frame: DarbouxFrame,
    points,
    across,
    noise_std: float,
    radius: float,
    bias: float,
    radius_floor: float | None,
    prior: SmoothnessPrior = SmoothnessPrior(),
    options: FitOptions = FitOptions(),
    condition: float = 1.0,
) -> PatchFit:
    """Patch from samples of one surface sheet, in the Darboux frame that they define.

    Parameters
    ----------
    frame : DarbouxFrame
        Approximate frame: near the surface, with a normal within 45 degrees of the surface's.
    points : (n, 3) float, length, world
    across : (n, 3) float, unit, world
        Normal of the plane that each sample was tracked in. It is zero for a sample of no plane.
    noise_std, radius : float, length
    bias : float, length
        Allowed model error, standard deviation. The radius is reduced where residuals are larger.
    radius_floor : float, length, or None
        Radius below which residuals do not reduce the patch. If it equals ``radius``, samples that
        the degree does not explain have less weight instead. None refuses such samples.
    prior : SmoothnessPrior
    options : FitOptions
    condition : float
        Condition number of the sections, stored in the patch.

    Raises
    ------
    UnfitError
        No sample is within reach, or no one polynomial explains the samples.
    """
    stack = Stack(
        frame.origin[None],
        frame.axes[None],
        (points - frame.origin)[None],
        across[None],
        np.ones((1, len(points))),
        np.array([radius]),
        np.array([noise_std]),
        np.array([condition]),
    )
    if radius_floor is not None and radius_floor >= radius:
        fit = refit_patches(stack, bias, prior, options)[0]
        if fit is None:
            raise UnfitError(BENT)
        return fit
    if radius_floor is None and _clearly_unfit(stack, options.basis, bias, prior):
        raise UnfitError(_UNFIT)
    choices = first_choices(stack, options.basis, bias, prior)
    if not choices.doubtful[0]:
        solution = solve_choices(choices, options.basis)
    elif radius_floor is None:
        raise UnfitError(_UNFIT)
    else:
        choices = shrunk(stack, options.basis, bias, radius_floor, prior)
        solution = solve_choices(choices, options.basis)
    return patch_fits(solution, options)[0]


def _clearly_unfit(stack: Stack, basis: Basis, bias: float, prior: SmoothnessPrior) -> bool:
    """Whether a subset of the samples already shows that no one polynomial explains them."""
    step = len(stack.weight[0]) // (_SAMPLES_PER_COEFFICIENT * basis.size)
    if step < 2:
        return False
    columns = {name: getattr(stack, name)[:, ::step] for name in ("offsets", "across", "weight")}
    subset = replace(stack, **columns)
    bias = float(np.hypot(bias, _TEST_BIAS * stack.noise[0]))
    return bool(first_choices(subset, basis, bias, prior).doubtful[0])


@unsolvable_is_unfit()
def refit_patches(
    stack: Stack, bias: float, prior: SmoothnessPrior, options: FitOptions
) -> list[PatchFit | None]:
    """Many patches in one call; None where the fit diverges. Each equals that of ``refit_patch``
    with its radius as its floor.

    Raises
    ------
    UnfitError
        The equations of one of them cannot be solved.
    """
    basis = options.basis
    choices = first_choices(stack, basis, bias, prior)
    found: list[PatchFit | None] = [None] * len(stack.reach)
    solution, lost = solved(with_smoothness_chosen(choices, basis, prior), basis)
    kept = np.flatnonzero(~lost)
    fits = patch_fits(solution[kept], options) if len(kept) else []
    for i, fit in zip(kept.tolist(), fits, strict=True):
        found[i] = fit
    return found
