"""Samples in the Darboux frames of their polynomials, linearised there."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.fit.smoothness import LinearSystem
from touchatlas.patch.fit.start import Stack
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    Basis,
    evaluate_batch,
    graph_derivatives,
    monomials,
)


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a stack, linearised at the previous polynomial F = z - phi.

    Regression on noisy coordinates would bias the terms in z. So the monomials are taken at the
    feet of the samples on the previous polynomial, and the rest of each sample goes to the
    right-hand side: the Gauss-Newton method for orthogonal distances.

    Parameters
    ----------
    feet : (1, n, 3) float, scaled, local
    value : (1, n) float, scaled
        F at the samples.
    squared_gradient : (1, n) float
        |grad F|^2 at the samples, within their sampling planes.
    """

    feet: np.ndarray
    value: np.ndarray
    squared_gradient: np.ndarray

    def system(self, basis: Basis, weight) -> LinearSystem:
        """The least-squares problem of the coefficients, with weights (1, n)."""
        x, y, z = self.feet[..., 0], self.feet[..., 1], self.feet[..., 2]
        phi = monomials(basis, x, y, z)[: basis.size].transpose(1, 0, 2)
        return LinearSystem(phi, z + self.value, weight)


def raw_system(stack: Stack, basis: Basis) -> tuple[LinearSystem, np.ndarray]:
    """The problem before any polynomial is known, and all monomials (s, m, n) at the samples."""
    x, y, z = stack.scaled().transpose(2, 0, 1)
    terms = monomials(basis, x, y, z)
    return LinearSystem(terms[: basis.size].transpose(1, 0, 2), z, stack.weight), terms


def reframed(
    stack: Stack, basis: Basis, mean, fraction: float = 1.0, terms=None
) -> tuple[Stack, Samples]:
    """The stack in the Darboux frames of its polynomials (1, t), and its samples there.

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
    """Feet, F and |grad F|^2 of samples for polynomials (1, t), in the frames of the stack."""
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
    # This limits a foot to 4.5 times the distance.
    square = np.maximum(square, 0.05)
    feet = scaled - (value / square)[..., None] * gradient
    return Samples(feet, value, square)


def _darboux_axes(basis: Basis, mean, fraction: float):
    """Axes (1, 3, 3) at the origin of polynomials, their height (1,) and dF/dn (1,) there.

    n are the new normals. The axes are rotated by about a fraction of the angle.
    """
    height, *derivatives = (mean @ basis.at_origin).T
    fx, fy, fxx, fxy, fyy = graph_derivatives(*derivatives)
    # The angle is exact only where the slopes vanish, as they do when the frames converge.
    angle = (0.5 * fraction) * np.arctan2(2.0 * fxy, fxx - fyy)
    # Below a difference of 1e-7 rounding would choose the directions.
    angle = np.where(np.abs(fxx - fyy) + np.abs(2.0 * fxy) > 1e-7, angle, 0.0)
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
