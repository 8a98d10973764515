"""A fast solver of (5): primal-dual Newton on smoothed |K|, from three sides.

|K| is smoothed to sqrt(K^2 + eps^2). Beside the coefficients a dual weight w_j in [-1, 1] is
carried for each grid point, the sign of K_j where K_j is not zero and a multiplier where a
minimum lies on the kink K_j = 0. Newton's step for both at once stays good as eps falls to
nothing (Chan, Golub & Mulet 1999, for total variation; here K is curved too, so its second
derivatives enter).

Between three curves (5) has several minima: a patch flattens by folding up or down along the
direction that the curves see least. So short searches on the coarse grid start at zeros and on
both sides of it in that direction, and the best of them are finished on the whole grid. A lower
minimum of (5) need not be the better surface: on a convex body it is the flatter one.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dposv

from touchatlas.patch.paper.curvature_on_grid import GridCurvature, curvature_derivatives
from touchatlas.patch.paper.steepest_descent import LIMIT, Descent
from touchatlas.patch.paper.total_curvature import (
    FoldProblem,
    checked_start,
)

_SUFFICIENT = 1e-4
_LEAST_STEP = 1e-8
# A Newton step turns no slope on the grid by more than this: past steep folds (5) falls forever.
_MOST_SLOPE = 0.5
# Smoothing over the mean |K| of the start; the gap, not this, drives how fast it falls.
_FIRST_EPS, _FINISH_EPS, _FALL_OF_EPS = 10.0, 0.3, 0.1
# Short searches: first smoothing, tolerance, steps.
_EXPLORE = (1.0, 0.1, 6)
# Ends this near in height are finished too, unless they are nearly the same place.
_RIVAL, _APART = 0.03, 0.3
# Eigenvalues below this share of the largest belong to what the curves do not see.
_UNSEEN = 1e-3
_CUBICS = 4
_FLAT, _TINY, _ROUNDING = 1e-12, 1e-300, 1e-15

SMALL_GAP = "the duality gap is below the tolerance"


def newton_minimum(
    problem: FoldProblem, start=None, *, explore=True, tolerance=1e-7, limit=60
) -> Descent:
    """Minimum of (5) by primal-dual Newton steps from the start and from both sides of it.

    Parameters
    ----------
    problem : FoldProblem
    start : (t,) float, no unit
        None for zeros, the Darboux quadric.
    tolerance : float
        Of the duality gap and of the fall that Newton's model still promises, over (5).
    explore : bool
        Whether to search from both sides too; else the minimum that the start leads to, in half
        the time.
    limit : int
        Most Newton steps of one search.

    Returns
    -------
    Descent
        Its coefficients are never worse than the start.

    Raises
    ------
    ValueError
        A start of another size.

    Notes
    -----
    Chan, Golub & Mulet, A nonlinear primal-dual method for total variation-based image
    restoration, SIAM J. Sci. Comput. 20 (1999).

    Examples
    --------
    >>> from touchatlas.patch.paper.total_curvature import fold_problem
    >>> t = np.linspace(-2.0, 2.0, 5)
    >>> lines = [np.outer(t, [np.cos(a), np.sin(a), 0.0]) for a in (0.0, 1.0, 2.0)]
    >>> newton_minimum(fold_problem(np.concatenate(lines), 0.0, 0.0, 0.3)).objective
    0.0
    """
    a = checked_start(problem, start)
    starts, runs = [a], []
    side = _unseen_fold(problem)
    coarse = problem.coarse
    if explore and side.any() and coarse and len(coarse.grid) and problem.weight > 0.0:
        runs = [_search(coarse, a + way * side, *_EXPLORE) for way in (0.0, 1.0, -1.0)]
        starts = _distinct(runs)
    ends = [
        _search(problem, s, _FINISH_EPS if runs else _FIRST_EPS, tolerance, limit) for s in starts
    ]
    best = min(ends, key=lambda run: run.objective)
    runs += ends
    return Descent(
        best.coefficients,
        best.objective,
        sum(run.iterations for run in runs),
        sum(run.evaluations for run in runs),
        best.converged,
        best.reason,
    )


def _distinct(runs) -> list[np.ndarray]:
    """The best end and its rivals: nearly as low, and elsewhere."""
    runs = sorted(runs, key=lambda run: run.objective)
    kept = [runs[0].coefficients]
    for run in runs[1:]:
        apart = min(
            np.linalg.norm(run.coefficients - c) / (np.linalg.norm(c) + _TINY) for c in kept
        )
        if run.objective <= (1.0 + _RIVAL) * runs[0].objective and apart > _APART:
            kept.append(run.coefficients)
    return kept


def _unseen_fold(problem: FoldProblem) -> np.ndarray:
    """Of the coefficients that the curves hardly see, the most cubic ones; zeros when none.

    On three lines through the origin it is their product, a monkey saddle.
    """
    values, vectors = np.linalg.eigh(problem.design.T @ problem.design)
    unseen = vectors[:, values < _UNSEEN * values[-1]]
    if unseen.shape[1] == 0:
        return np.zeros(problem.size)
    _, _, mix = np.linalg.svd(unseen[:_CUBICS])
    bend = 2.0 * np.abs(problem.points_local[:, 2]).max() / problem.radius
    return bend * (unseen @ mix[0])


class _State(NamedTuple):
    """(5) over R^2 at some coefficients, and what Newton's step needs there."""

    a: np.ndarray
    grid: GridCurvature
    residual: np.ndarray
    error: float
    exact: float

    def smooth(self, weight: float, eps: float) -> float:
        k = self.grid.excess
        return self.error + weight * np.sqrt(k * k + eps * eps).sum()


