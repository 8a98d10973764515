"""The polynomial of chosen terms in its own Darboux frame, each found from the other."""

from dataclasses import dataclass, fields, is_dataclass
from typing import TypeVar

import numpy as np

from touchatlas.patch.fit.linear_system import LinearSystem, map_coefficients
from touchatlas.patch.fit.reframe import reframed
from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    coefficient_precision,
    effective_parameters,
    posterior,
    scaled_noise,
)
from touchatlas.patch.fit.start import Stack
from touchatlas.patch.geometry.polynomial import Basis

Record = TypeVar("Record")

# Largest slope at the origin of a finished frame, in standard deviations of the samples' mean.
# Doubled, frames are tilted by up to one such deviation.
_SLOPE_TOLERANCE = 0.5
# Least slope tolerance, rad: rounding of exact contacts. Doubled, heights of exact contacts change
# by 2e-9 of the radius when the object is rotated.
_ROUNDING = 1e-9
# Most frames of one fit. 1 % of random shapes need more than twelve, none of 2,000 needed sixty.
# Doubled, a fit that does not converge takes twice as long.
_MOST_FRAMES = 60
# Frames that rotate by the whole angle; where these do not converge they overshoot. Doubled, such
# fits take twelve frames more.
_FULL_STEPS = 12
# Fraction of the rotation after that. Doubled, frames overshoot for ever.
_DAMPED_STEP = 0.5
# Largest move of a frame that has not diverged: the cosine of 60 degrees, and half the radius.
# Doubled, the cosine refuses every tilt, and origins may leave the patch.
_LARGEST_TILT_COSINE, _LARGEST_SHIFT = 0.5, 0.5
# Indices of the coefficients of x, y and x y, which vanish in the Darboux frame, and their
# tolerances relative to each other: that of x y is about ten times less certain.
_VANISHING, _RELATIVE_TOLERANCE = [1, 2, 4], np.array([1.0, 1.0, 10.0])


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
    tolerance = np.maximum(_ROUNDING, _SLOPE_TOLERANCE * noise / np.sqrt(count))
    rows, parts, solutions, first = np.arange(len(length_ratio)), [], [], stack
    for number in range(_MOST_FRAMES):
        fraction = 1.0 if number < _FULL_STEPS else _DAMPED_STEP
        stack, samples = reframed(stack, basis, mean, fraction)
        system = samples.system(basis, weight[rows])
        equations = system.equations()
        mean = map_coefficients(equations, noise[rows], precision[rows])
        slopes = np.abs(mean[:, _VANISHING] / _RELATIVE_TOLERANCE).max(axis=1)
        # A fit ends as soon as it converges, so that its result does not depend on the others.
        done = (slopes < tolerance[rows]) | (number == _MOST_FRAMES - 1)
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
    near = (shift * shift).sum(axis=1) < (_LARGEST_SHIFT * before.reach) ** 2
    # The comparisons are false for NaN, which therefore counts as diverged.
    return ~((upright > _LARGEST_TILT_COSINE) & near)


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
