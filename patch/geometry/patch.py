"""Patch: one piece of surface with its uncertainty, the node of the atlas."""

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
    evaluate_batch,
    graph_derivatives,
    monomials,
    shape_operator,
)


@dataclass(frozen=True, eq=False)
class Patch:
    """One piece of surface around a reference point.

    Parameters
    ----------
    id : int
    frame : DarbouxFrame
    polynomial : LocalPolynomial
        Height over the tangent plane of the frame.
    covariance : (t, t) float
        Of the scaled coefficients.
    radius : float, length
        The polynomial holds within this distance of the origin.
    core : float
        Share of the radius to which the patch claims to cover.
    noise_std : float, length
        Of the samples.
    residual_rms : float, length
        Of the samples about the polynomial; one that the degree is not expected to follow
        counts as much less as that is beyond the noise.
    count : int
        Samples that were used.
    condition : float
        Of the sections from which its first frame came.
    leftover : float
        Standard deviation of what the polynomial's degree leaves out at the radius, over the
        radius.
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

    @cached_property
    def curvatures(self) -> PrincipalCurvatures:
        """Principal curvatures at the frame's origin, with their standard deviations."""
        return curvatures_from_polynomial(self)

    @cached_property
    def outline(self) -> np.ndarray:
        """(m, 3) closed ring on the patch at the core radius, length, world."""
        scaled = rings(self.polynomial.basis, self.polynomial.coefficients[None], self.core)[0]
        return self.frame.to_world(scaled * self.radius)

    def signed_distance(self, points) -> np.ndarray:
        """(n,) first-order signed distance F/|grad F| with F = z - phi, world points (n, 3).

        Positive outside. To be used within the patch radius. ValueError for points of another
        shape, or not finite; so do ``normal`` and ``deviation``.
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
        square = terms[1] ** 2 + terms[2] ** 2
        terms = terms[: basis.size]
        variance = (terms * (self.covariance @ terms)).sum(axis=0)
        variance += self.leftover**2 * square ** (basis.degree + 1)
        return self.radius * np.sqrt(variance / (gradient * gradient).sum(axis=0))

    def _at(self, points):
        """F (n,) and its gradient (3, n) at world points, scaled; the monomials there."""
        basis = self.polynomial.basis
        x, y, z = self.frame.to_local(points).T / self.radius
        terms = monomials(basis, x, y, z)
        rows = derivative_coefficients(basis, self.polynomial.coefficients, list(GRADIENT))
        phi, px, py, pz = rows @ terms
        return z - phi, np.stack([-px, -py, 1.0 - pz]), terms


OUTLINE_COUNT, _RING_STEPS = 24, 4
_OUTLINE_ANGLES = np.linspace(0.0, 2.0 * np.pi, OUTLINE_COUNT, endpoint=False)
_OUTLINE = np.stack([np.cos(_OUTLINE_ANGLES), np.sin(_OUTLINE_ANGLES)])


def curvatures_from_polynomial(patch: Patch) -> PrincipalCurvatures:
    """Principal curvatures at the origin of a patch's frame, with their standard deviations."""
    basis, mean = patch.polynomial.basis, patch.polynomial.coefficients
    _, *derivatives = mean @ basis.at_origin
    k1, k2, angle = principal_directions(shape_operator(*graph_derivatives(*derivatives)))
    c, s = np.cos(angle), np.sin(angle)
    cosine, sine = c * c - s * s, 2.0 * c * s
    # H, b and c of fxx, fxy, fyy: k1 and k2 are H + b and H - b, and c turns the directions.
    rows = 0.5 * np.array(
        [[1.0, 0.0, 1.0], [cosine, 2.0 * sine, -cosine], [-sine, 2.0 * cosine, sine]]
    )
    rows = rows @ basis.derivatives[[XX, XY, YY], :, 0] / patch.radius
    spread = rows @ patch.covariance @ rows.T
    half_difference = 0.5 * float(k1 - k2) / patch.radius
    limit = UMBILIC_LIMIT * 0.5 * (spread[1, 1] + spread[2, 2])
    variances = [[1.0, side] @ spread[:2, :2] @ [1.0, side] for side in (1.0, -1.0)]
    turn = float(np.sqrt(spread[2, 2])) / (2.0 * half_difference) if half_difference else np.inf
    return PrincipalCurvatures(
        float(k1) / patch.radius,
        float(k2) / patch.radius,
        np.array([[c, s], [-s, c]]) @ patch.frame.axes[:2],
        np.sqrt(np.maximum(variances, 0.0)),
        turn,
        bool(half_difference**2 <= limit),
        patch.condition,
    )


def rings(basis, means, share: float) -> np.ndarray:
    """(m, 24, 3) scaled local points of polynomials (m, t) at distance ``share`` from zero."""
    shape = (len(means), OUTLINE_COUNT)
    x, y = (np.broadcast_to(share * a, shape) for a in _OUTLINE)
    height = np.zeros(shape)
    for _ in range(_RING_STEPS):
        # No point at that distance is higher; a polynomial that folds would lead ever farther.
        value = evaluate_batch(basis, means, monomials(basis, x, y, height))[0]
        height = np.clip(value, -share, share)
        across = np.sqrt(np.maximum(share**2 - height**2, 0.25 * share**2))
        x, y = across * _OUTLINE[0], across * _OUTLINE[1]
    return np.stack([x, y, height], axis=-1)
