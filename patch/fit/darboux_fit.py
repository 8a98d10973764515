"""The polynomial of chosen terms in its own Darboux frame, each found from the other."""

from dataclasses import dataclass, fields, is_dataclass
from typing import TypeVar

import numpy as np

from touchatlas.patch.fit.reframe import reframed
from touchatlas.patch.fit.smoothness import (
    LinearSystem,
    NormalEquations,
    coefficient_precision,
    effective_parameters,
    map_coefficients,
    posterior,
    scaled_noise,
)
from touchatlas.patch.fit.start import Stack
from touchatlas.patch.geometry.polynomial import Basis

Record = TypeVar("Record")


@dataclass(frozen=True, eq=False)
class Solution:
    """m fitted polynomials in their Darboux frames.

    Parameters
    ----------
    stack : Stack
        In the final frames. ``reach`` is the patch radius.
    basis : Basis
    equations : NormalEquations
    length_ratio, z_scale : (m,) float
        Parameters of the smoothness prior.
    mean : (m, t) float
        Coefficients, scaled.
    covariance : (m, t, t) float
        Of the coefficients. It is enlarged where residuals exceed the noise.
    residual : (m,) float, scaled
        Weighted root mean square of the residuals.
    """

    stack: Stack
    basis: Basis
    equations: NormalEquations
    length_ratio: np.ndarray
    z_scale: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    residual: np.ndarray

    def __getitem__(self, rows) -> "Solution":
        """The solution of some of the fits."""
        return Solution(
            *(self.stack[rows], self.basis, self.equations[rows], self.length_ratio[rows]),
            *(self.z_scale[rows], self.mean[rows], self.covariance[rows], self.residual[rows]),
        )


def solve_in_darboux_frame(
    stack: Stack, basis: Basis, mean, weight, length_ratio, z_scale
) -> Solution:
    """Refit the polynomials in their Darboux frames until the terms x, y and x y vanish, or until
    they diverge.

    Parameters
    ----------
    stack : Stack
    basis : Basis
    mean : (m, t) float
        Coefficients in the frames of the stack.
    weight : (m, n) float
        Weights of F^2: those of squared distances over |grad F|^2. They stay fixed. Otherwise the
        fit could lower the weight of large residuals by making the gradient larger there.
    length_ratio, z_scale : (m,) float
        Parameters of the smoothness prior.
    """
    precision = coefficient_precision(basis, length_ratio, z_scale)
    noise = scaled_noise(stack.noise, stack.reach)
    count = np.maximum(np.count_nonzero(weight, axis=1), 1)
    # Half a standard deviation of the samples' mean, or the rounding of exact contacts, rad.
    tolerance = np.maximum(1e-9, 0.5 * noise / np.sqrt(count))
    rows, parts, solutions, first = np.arange(len(length_ratio)), [], [], stack
    # 1 % of random shapes need more than twelve frames, none of 2,000 needed sixty. Where full
    # rotations do not converge they overshoot: half of them do.
    for number in range(60):
        fraction = 1.0 if number < 12 else 0.5
        stack, samples = reframed(stack, basis, mean, fraction)
        system = samples.system(basis, weight[rows])
        equations = system.equations()
        mean = map_coefficients(equations, noise[rows], precision[rows])
        # The terms x, y and x y; that of x y is about ten times less certain.
        slopes = np.abs(mean[:, [1, 2, 4]] / np.array([1.0, 1.0, 10.0])).max(axis=1)
        # A fit ends as soon as it converges, so that its result does not depend on the others.
        done = (slopes < tolerance[rows]) | (number == 60 - 1)
        done |= diverged(first[rows], stack)
        if done.any():
            ended = slice(None) if done.all() else done
            i = rows[ended]
            parts.append(i)
            solutions.append(
                _solution(
                    *(stack[ended], basis, equations[ended], length_ratio[i], z_scale[i]),
                    *(mean[ended], system[ended], noise[i], precision[i]),
                )
            )
            if len(i) == len(rows):
                break
            stack, mean, rows = stack[~done], mean[~done], rows[~done]
    return joined(parts, solutions)


def diverged(before: Stack, after: Stack) -> np.ndarray:
    """(m,) whether frames moved by 60 degrees, or half a radius, from the first polynomial."""
    shift = after.origin - before.origin
    upright = np.einsum("mi,mi->m", before.axes[:, 2], after.axes[:, 2])
    near = (shift * shift).sum(axis=1) < (0.5 * before.reach) ** 2
    # The comparisons are false for NaN, which therefore counts as diverged.
    return ~((upright > 0.5) & near)


def joined(rows: list[np.ndarray], records: list[Record]) -> Record:
    """One record of all fits, as Solution or Choices, from records that together have these
    rows."""
    if len(records) == 1:
        return records[0]
    joint: Record = _concatenated(records, np.argsort(np.concatenate(rows)))
    return joint


def _concatenated(records, order):
    """A record with the arrays of all records, concatenated and then put in an order."""
    first = records[0]
    values = []
    for field in fields(first):
        column = [getattr(record, field.name) for record in records]
        if isinstance(column[0], np.ndarray):
            values.append(np.concatenate(column)[order])
        elif is_dataclass(column[0]) and not isinstance(column[0], Basis):
            values.append(_concatenated(column, order))
        else:
            values.append(column[0])
    return type(first)(*values)


def _solution(
    stack, basis, equations, length_ratio, z_scale, mean, system: LinearSystem, noise, precision
) -> Solution:
    """Refined coefficients, covariance and residuals of solved normal equations.

    Normal equations square the condition. For exact contacts they lose half the digits of the
    coefficients that only the prior determines. One step with the residuals of the samples
    restores them (iterative refinement: Golub and Van Loan, Matrix Computations, section 3.5.3).
    """
    covariance = posterior(equations.gram, equations.rhs, noise, precision)[1]
    gradient = system.phi @ (system.weight * system.residuals(mean))[..., None]
    gradient = gradient[..., 0] * (noise**-2.0)[:, None] - precision * mean
    mean = mean + (covariance @ gradient[..., None])[..., 0]
    freedom = np.maximum(equations.count - effective_parameters(covariance, precision), 1.0)
    sum_of_squares = np.einsum("mn,mn->m", system.weight, system.residuals(mean) ** 2)
    residual = np.sqrt(sum_of_squares / freedom)
    covariance *= np.maximum(1.0, (residual / noise) ** 2)[:, None, None]
    return Solution(stack, basis, equations, length_ratio, z_scale, mean, covariance, residual)
