"""The polynomial of chosen terms in its own Darboux frame, each found from the other."""

from dataclasses import dataclass, fields, is_dataclass

import numpy as np

from touchatlas.patch.fit.smoothness import (
    NormalEquations,
    coefficient_precision,
    effective_parameters,
    posterior,
    scaled_noise,
)
from touchatlas.patch.fit.start import Stack
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    Basis,
    evaluate_batch,
    graph_derivatives,
    monomials,
)

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
# Least (k1 - k2) R, no unit: below it rounding would choose the directions. Doubled, umbilics are
# recognised at twice the difference.
_NO_DIRECTION = 1e-7
# Largest move of a frame that has not diverged: the cosine of 60 degrees, and half the radius.
# Doubled, the cosine refuses every tilt, and origins may leave the patch.
_LARGEST_TILT_COSINE, _LARGEST_SHIFT = 0.5, 0.5
# Indices of the coefficients of x, y and x y, which vanish in the Darboux frame, and their
# tolerances relative to each other: that of x y is about ten times less certain.
_VANISHING, _RELATIVE_TOLERANCE = [1, 2, 4], np.array([1.0, 1.0, 10.0])
# Least squared gradient of F within a sampling plane, no unit: it limits a foot to 4.5 times the
# distance. Doubled, feet on surfaces nearly in their sampling plane are nearer.
_LEAST_SQUARED_GRADIENT = 0.05


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


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a stack, linearised at the previous polynomial F = z - phi.

    Regression on noisy coordinates would bias the terms in z. So the monomials are taken at the
    feet of the samples on the previous polynomial, and the rest of each sample goes to the
    right-hand side: the Gauss-Newton method for orthogonal distances.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
    value : (m, n) float, scaled
        F at the samples.
    squared_gradient : (m, n) float
        |grad F|^2 at the samples, within their sampling planes.
    """

    feet: np.ndarray
    value: np.ndarray
    squared_gradient: np.ndarray

    def system(self, basis: Basis, weight) -> "LinearSystem":
        """The least-squares problem of the coefficients, with weights (m, n)."""
        x, y, z = self.feet[..., 0], self.feet[..., 1], self.feet[..., 2]
        phi = monomials(basis, x, y, z)[: basis.size].transpose(1, 0, 2)
        return LinearSystem(phi, z + self.value, weight)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """m weighted least-squares problems: coefficients (t,) @ phi = heights.

    Parameters
    ----------
    phi : (m, t, n) float
        Monomials at the samples.
    heights : (m, n) float, scaled
    weight : (m, n) float
    """

    phi: np.ndarray
    heights: np.ndarray
    weight: np.ndarray

    def __getitem__(self, rows) -> "LinearSystem":
        """Some of the problems."""
        return LinearSystem(self.phi[rows], self.heights[rows], self.weight[rows])

    def equations(self) -> NormalEquations:
        """Normal equations (m, ...)."""
        weighted = self.phi * self.weight[:, None]
        return NormalEquations(
            weighted @ self.phi.transpose(0, 2, 1),
            (weighted @ self.heights[..., None])[..., 0],
            np.einsum("mn,mn,mn->m", self.weight, self.heights, self.heights),
            np.count_nonzero(self.weight, axis=1).astype(float),
        )

    def residuals(self, mean) -> np.ndarray:
        """(m, n) heights less those of coefficients (m, t)."""
        return self.heights - (mean[:, None] @ self.phi)[:, 0]


def raw_system(stack: Stack, basis: Basis) -> tuple[LinearSystem, np.ndarray]:
    """The problem before any polynomial is known, and all monomials (s, m, n) at the samples."""
    x, y, z = stack.scaled().transpose(2, 0, 1)
    terms = monomials(basis, x, y, z)
    return LinearSystem(terms[: basis.size].transpose(1, 0, 2), z, stack.weight), terms


def reframed(
    stack: Stack, basis: Basis, mean, fraction: float = 1.0, terms=None
) -> tuple[Stack, Samples]:
    """The stack in the Darboux frames of its polynomials (m, t), and its samples there.

    Each origin moves along the old normal to the polynomial. Axes rotate by a fraction of the
    angle to the Darboux frame. ``terms`` are the monomials (s, m, n) at the samples, if known.
    """
    linear = _linearised(stack, basis, mean, terms)
    local, height, slope = _darboux_axes(basis, mean, fraction)
    feet = linear.feet
    feet[..., 2] -= height[:, None]
    shift = (stack.reach * height)[:, None] * stack.axes[:, 2]
    # The new F has slope 1 along its normal, the old one has ``slope``.
    samples = Samples(
        feet @ local.transpose(0, 2, 1),
        linear.value / slope[:, None],
        linear.squared_gradient / (slope * slope)[:, None],
    )
    stack = Stack(
        stack.origin + shift,
        local @ stack.axes,
        stack.offsets - shift[:, None],
        stack.across,
        *(stack.weight, stack.reach, stack.noise, stack.condition),
    )
    return stack, samples


def _linearised(stack: Stack, basis: Basis, mean, terms) -> Samples:
    """Feet, F and |grad F|^2 of samples for polynomials (m, t), in the frames of the stack."""
    scaled = stack.scaled()
    if terms is None:
        terms = monomials(basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
    phi, px, py, pz = evaluate_batch(basis, mean, terms, GRADIENT)
    value = scaled[..., 2] - phi
    gradient = np.empty_like(scaled)
    gradient[..., 0], gradient[..., 1], gradient[..., 2] = -px, -py, 1.0 - pz
    # The noise of a sample lies in its sampling plane, so its foot is sought there.
    across = stack.across @ stack.axes.transpose(0, 2, 1)
    gradient -= np.einsum("mni,mni->mn", gradient, across)[..., None] * across
    square = np.einsum("mni,mni->mn", gradient, gradient)
    square = np.maximum(square, _LEAST_SQUARED_GRADIENT)
    feet = scaled - (value / square)[..., None] * gradient
    return Samples(feet, value, square)


def _darboux_axes(basis: Basis, mean, fraction: float):
    """Axes (m, 3, 3) at the origin of polynomials, their height (m,) and dF/dn (m,) there.

    n are the new normals. The axes are rotated by about a fraction of the angle.
    """
    height, *derivatives = (mean @ basis.at_origin).T
    fx, fy, fxx, fxy, fyy = graph_derivatives(*derivatives)
    # The angle is exact only where the slopes vanish, as they do when the frames converge.
    angle = (0.5 * fraction) * np.arctan2(2.0 * fxy, fxx - fyy)
    angle = np.where(np.abs(fxx - fyy) + np.abs(2.0 * fxy) > _NO_DIRECTION, angle, 0.0)
    gx, gy = fraction * fx, fraction * fy
    c, s = np.cos(angle), np.sin(angle)
    local = np.empty((len(mean), 3, 3))
    rise = gx * c + gy * s
    unit = 1.0 / np.sqrt(1.0 + rise * rise)
    local[:, 0, 0], local[:, 0, 1], local[:, 0, 2] = c * unit, s * unit, rise * unit
    length = np.sqrt(1.0 + gx * gx + gy * gy)
    local[:, 2, 0], local[:, 2, 1], local[:, 2, 2] = -gx / length, -gy / length, 1.0 / length
    local[:, 1] = cross(local[:, 2], local[:, 0])
    return local, height, (1.0 + fx * gx + fy * gy) / length


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


def joined(rows: list[np.ndarray], solutions: list[Solution]) -> Solution:
    """One solution of all fits, from solutions of the given rows."""
    if len(solutions) == 1:
        return solutions[0]
    order = np.argsort(np.concatenate(rows))
    return _concatenated(solutions, order)


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


def map_coefficients(equations: NormalEquations, noise, precision):
    """Maximum-a-posteriori coefficients (m, t) for noise (m,) and prior precision (m, t)."""
    matrix = equations.gram.copy()
    diagonal = np.einsum("...ii->...i", matrix)
    diagonal += precision * (noise * noise)[:, None]
    return np.linalg.solve(matrix, equations.rhs[..., None])[..., 0]
