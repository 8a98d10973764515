"""The paper's own solver of (5): steepest descent with the signs of K frozen (section 2.3).

Line 8 of the pseudocode, "steepest descent from a along v", can be read in several ways. The
frozen objective equals (5) only while no sign changes; beyond, it rewards curvature of the wrong
sign. A line search that trusts it oversteps the kinks, (5) rises, and soon the signs cycle; one
step at a time stops far from a minimum as soon as one short step changes no sign. What ends in
minima of (5), or near them, is to take v from the frozen signs and to measure the step by (5)
itself. That is the default; the other readings are kept to be compared.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from touchatlas.patch.paper.total_curvature import (
    FoldProblem,
    checked_start,
    frozen_objective,
    objective,
    signs,
)

# Armijo's rule: the share of the linear fall that a step must reach (Nocedal & Wright, 3.1).
_SUFFICIENT = 0.05
_HALVINGS = 60

SETTLED = "no sign changed"
STUCK = "no step falls"
CYCLE = "the signs cycle"
LIMIT = "the iteration limit was reached"


class LineEight(Enum):
    """Readings of line 8: how long a descent goes on before the signs are looked at again."""

    WHILE_IT_FALLS = "descend along frozen signs while (5) itself falls and no sign changes"
    ONE_STEP = "one line-searched step of the frozen objective"
    TO_THE_MINIMUM = "descend to the minimum of the frozen objective, whatever the signs"


@dataclass(frozen=True, eq=False)
class Descent:
    """What a solver of (5) found.

    Parameters
    ----------
    coefficients : (t,) float, no unit
        The best seen, in the scaled coordinates of the problem.
    objective : float, length^2
        (5) there.
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


def sign_frozen_descent(
    problem: FoldProblem,
    start=None,
    *,
    line8=LineEight.WHILE_IT_FALLS,
    tolerance=1e-10,
    limit=20_000,
) -> Descent:
    """Minimum of (5) by the paper's steepest descent.

    Parameters
    ----------
    problem : FoldProblem
    start : (t,) float, no unit
        None for zeros, the Darboux quadric.
    line8 : LineEight
    tolerance : float
        A step whose relative fall is less ends the descent under the frozen signs.
    limit : int
        Most steps in all.

    Returns
    -------
    Descent
        Converged when no sign changes from one estimate to the next: the paper's rule. It says
        so when no step falls, when the signs cycle (they come back and (5) is no lower than
        before) and when the limit is reached.

    Raises
    ------
    ValueError
        A start of another size.

    Notes
    -----
    The paper, section 2.3. Line search: the step doubles after each success and halves until
    Armijo's rule holds. Minima of (5) lie on its kinks, where steepest descent zigzags with ever
    shorter steps: "converged" by the paper's rule may be a few per cent above the minimum.

    Examples
    --------
    Plane curves on a plane are met at once:

    >>> from touchatlas.patch.paper.total_curvature import fold_problem
    >>> t = np.linspace(-2.0, 2.0, 5)
    >>> lines = [np.outer(t, [np.cos(a), np.sin(a), 0.0]) for a in (0.0, 1.0, 2.0)]
    >>> sign_frozen_descent(fold_problem(np.concatenate(lines), 0.0, 0.0, 0.3)).reason
    'no sign changed'
    """
    a = checked_start(problem, start)
    value, _, excess = frozen_objective(problem, a)
    best, steps, evaluations, step = (value, a), 0, 1, 1.0 / problem.radius**2
    seen: dict[bytes, float] = {}
    reason = LIMIT
    while steps < limit:
        delta = signs(excess)
        if seen.get(delta.tobytes(), np.inf) <= value and steps > 0:
            reason = CYCLE
            break
        seen[delta.tobytes()] = value
        most = 1 if line8 is LineEight.ONE_STEP else limit - steps
        stay = line8 is LineEight.WHILE_IT_FALLS
        a, excess, step, used, tried, end = _descend(problem, a, delta, step, most, stay, tolerance)
        steps, evaluations = steps + used, evaluations + tried
        value = objective(problem, a)
        best = min(best, (value, a), key=lambda pair: pair[0])
        if end != LIMIT and np.array_equal(signs(excess), delta):
            reason = end
            break
    return Descent(best[1], best[0], steps, evaluations, reason == SETTLED, reason)


def _descend(problem, a, delta, step, most, stay, tolerance):
    """Steepest descent under the signs ``delta``; by (5), until one changes, when ``stay``."""
    frozen = None if stay else delta
    value, gradient, excess = frozen_objective(problem, a, frozen)
    used, tried = 0, 1
    while used < most:
        slope = gradient @ gradient
        if slope == 0.0:
            return a, excess, step, used, tried, SETTLED
        for _ in range(_HALVINGS):
            trial = frozen_objective(problem, a - step * gradient, frozen)
            tried += 1
            if trial[0] <= value - _SUFFICIENT * step * slope:
                break
            step *= 0.5
        else:
            return a, excess, step, used, tried, STUCK
        a, fall = a - step * gradient, value - trial[0]
        value, gradient, excess = trial
        used, step = used + 1, 2.0 * step
        changed = stay and not np.array_equal(signs(excess), delta)
        if changed or fall <= tolerance * abs(value):
            return a, excess, step, used, tried, SETTLED
    return a, excess, step, used, tried, SETTLED if most == 1 else LIMIT
