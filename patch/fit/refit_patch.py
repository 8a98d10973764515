"""refit_patches: patches of samples of one surface sheet each, from approximate frames."""

import numpy as np

from touchatlas.patch.fit.estimate import first_choices, solved, with_smoothness_chosen
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, patch_fits, unsolvable_is_unfit
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack


@unsolvable_is_unfit()
def refit_patches(
    stack: Stack, bias: float, prior: SmoothnessPrior, options: FitOptions
) -> list[PatchFit | None]:
    """Many patches in one call, in the Darboux frames that their samples define; None where the
    fit diverges.

    Their radii are kept: samples that the degree does not explain have less weight instead.

    Parameters
    ----------
    stack : Stack
        Approximate frames near the surface, with normals within 45 degrees of the surface's.
    bias : float, length
        Allowed model error, standard deviation.
    prior : SmoothnessPrior
    options : FitOptions

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
