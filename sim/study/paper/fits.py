"""The fits that the paper's tables compare, one draw judged, and the spread over draws."""

from collections.abc import Callable, Sequence

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.patch import Contour, Patch, Penalty, fit_paper, fit_patch
from touchatlas.patch.paper.curvature_on_grid import convex_hull
from touchatlas.patch.paper.steepest_descent import sign_frozen_descent
from touchatlas.patch.paper.total_curvature import FoldProblem, fold_problem, objective
from touchatlas.sim.study.fits import PAPER_MULTIPLIER, height_error

# Of twelve curves, 15 degrees apart: those to fit, and those of the third row of table 1.
CURVES = 12
DATA, OTHERS = (0, 4, 8), (2, 6, 10)
PLAIN, DESCENT, FAST, OURS = "(3)", "(5)", "(5), fast solver", "fit_patch"

_FRACTIONS = {"median": 0.5, "lower": 0.25, "upper": 0.75}

Fit = Callable[[np.ndarray, tuple[Contour, ...], np.ndarray], Patch]


def _plain(contact, contours, outward) -> Patch:
    return fit_paper(contact, contours, outward, Penalty.NONE)


def _by_descent(contact, contours, outward) -> Patch:
    penalty = Penalty.TOTAL_CURVATURE
    return fit_paper(contact, contours, outward, penalty, PAPER_MULTIPLIER, sign_frozen_descent)


def _by_newton(contact, contours, outward) -> Patch:
    return fit_paper(contact, contours, outward, Penalty.TOTAL_CURVATURE, PAPER_MULTIPLIER)


def _ours(contact, contours, outward) -> Patch:
    return fit_patch(contact, contours, outward).patch


FITS: dict[str, Fit] = {PLAIN: _plain, DESCENT: _by_descent, FAST: _by_newton, OURS: _ours}


def fitted(fit: str, touch: Touch, curves: Sequence[int] = DATA) -> Patch:
    """The patch of some curves of a touch by one of ``FITS``."""
    return FITS[fit](touch.contact, contours_of(touch, curves), touch.approach)


def contours_of(touch: Touch, curves: Sequence[int] = DATA) -> tuple[Contour, ...]:
    """The contours that are fitted."""
    return tuple(touch.contours[i] for i in curves)


def data_points(touch: Touch, curves: Sequence[int] = DATA) -> np.ndarray:
    """(n, 3) points of the fitted curves, length, world."""
    return np.concatenate([contour.points for contour in contours_of(touch, curves)])


def verifying_points(touch: Touch, curves: Sequence[int] = DATA) -> np.ndarray:
    """(n, 3) points of all other curves of a touch, length, world."""
    return data_points(touch, [i for i in range(len(touch.contours)) if i not in curves])


def fold_of(patch: Patch, contours: Sequence[Contour]) -> tuple[FoldProblem, np.ndarray]:
    """The problem (5) that ``fit_paper`` solved for a patch, and the patch's coefficients in it."""
    local = patch.frame.to_local(np.concatenate([contour.points for contour in contours]))
    known = patch.curvatures
    problem = fold_problem(local, known.k1, known.k2, PAPER_MULTIPLIER)
    return problem, patch.polynomial.coefficients[patch.polynomial.basis.orders >= 3]


def judged(fit: str, touch: Touch, curves: Sequence[int] = DATA) -> dict[str, float]:
    """One draw of one fit.

    Returns
    -------
    dict
        ``k1``, ``k2``; ``data`` and ``verifying``, the means of |z(x_k, y_k) - z_k| on the
        fitted and on all other curves, and ``inside``, on the other curves within the hull D of
        the fitted ones, length; of the paper's fits also ``objective``, (5) over the number of
        points, length^2.
    """
    patch = fitted(fit, touch, curves)
    known, data = patch.curvatures, data_points(touch, curves)
    verifying = verifying_points(touch, curves)
    errors = np.abs(height_error(patch, verifying))
    found = {
        "k1": known.k1,
        "k2": known.k2,
        "data": float(np.abs(height_error(patch, data)).mean()),
        "verifying": float(errors.mean()),
        "inside": float(errors[_within_hull(patch, data, verifying)].mean()),
    }
    if fit != OURS:
        problem, coefficients = fold_of(patch, contours_of(touch, curves))
        found["objective"] = objective(problem, coefficients) / len(problem.target)
    return found


def _within_hull(patch: Patch, data, points) -> np.ndarray:
    """(n,) whether points project into the domain D of the data."""
    hull = convex_hull(patch.frame.to_local(data)[:, :2]).equations
    flat = patch.frame.to_local(points)[:, :2]
    return (flat @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1)


def spread(values) -> dict[str, float | None]:
    """Median, quartiles, mean and standard deviation; None where they are not finite.

    >>> spread([1.0, 2.0, 3.0, 4.0, 5.0])["upper"]
    4.0
    """
    values = np.sort(np.asarray(values, dtype=float))
    # A patch that a height does not meet has an infinite error, and the draws no mean.
    known = {"mean": values.mean(), "std": values.std() if np.isfinite(values).all() else np.inf}
    found = {name: _quantile(values, fraction) for name, fraction in _FRACTIONS.items()} | known
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}


def _quantile(values, fraction: float) -> float:
    """Of sorted values, linear between two of them; infinite where one of the two is."""
    low, part = divmod(fraction * (len(values) - 1), 1.0)
    below, above = values[int(low)], values[int(np.ceil(low + part))]
    return below if part == 0.0 else (1.0 - part) * below + part * above


def spreads(measures: Sequence[dict[str, float]]) -> dict[str, dict]:
    """The spread of each measure over the draws."""
    return {name: spread([found[name] for found in measures]) for name in measures[0]}
