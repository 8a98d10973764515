"""From chosen terms to the patch: polynomial and Darboux frame, each made from the other."""

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

# A frame is level where the slopes of its polynomial at the origin are this share of what the
# noise leaves uncertain of them, or rounding is reached.
_LEVEL, _ROUNDING, _MOST_FRAMES = 0.5, 1e-9, 60
# Where so many whole turns do not level a frame, they overstep; then it turns by halves.
_WHOLE_TURNS, _HALF = 12, 0.5
# Where k1 - k2 is less than this over the radius, rounding would choose the directions.
_NO_DIRECTION = 1e-7
# Coefficients of x, y and x y; the last is many times less certain.
_VANISHING, _VANISH_BELOW = [1, 2, 4], np.array([1.0, 1.0, 10.0])
_LEAST_STRETCH = 0.05


@dataclass(frozen=True, eq=False)
class Solution:
    """m fitted polynomials in their Darboux frames.

    Parameters
    ----------
    stack : Stack
        In the frames; ``reach`` is the patch radius.
    basis : Basis
    equations : NormalEquations
    length_ratio, z_scale : (m,) float
    mean : (m, t) float
    covariance : (m, t, t) float
        With what lack of fit adds.
    residual : (m,) float, scaled
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
        """Some of them."""
        return Solution(
            *(self.stack[rows], self.basis, self.equations[rows], self.length_ratio[rows]),
            *(self.z_scale[rows], self.mean[rows], self.covariance[rows], self.residual[rows]),
        )


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a stack as its polynomials see them: where they are, and how far off.

    Regressing on noisy coordinates would bias the terms in z. So the monomials are taken at the
    feet of the samples on the polynomial as it was, and what keeps a sample off its foot goes to
    the left-hand side: Gauss-Newton for orthogonal distances.

    Parameters
    ----------
    feet : (m, n, 3) float, scaled, local
    lift : (m, n) float, scaled
        F of the polynomial as it was, at the samples.
    stretch : (m, n) float
        Squared gradient of F there, in the plane that the sample is noisy in.
    """

    feet: np.ndarray
    lift: np.ndarray
    stretch: np.ndarray

    def system(self, basis: Basis, weight) -> "LinearSystem":
        """What the coefficients of a polynomial are to solve, with weights (m, n)."""
        x, y, z = self.feet[..., 0], self.feet[..., 1], self.feet[..., 2]
        phi = monomials(basis, x, y, z)[: basis.size].transpose(1, 0, 2)
        return LinearSystem(phi, z + self.lift, weight)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """m weighted least-squares problems: coefficients (t,) @ phi are to be the heights.

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
        """Some of them."""
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

    def misfit(self, mean) -> np.ndarray:
        """(m, n) heights that coefficients (m, t) leave."""
        return self.heights - (mean[:, None] @ self.phi)[:, 0]


def raw_samples(stack: Stack) -> Samples:
    """The samples before any polynomial is known."""
    feet = stack.scaled()
    return Samples(feet, np.zeros(feet.shape[:2]), np.ones(feet.shape[:2]))


def reframed(stack: Stack, basis: Basis, mean, share: float = 1.0) -> tuple[Stack, Samples]:
    """The stack in the Darboux frames of its polynomials (m, t), and its samples there.

    Origins go to the polynomials above the old ones; axes turn by a share of the way.
    """
    scaled = stack.scaled()
    terms = monomials(basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
    phi, px, py, pz = evaluate_batch(basis, mean, terms, GRADIENT)
    value = scaled[..., 2] - phi
    gradient = np.empty_like(scaled)
    gradient[..., 0], gradient[..., 1], gradient[..., 2] = -px, -py, 1.0 - pz
    # A sample is off within its plane, so its foot lies in it too.
    across = stack.across @ stack.axes.transpose(0, 2, 1)
    gradient -= np.einsum("mni,mni->mn", gradient, across)[..., None] * across
    square = np.maximum(np.einsum("mni,mni->mn", gradient, gradient), _LEAST_STRETCH)
    feet = scaled - (value / square)[..., None] * gradient
    local, height, slant = _darboux_axes(basis, mean, share)
    feet[..., 2] -= height[:, None]
    shift = (stack.reach * height)[:, None] * stack.axes[:, 2]
    # The new polynomials have slope 1 along their normal, the old ones have ``slant``.
    samples = Samples(
        feet @ local.transpose(0, 2, 1),
        value / slant[:, None],
        square / (slant * slant)[:, None],
    )
    stack = Stack(
        stack.origin + shift,
        local @ stack.axes,
        stack.offsets - shift[:, None],
        stack.across,
        *(stack.weight, stack.reach, stack.noise, stack.condition),
    )
    return stack, samples


def _darboux_axes(basis: Basis, mean, share: float):
    """Axes (m, 3, 3) at the origin of polynomials, local; height (m,) there, and the slope (m,)
    of F along the new normals. With a share below one the axes turn by about as much less."""
    height, *derivatives = (mean @ basis.at_origin).T
    fx, fy, fxx, fxy, fyy = graph_derivatives(*derivatives)
    # Exact where the slopes vanish, which is where this ends.
    angle = (0.5 * share) * np.arctan2(2.0 * fxy, fxx - fyy)
    angle = np.where(np.abs(fxx - fyy) + np.abs(2.0 * fxy) > _NO_DIRECTION, angle, 0.0)
    gx, gy = share * fx, share * fy
    c, s = np.cos(angle), np.sin(angle)
    local = np.empty((len(mean), 3, 3))
    rise = gx * c + gy * s
    stretch = 1.0 / np.sqrt(1.0 + rise * rise)
    local[:, 0, 0], local[:, 0, 1], local[:, 0, 2] = c * stretch, s * stretch, rise * stretch
    length = np.sqrt(1.0 + gx * gx + gy * gy)
    local[:, 2, 0], local[:, 2, 1], local[:, 2, 2] = -gx / length, -gy / length, 1.0 / length
    local[:, 1] = cross(local[:, 2], local[:, 0])
    return local, height, (1.0 + fx * gx + fy * gy) / length


def solve_in_darboux_frame(
    stack: Stack, basis: Basis, mean, weight, length_ratio, z_scale
) -> Solution:
    """Reframe and refit until the linear and cross terms vanish.

    Parameters
    ----------
    stack : Stack
    basis : Basis
    mean : (m, t) float
        Coefficients in the frames of the stack.
    weight : (m, n) float
        Of the squares of F: those of the distances over the squared gradient of F. It stays as it
        is, for a gradient that may grow where it lowers the weight of misfits would do so.
    length_ratio, z_scale : (m,) float
        Of the smoothness prior.
    """
    precision = coefficient_precision(basis, length_ratio, z_scale)
    noise = scaled_noise(stack.noise, stack.reach)
    count = np.maximum(np.count_nonzero(weight, axis=1), 1)
    level = np.maximum(_ROUNDING, _LEVEL * noise / np.sqrt(count))
    rows, parts, solutions = np.arange(len(length_ratio)), [], []
    for number in range(_MOST_FRAMES):
        share = 1.0 if number < _WHOLE_TURNS else _HALF
        stack, samples = reframed(stack, basis, mean, share)
        system = samples.system(basis, weight[rows])
        equations = system.equations()
        mean = map_coefficients(equations, noise[rows], precision[rows])
        slopes = np.abs(mean[:, _VANISHING] / _VANISH_BELOW).max(axis=1)
        # Each is left alone as soon as it is level, whatever the others need.
        done = (slopes < level[rows]) | (number == _MOST_FRAMES - 1)
        if done.any():
            level_ones = slice(None) if done.all() else done
            i = rows[level_ones]
            parts.append(i)
            solutions.append(
                _solution(
                    *(stack[level_ones], basis, equations[level_ones], length_ratio[i], z_scale[i]),
                    *(mean[level_ones], system[level_ones], noise[i], precision[i]),
                )
            )
            if len(i) == len(rows):
                break
            stack, mean, rows = stack[~done], mean[~done], rows[~done]
    return joined(parts, solutions)


def joined(rows: list[np.ndarray], solutions: list[Solution]) -> Solution:
    """One solution of several, each of which has the given rows of it."""
    if len(solutions) == 1:
        return solutions[0]
    order = np.argsort(np.concatenate(rows))
    return _together(solutions, order)


def _together(records, order):
    """A record whose arrays are those of the records, one after the other, in an order."""
    first = records[0]
    values = []
    for field in fields(first):
        column = [getattr(record, field.name) for record in records]
        if isinstance(column[0], np.ndarray):
            values.append(np.concatenate(column)[order])
        elif is_dataclass(column[0]) and not isinstance(column[0], Basis):
            values.append(_together(column, order))
        else:
            values.append(column[0])
    return type(first)(*values)


def _solution(
    stack, basis, equations, length_ratio, z_scale, mean, system: LinearSystem, noise, precision
) -> Solution:
    """Covariance and residuals of solved normal equations, and coefficients to the last digits.

    Normal equations square the condition: of exact contacts they lose half the digits of what
    only the prior says. One step with the misfit of the samples themselves brings these back
    (iterative refinement: Golub and Van Loan, Matrix Computations, section 3.5.3).
    """
    covariance = posterior(equations.gram, equations.rhs, noise, precision)[1]
    pull = system.phi @ (system.weight * system.misfit(mean))[..., None]
    pull = pull[..., 0] * (noise**-2.0)[:, None] - precision * mean
    mean = mean + (covariance @ pull[..., None])[..., 0]
    freedom = np.maximum(equations.count - effective_parameters(covariance, precision), 1.0)
    left = np.einsum("mn,mn->m", system.weight, system.misfit(mean) ** 2)
    residual = np.sqrt(left / freedom)
    covariance *= np.maximum(1.0, (residual / noise) ** 2)[:, None, None]
    return Solution(stack, basis, equations, length_ratio, z_scale, mean, covariance, residual)


def map_coefficients(equations: NormalEquations, noise, precision):
    """Maximum-a-posteriori coefficients (m, t) for noise (m,) and prior precision (m, t)."""
    matrix = equations.gram.copy()
    diagonal = np.einsum("...ii->...i", matrix)
    diagonal += precision * (noise * noise)[:, None]
    return np.linalg.solve(matrix, equations.rhs[..., None])[..., 0]
