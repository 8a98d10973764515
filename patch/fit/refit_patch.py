"""refit_patch: a patch from samples that are known to be of one sheet, about where it lies."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.fit.estimate import (
    first_choices,
    shrunk,
    solve_choices,
    with_smoothness_chosen,
)
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, records, unsolvable_is_unfit
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.polynomial import Basis

_UNFIT = "no one polynomial holds the samples; make the patch smaller"
# So many samples a coefficient show misfits of this share of the noise, and more, without the
# others: by chance, some four deviations of their chi-square.
_SOME, _PLAIN = 10, 0.5


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
    """Patch from samples of one sheet, in the Darboux frame that they define.

    Parameters
    ----------
    frame : DarbouxFrame
        Where it is expected to lie: near the surface, with a normal within 45 degrees.
    points : (n, 3) float, length, world
    across : (n, 3) float, unit, world
        Normal of the plane that each sample was tracked in; zero for a sample of no plane.
    noise_std, radius : float, length
    bias : float, length
        Residuals beyond the noise that are borne before the radius is reduced.
    radius_floor : float, length, or None
        Residuals make the patch no smaller. Where this is the radius, samples count the less
        instead, the more of them the degree leaves out; None refuses such samples.
    prior : SmoothnessPrior
    options : FitOptions
    condition : float
        Of the sections, to be passed on.

    Raises
    ------
    UnfitError
        No sample within reach, or samples that no one polynomial holds.
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
        return refit_patches(stack, bias, prior, options)[0]
    if radius_floor is None and _hopeless(stack, options.basis, bias, prior):
        raise UnfitError(_UNFIT)
    choices = first_choices(stack, options.basis, bias, prior)
    if not choices.doubtful[0]:
        solution = solve_choices(choices, options.basis)
    elif radius_floor is None:
        raise UnfitError(_UNFIT)
    else:
        solution = shrunk(stack, options.basis, bias, radius_floor, prior)
    return records(solution, options)[0]


def _hopeless(stack: Stack, basis: Basis, bias: float, prior: SmoothnessPrior) -> bool:
    """Whether some of the samples already show that no one polynomial holds all of them."""
    step = len(stack.weight[0]) // (_SOME * basis.size)
    if step < 2:
        return False
    columns = {name: getattr(stack, name)[:, ::step] for name in ("offsets", "across", "weight")}
    some = replace(stack, **columns)
    bias = float(np.hypot(bias, _PLAIN * stack.noise[0]))
    return bool(first_choices(some, basis, bias, prior).doubtful[0])


@unsolvable_is_unfit()
def refit_patches(
    stack: Stack, bias: float, prior: SmoothnessPrior, options: FitOptions
) -> list[PatchFit]:
    """Many patches in one call: each what ``refit_patch`` finds with its radius for its floor.

    Raises
    ------
    UnfitError
        When any of them cannot be fitted.
    """
    basis = options.basis
    choices = first_choices(stack, basis, bias, prior)
    found = {
        i: records(with_smoothness_chosen(choices[[i]], basis, prior), options)[0]
        for i in np.flatnonzero(choices.doubtful).tolist()
    }
    good = np.flatnonzero(~choices.doubtful)
    if len(good):
        fits = records(solve_choices(choices[good], basis), options)
        found |= dict(zip(good.tolist(), fits, strict=True))
    return [found[i] for i in range(len(stack.reach))]
