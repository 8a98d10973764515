"""Patch: a piece of surface with its uncertainty. The atlas is a graph of patches."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchatlas.patch.geometry.curvature import (
    UMBILIC_LIMIT,
    PrincipalCurvatures,
    principal_directions,
)
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    XX,
    XY,
    YY,
    LocalPolynomial,
    derivative_coefficients,
    graph_derivatives,
    monomials,
    shape_operator,
)


@dataclass(frozen=True, eq=False)
class Patch:
    """A piece of surface around a reference point.

    Parameters
    ----------
    id : int
    frame : DarbouxFrame
    polynomial : LocalPolynomial
        Height over the tangent plane of the frame.
    covariance : (t, t) float
        Covariance of the scaled coefficients.
    radius : float, length
        The polynomial is valid within this distance of the origin.
    core : float
        Fraction of the radius within which the patch covers the surface.
    noise_std : float, length
        Standard deviation of the noise of the samples.
    residual_rms : float, length
        Weighted root mean square of the distances of samples from the polynomial. A sample has
        less weight where orders above the degree are expected to exceed the noise.
    count : int
        Number of samples that were used.
    condition : float
        Condition number of the sections that gave the first frame.
    leftover : float
        Standard deviation of the orders above the degree at the radius, over the radius.
    """

    id: int
    frame: DarbouxFrame
    polynomial: LocalPolynomial
    covariance: np.ndarray
    radius: float
    core: float
    noise_std: float
    residual_rms: float
    count: int
    condition: float
    leftover: float = 0.0

    def __repr__(self) -> str:
        k1, k2 = self.curvatures.k1, self.curvatures.k2
        place = ", ".join(f"{x:.5g}" for x in self.frame.origin)
        return f"Patch({self.id} at ({place}), k1={k1:.4g}, k2={k2:.4g}, radius={self.radius:.4g})"

    @cached_property
    def curvatures(self) -> PrincipalCurvatures:
        """Principal curvatures at the frame's origin, with their standard deviations."""
        return curvatures_from_polynomial(self)

    def signed_distance(self, points) -> np.ndarray:
        """(n,) first-order signed distance of world points (n, 3), length: F / norm(grad F),
        F = z - phi.

        It is positive outside and valid within the patch radius. This method, ``normal`` and
        ``deviation`` raise ValueError for points of another shape or not finite.
        """
        value, gradient, _ = self._at(points)
        return self.radius * value / np.sqrt((gradient * gradient).sum(axis=0))

    def normal(self, points) -> np.ndarray:
        """(n, 3) outward unit normals, world, of the patch below or above points (n, 3)."""
        _, gradient, _ = self._at(points)
        return (gradient / np.sqrt((gradient * gradient).sum(axis=0))).T @ self.frame.axes

    def deviation(self, points) -> np.ndarray:
        """(n,) standard deviation of the patch along its normal at points (n, 3), length."""
        _, gradient, terms = self._at(points)
        basis = self.polynomial.basis
        squared_radius = terms[1] ** 2 + terms[2] ** 2
        terms = terms[: basis.size]
        variance = (terms * (self.covariance @ terms)).sum(axis=0)
        variance += self.leftover**2 * squared_radius ** (basis.degree + 1)
        return self.radius * np.sqrt(variance / (gradient * gradient).sum(axis=0))

    def _at(self, points):
        """F (n,), its gradient (3, n) and the monomials (s, n) at world points, scaled."""
        basis = self.polynomial.basis
        x, y, z = self.frame.to_local(points).T / self.radius
        terms = monomials(basis, x, y, z)
        rows = derivative_coefficients(basis, self.polynomial.coefficients, list(GRADIENT))
        phi, px, py, pz = rows @ terms
        return z - phi, np.stack([-px, -py, 1.0 - pz]), terms


def curvatures_from_polynomial(patch: Patch) -> PrincipalCurvatures:
    """Principal curvatures at the origin of a patch's frame, with their standard deviations."""
    basis, mean = patch.polynomial.basis, patch.polynomial.coefficients
    _, *derivatives = mean @ basis.at_origin
    k1, k2, angle = principal_directions(shape_operator(*graph_derivatives(*derivatives)))
    c, s = np.cos(angle), np.sin(angle)
    cosine, sine = c * c - s * s, 2.0 * c * s
    # Derivatives of H, b and c by fxx, fxy, fyy, with k1 = H + b, k2 = H - b; an error of c
    # rotates the directions.
    rows = 0.5 * np.array(
        [[1.0, 0.0, 1.0], [cosine, 2.0 * sine, -cosine], [-sine, 2.0 * cosine, sine]]
    )
    rows = rows @ basis.derivatives[[XX, XY, YY], :, 0] / patch.radius
    spread = rows @ patch.covariance @ rows.T
    half_difference = 0.5 * float(k1 - k2) / patch.radius
    limit = UMBILIC_LIMIT * 0.5 * (spread[1, 1] + spread[2, 2])
    variances = [[1.0, side] @ spread[:2, :2] @ [1.0, side] for side in (1.0, -1.0)]
    direction_std = np.inf
    if half_difference:
        direction_std = float(np.sqrt(spread[2, 2])) / (2.0 * half_difference)
    return PrincipalCurvatures(
        float(k1) / patch.radius,
        float(k2) / patch.radius,
        np.array([[c, s], [-s, c]]) @ patch.frame.axes[:2],
        np.sqrt(np.maximum(variances, 0.0)),
        direction_std,
        bool(half_difference**2 <= limit),
        patch.condition,
    )