def _evaluate(problem: FoldProblem, a) -> _State:
    grid = problem.curvature(a)
    residual = problem.design @ a - problem.target
    error = residual @ residual
    return _State(a, grid, residual, error, error + problem.weight * np.abs(grid.excess).sum())


def _search(problem: FoldProblem, a, first_eps: float, tolerance: float, limit: int) -> Descent:
    """Primal-dual Newton from one start, with eps falling as the duality gap does."""
    weight, best = problem.weight, _evaluate(problem, a)
    state, k = best, best.grid.excess
    eps = first_eps * (np.abs(k).mean() or (np.abs(problem.target).max() + _TINY) ** 2)
    dual = k / np.sqrt(k * k + eps * eps + _TINY)
    evaluations, steps, reason = 1, 0, LIMIT
    while steps < limit and reason == LIMIT:
        direction, rate, dual_goal = _newton_step(problem, state, dual, eps)
        state, tried = _line_search(problem, state, direction, rate, eps)
        steps, evaluations, k = steps + 1, evaluations + tried, state.grid.excess
        best = min(best, state, key=lambda s: s.exact)
        change = dual_goal - dual
        room = (1.0 - dual * np.sign(change)) / (np.abs(change) + _TINY)
        along = min(1.0, 0.99 * room.min())
        dual += along * change
        gap = weight * (np.abs(k).sum() - dual @ k)
        if max(gap, -rate) <= tolerance * state.exact and along > 0.9:
            reason = SMALL_GAP
        eps = min(eps, max(_FALL_OF_EPS * eps, gap / (weight * len(k) + _TINY)))
    value = float(best.exact) * problem.radius**2
    return Descent(best.a, value, steps, evaluations, reason == SMALL_GAP, reason)


def _newton_step(problem: FoldProblem, state: _State, dual, eps: float):
    """Step of the coefficients, its slope, and where the dual weights would go with it."""
    k = state.grid.excess
    modulus = np.sqrt(k * k + eps * eps + _TINY)
    share = k / modulus
    stiffness = (1.0 - dual * share) / modulus
    slopes, hessian = curvature_derivatives(problem.derivatives, state.grid, dual, stiffness)
    gradient = 2.0 * (state.residual @ problem.design) + problem.weight * (slopes @ share)
    hessian *= problem.weight
    hessian += 2.0 * (problem.design.T @ problem.design)
    _, step, indefinite = dposv(hessian, -gradient)
    if indefinite:
        values, vectors = np.linalg.eigh(hessian)
        values = np.abs(values)
        values = np.maximum(values, _FLAT * values.max() + _TINY)
        step = -vectors @ ((gradient @ vectors) / values)
    turn = np.abs(step @ problem.derivatives[:, : 2 * len(k)]).max()
    if turn > _MOST_SLOPE:
        step *= _MOST_SLOPE / turn
    return step, gradient @ step, share + stiffness * (step @ slopes)


def _line_search(problem: FoldProblem, state: _State, direction, rate: float, eps: float):
    """The state at the first of 1, 1/2, 1/4, ... of the step that lowers the smoothed (5)."""
    weight = problem.weight
    value, share, tried = state.smooth(weight, eps), 1.0, 0
    while share > _LEAST_STEP:
        new, tried = _evaluate(problem, state.a + share * direction), tried + 1
        if new.smooth(weight, eps) <= value * (1.0 + _ROUNDING) + _SUFFICIENT * share * rate:
            return new, tried
        share *= 0.5
    return state, tried
