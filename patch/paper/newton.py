"""A fast solver of (5): primal-dual Newton steps on smoothed |K|, from three starts.

|K| is smoothed to sqrt(K^2 + eps^2). Each grid point has a dual variable w_j in [-1, 1]. It is the
sign of K_j where K_j is not zero, and a multiplier where the minimum lies on the kink K_j = 0.
Newton's step for coefficients and dual variables together converges as eps tends to zero (Chan,
Golub & Mulet 1999, for total variation). Here K is not linear, so its second derivatives enter.

Between three curves (5) has several minima: the patch can fold up or down in the direction that the
curves determine least. So short searches on the coarse grid start at zeros and on both sides of it
in that direction, and the best of them are finished on the whole grid. A lower minimum of (5) need
not be the better surface: on a convex body it is the flatter one.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dposv

from touchatlas.patch.paper.curvature_on_grid import GridCurvature, curvature_derivatives
from touchatlas.patch.paper.steepest_descent import LIMIT, Descent
from touchatlas.patch.paper.total_curvature import FoldProblem

# What keeps quotients finite.
_TINY = np.finfo(float).tiny


SMALL_GAP = "the duality gap is below the tolerance"


def newton_minimum(problem: FoldProblem) -> Descent:
    """Minimum of (5) by primal-dual Newton steps from the Darboux quadric and both sides of it.

    Parameters
    ----------
    problem : FoldProblem

    Returns
    -------
    Descent
        It has converged when the duality gap and the predicted fall are below 1e-7 of (5).

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
    # eps is first ten times the mean |K| of the start, and 0.3 times that where a search goes on.
    # It falls with the duality gap.
    starts, runs, eps = [np.zeros(problem.size)], [], 10.0
    side = _undetermined_fold(problem)
    coarse = problem.coarse
    if side.any() and coarse and len(coarse.grid) and problem.weight > 0.0:
        runs = [_search(coarse, sign * side, 1.0, 0.1, 6) for sign in (0.0, 1.0, -1.0)]
        starts, eps = _distinct(runs), 0.3
    ends = [_search(problem, start, eps, 1e-7, 60) for start in starts]
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
    """Ends of the lowest search, and of those that are nearly as low but elsewhere."""
    runs = sorted(runs, key=lambda run: run.objective)
    kept = [runs[0].coefficients]
    for run in runs[1:]:
        apart = min(
            np.linalg.norm(run.coefficients - c) / (np.linalg.norm(c) + _TINY) for c in kept
        )
        if run.objective <= 1.03 * runs[0].objective and apart > 0.3:
            kept.append(run.coefficients)
    return kept


def _undetermined_fold(problem: FoldProblem) -> np.ndarray:
    """The most cubic coefficients that the curves hardly determine; zeros when there are none.

    On three lines through the origin they are the product of the lines, a monkey saddle.
    """
    values, vectors = np.linalg.eigh(problem.design.T @ problem.design)
    # Eigenvalues of three curves have a gap there.
    undetermined = vectors[:, values < 1e-3 * values[-1]]
    if undetermined.shape[1] == 0:
        return np.zeros(problem.size)
    _, _, mix = np.linalg.svd(undetermined[:4])
    size = 2.0 * np.abs(problem.points_local[:, 2]).max() / problem.radius
    return size * (undetermined @ mix[0])


class _State(NamedTuple):
    """(5) over R^2 at coefficients ``a``, with the terms of Newton's step.

    ``residual`` (n,) and ``error`` are those of f; ``exact`` is (5) itself.
    """

    a: np.ndarray
    grid: GridCurvature
    residual: np.ndarray
    error: float
    exact: float

    def smooth(self, weight: float, eps: float) -> float:
        """(5) over R^2 with sqrt(K^2 + eps^2) in place of |K|."""
        k = self.grid.excess
        return self.error + weight * np.sqrt(k * k + eps * eps).sum()


def _evaluate(problem: FoldProblem, a) -> _State:
    """The state at coefficients a."""
    grid = problem.curvature(a)
    residual = problem.design @ a - problem.target
    error = residual @ residual
    return _State(a, grid, residual, error, error + problem.weight * np.abs(grid.excess).sum())


def _search(problem: FoldProblem, a, first_eps: float, tolerance: float, limit: int) -> Descent:
    """Primal-dual Newton from one start. eps falls with the duality gap."""
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
        # The dual variables stay within [-1, 1].
        room = (1.0 - dual * np.sign(change)) / (np.abs(change) + _TINY)
        fraction = min(1.0, 0.99 * room.min())
        dual += fraction * change
        gap = weight * (np.abs(k).sum() - dual @ k)
        if max(gap, -rate) <= tolerance * state.exact and fraction > 0.9:
            reason = SMALL_GAP
        eps = min(eps, max(0.1 * eps, gap / (weight * len(k) + _TINY)))
    value = float(best.exact) * problem.radius**2
    return Descent(best.a, value, steps, evaluations, reason == SMALL_GAP, reason)


def _newton_step(problem: FoldProblem, state: _State, dual, eps: float):
    """Step of the coefficients, the slope of (5) along it, and the dual variables after it."""
    k = state.grid.excess
    modulus = np.sqrt(k * k + eps * eps + _TINY)
    smooth_sign = k / modulus
    second = (1.0 - dual * smooth_sign) / modulus
    slopes, hessian = curvature_derivatives(problem.derivatives, state.grid, dual, second)
    gradient = 2.0 * (state.residual @ problem.design) + problem.weight * (slopes @ smooth_sign)
    hessian *= problem.weight
    hessian += 2.0 * (problem.design.T @ problem.design)
    _, step, indefinite = dposv(hessian, -gradient)
    if indefinite:
        values, vectors = np.linalg.eigh(hessian)
        values = np.abs(values)
        values = np.maximum(values, 1e-12 * values.max() + _TINY)
        step = -vectors @ ((gradient @ vectors) / values)
    change = np.abs(step @ problem.derivatives[:, : 2 * len(k)]).max()
    # Beyond steep folds (5) falls without end.
    if change > 0.5:
        step *= 0.5 / change
    return step, gradient @ step, smooth_sign + second * (step @ slopes)


def _line_search(problem: FoldProblem, state: _State, direction, rate: float, eps: float):
    """The state after 1, 1/2, 1/4, ... of the step: the first that lowers the smoothed (5)."""
    weight = problem.weight
    value, fraction, tried = state.smooth(weight, eps), 1.0, 0
    while fraction > 1e-8:
        new, tried = _evaluate(problem, state.a + fraction * direction), tried + 1
        # Armijo's rule (Nocedal and Wright, section 3.1), up to the rounding of (5).
        if new.smooth(weight, eps) <= value * (1.0 + 1e-15) + 1e-4 * fraction * rate:
            return new, tried
        fraction *= 0.5
    return state, tried
