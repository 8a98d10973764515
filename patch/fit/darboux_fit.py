"""The polynomial of chosen terms in its own Darboux frame, each found from the other."""

from dataclasses import dataclass

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


@dataclass(frozen=True, eq=False)
class Solution:
    """A fitted polynomial in its Darboux frame, as arrays of one row.

    Parameters
    ----------
    stack : Stack
        In the final frames. ``reach`` is the patch radius.
    basis : Basis
    equations : NormalEquations
    length_ratio, z_scale : (1,) float
        Parameters of the smoothness prior.
    mean : (1, t) float
        Coefficients, scaled.
    covariance : (1, t, t) float
        Of the coefficients. It is enlarged where residuals exceed the noise.
    residual : (1,) float, scaled
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


def solve_in_darboux_frame(
    stack: Stack, basis: Basis, mean, weight, length_ratio, z_scale
) -> Solution:
    """Refit a polynomial in its Darboux frame until the terms x, y and x y vanish, or until it
    diverges.

    Parameters
    ----------
    stack : Stack
    basis : Basis
    mean : (1, t) float
        Coefficients in the frames of the stack.
    weight : (1, n) float
        Weights of F^2: those of squared distances over |grad F|^2. They stay fixed. Otherwise the
        fit could lower the weight of large residuals by making the gradient larger there.
    length_ratio, z_scale : (1,) float
        Parameters of the smoothness prior.
    """
    precision = coefficient_precision(basis, length_ratio, z_scale)
    noise = scaled_noise(stack.noise, stack.reach)
    count = np.maximum(np.count_nonzero(weight, axis=1), 1)
    # Half a standard deviation of the samples' mean, or the rounding of exact contacts, rad.
    tolerance, first = np.maximum(1e-9, 0.5 * noise / np.sqrt(count)), stack
    # 1 % of random shapes need more than twelve frames, none of 2,000 needed sixty. Where full
    # rotations do not converge they overshoot: half of them do.
    for number in range(60):
        fraction = 1.0 if number < 12 else 0.5
        stack, samples = reframed(stack, basis, mean, fraction)
        system = samples.system(basis, weight)
        equations = system.equations()
        mean = map_coefficients(equations, noise, precision)
        # The terms x, y and x y; that of x y is about ten times less certain.
        slopes = np.abs(mean[:, [1, 2, 4]] / np.array([1.0, 1.0, 10.0])).max(axis=1)
        if slopes[0] < tolerance[0] or diverged(first, stack):
            break
    own = stack, basis, equations, length_ratio, z_scale, mean
    return _solution(*own, system, noise, precision)


def diverged(before: Stack, after: Stack) -> bool:
    """Whether a frame moved by 60 degrees, or half a radius, from the first polynomial."""
    shift = after.origin - before.origin
    upright = np.einsum("mi,mi->m", before.axes[:, 2], after.axes[:, 2])
    near = (shift * shift).sum(axis=1) < (0.5 * before.reach) ** 2
    # The comparisons are false for NaN, which therefore counts as diverged.
    return not ((upright > 0.5) & near).all()


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
