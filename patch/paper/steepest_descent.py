"""The paper's own solver of (5): steepest descent with the signs of K frozen (section 2.3).

While no sign changes, (5) equals the objective with frozen signs. Beyond, the frozen objective
rewards curvature of the wrong sign. So the direction is that of the frozen signs, and the length of
the step is measured by (5) itself. Other readings of line 8 of the pseudocode (one step at a time,
or the minimum of the frozen objective) were measured: they end a fifth above this one, or more.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.paper.total_curvature import (
    FoldProblem,
    objective,
    objective_and_gradient,
    signs,
)

SETTLED = "no sign changed"
STUCK = "no step falls"
LIMIT = "the iteration limit was reached"


@dataclass(frozen=True, eq=False)
class Descent:
    """Minimum of (5) that a solver found.

    Parameters
    ----------
    coefficients : (t,) float, no unit
        In the scaled coordinates of the problem.
    objective : float, length^2
        Value of (5) there.
    iterations, evaluations : int
        Steps taken, and values of the objective computed for them.
    converged : bool
        By the solver's own rule.
    reason : str
        Why it ended.
    """

    coefficients: np.ndarray
    objective: float
    iterations: int
    evaluations: int
    converged: bool
    reason: str


def sign_frozen_descent(problem: FoldProblem, limit: int = 20_000) -> Descent:
    """Minimum of (5) by the paper's steepest descent from zeros, the Darboux quadric.

    Parameters
    ----------
    problem : FoldProblem
    limit : int
        Largest number of steps.

    Returns
    -------
    Descent
        It has converged when (5) stops falling and no sign changes: the paper's rule.
        Otherwise ``reason`` says that no step falls, or that the limit is reached.

    Notes
    -----
    The paper, section 2.3. Line search: the step doubles after each success and halves until
    Armijo's rule holds. Minima of (5) lie on its kinks, where steepest descent zigzags with ever
    shorter steps: the result may be a few per cent above the minimum.

    Examples
    --------
    Curves on a plane have the plane as their minimum:

    >>> from touchatlas.patch.paper.total_curvature import fold_problem
    >>> t = np.linspace(-2.0, 2.0, 5)
    >>> lines = [np.outer(t, [np.cos(a), np.sin(a), 0.0]) for a in (0.0, 1.0, 2.0)]
    >>> sign_frozen_descent(fold_problem(np.concatenate(lines), 0.0, 0.0, 0.3)).reason
    'no sign changed'
    """
    a, step = np.zeros(problem.size), 1.0 / problem.radius**2
    here = objective_and_gradient(problem, a)
    steps, evaluations, reason = 0, 1, LIMIT
    while steps < limit:
        if not here[1].any():
            reason = SETTLED
            break
        found = _line_search(problem, a, here, step)
        if found is None:
            reason, evaluations = STUCK, evaluations + 60
            break
        step, there, tried = found
        a, steps, evaluations = a - step * here[1], steps + 1, evaluations + tried
        fall = here[0] - there[0]
        same_signs = np.array_equal(signs(there[2]), signs(here[2]))
        here, step = there, 2.0 * step
        if same_signs and fall <= 1e-10 * abs(here[0]):
            reason = SETTLED
            break
    value = objective(problem, a)
    return Descent(a, value, steps, evaluations, reason == SETTLED, reason)


def _line_search(problem: FoldProblem, a, here, step: float):
    """A step by Armijo's rule, (5) with its gradient there, and the trials; None if none falls."""
    value, gradient, _ = here
    slope = gradient @ gradient
    for tried in range(1, 60 + 1):
        there = objective_and_gradient(problem, a - step * gradient)
        # Armijo's rule (Nocedal and Wright, section 3.1).
        if there[0] <= value - 0.05 * step * slope:
            return step, there, tried
        step *= 0.5
    return None
