"""Patch: one piece of surface with its uncertainty, the node of the atlas."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.curvature import PrincipalCurvatures
from touchatlas.patch.frame import DarbouxFrame
from touchatlas.patch.polynomial import (
    VALUE,
    LocalPolynomial,
    X,
    Y,
    derivative_coefficients,
    monomials,
)


@dataclass(frozen=True, eq=False)
class Patch:
    """One piece of surface around a reference point.

    Parameters
    ----------
    id : int
    frame : DarbouxFrame
    curvatures : PrincipalCurvatures
        At the frame's origin.
    polynomial : LocalPolynomial
        Height over the tangent plane of the frame.
    covariance : (t, t) float
        Of the scaled coefficients.
    radius : float, length
        The polynomial holds within this distance of the origin.
    outline : (m, 3) float, length, world
        Closed ring on the patch, at the radius to which the patch claims to cover.
    noise_std : float, length
        Of the samples.
    residual_rms : float, length
        Of the samples about the polynomial.
    count : int
        Samples that were used.
    """

    id: int
    frame: DarbouxFrame
    curvatures: PrincipalCurvatures
    polynomial: LocalPolynomial
    covariance: np.ndarray
    radius: float
    outline: np.ndarray
    noise_std: float
    residual_rms: float
    count: int

    def signed_distance(self, points) -> np.ndarray:
        """(n,) first-order signed distance (z - phi)/sqrt(1 + |grad phi|^2), world points.

        Positive outside. To be used within the patch radius.
        """
        height, slope_x, slope_y, z = self._at(points)
        return (z - height) / np.sqrt(1.0 + slope_x**2 + slope_y**2)

    def normal(self, points) -> np.ndarray:
        """(n, 3) outward unit normals, world, of the patch below or above world points."""
        _, slope_x, slope_y, _ = self._at(points)
        normals = np.stack([-slope_x, -slope_y, np.ones_like(slope_x)], axis=-1)
        normals /= np.sqrt((normals**2).sum(axis=-1, keepdims=True))
        return normals @ self.frame.axes

    def deviation(self, points) -> np.ndarray:
        """(n,) standard deviation of the patch along its normal at world points, length."""
        x, y, _ = self.frame.to_local(points).T / self.radius
        terms = monomials(self.polynomial.basis, x, y)
        variance = (terms * (self.covariance @ terms)).sum(axis=0)
        _, slope_x, slope_y, _ = self._at(points)
        return self.radius * np.sqrt(variance / (1.0 + slope_x**2 + slope_y**2))

    def _at(self, points):
        """Height, slopes and z (n,) at world points."""
        x, y, z = self.frame.to_local(points).T
        terms = monomials(self.polynomial.basis, x / self.radius, y / self.radius)
        rows = derivative_coefficients(
            self.polynomial.basis, self.polynomial.coefficients, [VALUE, X, Y]
        )
        height, slope_x, slope_y = rows @ terms
        return self.radius * height, slope_x, slope_y, z
