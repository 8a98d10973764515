"""Piece: one polynomial surface with the covariance of its coefficients, and what it says of
points."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from touchatlas.atlas.pieces.kinds import (
    Kind,
    hessians,
    outward_change,
    terms_at,
    value_gradient_terms,
)

# Least gradient of F over that at the origin: below it the zero set is near a point where it
# crosses itself, as two faces of a cube do that are one quadric. Doubled, half an ellipsoid is not
# one piece.
_LEAST_GRADIENT = 0.3
# Least part of the normal within a sampling plane, no unit: below it the plane is almost tangent
# to the surface, and its contour says nothing of the normal. Doubled, oblique contours are lost.
_LEAST_IN_PLANE = 0.3
# Difference for slopes of monomials, in scales. Doubled, the error of a central difference is four
# times 1e-8.
_DIFFERENCE = 1e-4
# Along a line their F has degree two.
_OF_DEGREE_TWO = (Kind.SPHERE, Kind.CYLINDER, Kind.QUADRIC)
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Piece:
    """A surface F = 0 in a frame: of a cone or torus the distance, of others z - φ(x, y, z).

    Parameters
    ----------
    kind : Kind
    origin : (3,) float, length, world
        On or near the surface.
    axes : (3, 3) float, unit rows, world
        The third is the outward normal at the origin.
    scale : float, length
        Unit of the scaled coordinates.
    coefficients : (t,) float, no unit
        Of φ, or of a cone or torus, in scaled coordinates.
    covariance : (t, t) float, no unit
    """

    kind: Kind
    origin: np.ndarray
    axes: np.ndarray
    scale: float
    coefficients: np.ndarray
    covariance: np.ndarray

    @cached_property
    def _to_local(self) -> np.ndarray:
        return self.axes.T / self.scale

    @cached_property
    def _hessian(self) -> np.ndarray:
        return hessians(self.kind, self.coefficients, np.zeros((1, 3)))[0]

    @cached_property
    def _flat(self) -> tuple[float, np.ndarray]:
        """Of a plane, the length of the gradient of F and the unit normal (3,), everywhere."""
        _, gradient, _ = self._terms_at(np.zeros((1, 3)))
        length = _length_of(gradient)
        return float(length[0]), ((gradient / length[:, None]) @ self.axes)[0]

    def scaled(self, points) -> np.ndarray:
        """(n, 3) local coordinates of points (n, 3), over the scale."""
        return (points - self.origin) @ self._to_local

    def at(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), length, and outward unit normal (n, 3) at points (n, 3): along the
        gradient of F, which is exact for all laws but quadrics; of quartics and sextics to first
        order (Taubin 1991)."""
        return self._along_gradient(points)[:2]

    def predicted(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Signed distance (n,), unit normal (n, 3) and variance of the distance (n,), length^2.

        The variance is infinite where the gradient of F is so small that the surface is about to
        cross itself.
        """
        distance, normals, length, terms = self._along_gradient(points)
        used = terms[: self.kind.terms]
        variance = ((self.covariance @ used) * used).sum(axis=0) * (self.scale / length) ** 2
        # Rounding may leave a covariance with a tiny negative eigenvalue.
        variance = np.where(length < _LEAST_GRADIENT, np.inf, np.maximum(variance, 0.0))
        return distance, normals, variance

    def values(self, points) -> np.ndarray:
        """(n, 5) these three at points (n, 3), side by side."""
        return np.column_stack(self.predicted(points))

    def level(self, points) -> np.ndarray:
        """(n, 4) distance and normal of these values alone."""
        return np.column_stack(self.at(points))

    def distances(self, points) -> np.ndarray:
        """(n,) signed distances of points (n, 3), length."""
        return self.at(points)[0]

    def _terms_at(self, scaled):
        """F (n,), its gradient (n, 3) and terms (s, n) at scaled local points (n, 3)."""
        return value_gradient_terms(self.kind, self.coefficients, scaled)

    def _along_gradient(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Signed distance (n,), unit normal (n, 3), length of the gradient (n,) and terms (s, n)
        at points (n, 3)."""
        scaled = self.scaled(points)
        if self.kind is Kind.PLANE:
            return self._over_plane(scaled)
        value, gradient, terms = self._terms_at(scaled)
        length = _length_of(gradient)
        normals, slope = gradient / length[:, None], length
        if self.kind in _OF_DEGREE_TWO:
            # F(x - t n) = F - t |∇F| + t² n·H n / 2 = 0 at t = 2 F / (|∇F| + √(|∇F|² - 2 F n·H n)).
            bent = np.einsum("ij,ij->i", normals @ self._hessian, normals)
            slope = 0.5 * (length + np.sqrt(np.maximum(length**2 - 2.0 * value * bent, 0.0)))
        return value * self.scale / slope, normals @ self.axes, length, terms

    def _over_plane(self, scaled) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The same of a plane, whose gradient is the same everywhere, at scaled local points."""
        terms, (steep, normal) = terms_at(self.kind, scaled), self._flat
        distance = (scaled[:, 2] - self.coefficients @ terms) * self.scale / steep
        normals = np.empty((len(scaled), 3))
        normals[:] = normal
        return distance, normals, np.full(len(scaled), steep), terms

    def shape_operators(self, points) -> np.ndarray:
        """(n, 3, 3) P H P / |grad F|, 1/length, world, P the projection on the tangent plane: the
        derivative of the unit normal."""
        if self.kind is Kind.PLANE:
            return np.zeros((len(points), 3, 3))
        scaled = self.scaled(points)
        _, gradient, _ = self._terms_at(scaled)
        length = _length_of(gradient)
        normal = gradient / length[:, None]
        project = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        bent = project @ hessians(self.kind, self.coefficients, scaled) @ project
        bent = bent / (length * self.scale)[:, None, None]
        return self.axes.T @ bent @ self.axes

    def bends(self, points) -> np.ndarray:
        """(n,) largest absolute principal curvature at points (n, 3), 1/length."""
        shape = self.shape_operators(points)
        both = np.einsum("ijj->i", shape)
        # (k1 - k2)^2 = 2 (k1^2 + k2^2) - (k1 + k2)^2
        difference = 2.0 * np.einsum("ijk,ijk->i", shape, shape) - both * both
        return np.asarray(0.5 * (np.abs(both) + np.sqrt(np.maximum(difference, 0.0))))

    def slope_variance(self, points, directions) -> np.ndarray:
        """(n,) variance of the derivative of the distance along unit directions (n, 3): that of the
        angle by which the surface may be tilted."""
        scaled, along = self.scaled(points), directions @ self.axes.T
        _, gradient, _ = self._terms_at(scaled)
        square = np.maximum((gradient * gradient).sum(axis=1), _TINY)
        ahead = self._terms_at(scaled + _DIFFERENCE * along)[2]
        behind = self._terms_at(scaled - _DIFFERENCE * along)[2]
        slope = (ahead - behind)[: self.kind.terms] / (2.0 * _DIFFERENCE)
        return ((self.covariance @ slope) * slope).sum(axis=0) / square

    def loosened(self, variance: float) -> "Piece":
        """The same surface, its distance at the origin less sure by a variance, length^2."""
        change = outward_change(self.kind, self.coefficients)
        more = np.outer(change, change) * variance / self.scale**2
        return replace(self, covariance=self.covariance + more)

    def feet(self, points) -> np.ndarray:
        """(n, 3) points moved onto the surface along its normals."""
        for _ in range(2):
            distance, normals = self.at(points)
            points = points - distance[:, None] * normals
        return points


def _length_of(gradient) -> np.ndarray:
    """(n,) lengths of gradients (n, 3), none of them zero."""
    square = np.einsum("ij,ij->i", gradient, gradient)
    return np.asarray(np.maximum(np.sqrt(square), _TINY))


def in_plane_cosines(normals, measured, planes) -> np.ndarray:
    """(n,) cosine between the normals of a piece and those of contours, within the sampling planes.

    A contour shows only the part of the normal in its plane, in which its own lies. Zero where that
    is too small.
    """
    across = np.einsum("ij,ij->i", normals, planes)
    length = np.sqrt(np.maximum(1.0 - across * across, _TINY))
    cosine = np.einsum("ij,ij->i", normals, measured) / length
    return np.where(length > _LEAST_IN_PLANE, cosine, 0.0)
