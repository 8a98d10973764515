"""Implicit functions of the built-in objects: value, gradient and Hessian, negative inside."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Field:
    """An implicit function f; f < 0 inside the body, f = 0 on its surface.

    Parameters
    ----------
    first_order : callable
        points (n, 3) -> f (n,) and its gradient (n, 3).
    hessian : callable
        points (n, 3) -> second derivatives (n, 3, 3). Few callers need them, and they cost more
        than value and gradient together.
    """

    first_order: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    hessian: Callable[[np.ndarray], np.ndarray]

    def __call__(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Value (n,), gradient (n, 3) and Hessian (n, 3, 3) at points (n, 3)."""
        return *self.first_order(points), self.hessian(points)


def quadric_with_bumps(half_axes, centres=(), widths=(), amplitudes=()) -> Field:
    """sum (x/a)^2 - 1 + sum A exp(-|x - c|^2 / (2 w^2)): A > 0 dents, A < 0 swells."""
    weight = np.asarray(half_axes, dtype=float) ** -2.0
    # Bumps come first and points last, so that every product runs along contiguous memory.
    centres = np.asarray(centres, dtype=float).reshape(-1, 3).T[:, :, None]
    inverse = np.asarray(widths, dtype=float)[:, None] ** -2.0
    amplitudes = np.asarray(amplitudes, dtype=float)[:, None]

    def bumps(points):
        """Offsets from the centres (3, k, n) and values of the bumps (k, n)."""
        offset = points.T[:, None] - centres
        square = offset * offset
        return offset, amplitudes * np.exp(-0.5 * (square[0] + square[1] + square[2]) * inverse)

    def first_order(points):
        value = (points * points) @ weight - 1.0
        gradient = 2.0 * points * weight
        if centres.size:
            offset, bump = bumps(points)
            value = value + np.ascontiguousarray(bump.T).sum(axis=1)
            gradient = gradient - (bump * inverse * offset).sum(axis=1).T
        return value, gradient

    def hessian(points):
        second = np.broadcast_to(np.diag(2.0 * weight), (len(points), 3, 3)).copy()
        if centres.size:
            offset, bump = bumps(points)
            slope = bump * inverse
            second += np.einsum("kn,ikn,jkn->nij", slope * inverse, offset, offset)
            second -= slope.sum(axis=0)[:, None, None] * np.eye(3)
        return second

    return Field(first_order, hessian)


def torus(major: float, minor: float) -> Field:
    """(rho - a)^2 + z^2 - b^2 with rho the distance from the z axis."""

    def polar(points):
        """rho (n,) and (x, y, 0) (n, 3)."""
        x, y, _ = points.T
        # On the axis itself the gradient has no direction; any small distance will do.
        rho = np.maximum(np.hypot(x, y), 1e-9 * major)
        return rho, np.stack([x, y, np.zeros_like(x)], axis=1)

    def first_order(points):
        z = points[:, 2]
        rho, flat = polar(points)
        gradient = 2.0 * (1.0 - major / rho)[:, None] * flat
        gradient[:, 2] = 2.0 * z
        return (rho - major) ** 2 + z * z - minor**2, gradient

    def hessian(points):
        rho, flat = polar(points)
        ratio = major / rho
        second = 2.0 * (ratio / rho**2)[:, None, None] * flat[:, :, None] * flat[:, None, :]
        second[:, 0, 0] += 2.0 * (1.0 - ratio)
        second[:, 1, 1] += 2.0 * (1.0 - ratio)
        second[:, 2, 2] = 2.0
        return second

    return Field(first_order, hessian)


def bottle(body: float, neck: float, half_height: float, shoulder: float, softness: float) -> Field:
    """rho^2 - s(z)^2 (1 - (z/h)^8): s falls from body to neck radius at height ``shoulder``."""

    half = 0.5 * (neck - body)

    def factors(z):
        """q, q' and c, c' of rho^2 = q(z) c(z)."""
        t = np.tanh((z - shoulder) / softness)
        s, s1 = body + half * (1.0 + t), half * (1.0 - t * t) / softness
        u = z / half_height
        return s * s, 2.0 * s * s1, 1.0 - u**8, -8.0 * u**7 / half_height

    def first_order(points):
        x, y, z = points.T
        q, q1, c, c1 = factors(z)
        gradient = 2.0 * points
        gradient[:, 2] = -(q1 * c + q * c1)
        return x * x + y * y - q * c, gradient

    def hessian(points):
        z = points[:, 2]
        q, q1, c, c1 = factors(z)
        s, t = np.sqrt(q), np.tanh((z - shoulder) / softness)
        s1, s2 = 0.5 * q1 / s, -2.0 * half * t * (1.0 - t * t) / softness**2
        q2, c2 = 2.0 * (s1 * s1 + s * s2), -56.0 * (z / half_height) ** 6 / half_height**2
        second = np.zeros((len(points), 3, 3))
        second[:, 0, 0] = second[:, 1, 1] = 2.0
        second[:, 2, 2] = -(q2 * c + 2.0 * q1 * c1 + q * c2)
        return second

    return Field(first_order, hessian)


def rounded_box(half_sides, fillet: float) -> Field:
    """Signed distance of a box whose edges are rounded. A box of sharp edges is a polyhedron.

    Beside a face only one coordinate lies beyond the inner box; beside an edge or corner several
    do, and the distance is that from the inner box less the fillet.
    """
    inner = np.asarray(half_sides, dtype=float) - fillet

    def distance(points):
        """Distance from the inner box (n,), its direction (n, 3) in the octant of positive
        coordinates, and whether the nearest point lies on a face (n,)."""
        beyond = np.abs(points) - inner
        out = np.maximum(beyond, 0.0)
        deepest, rows = beyond.argmax(axis=1), np.arange(len(points))
        on_face = (out > 0.0).sum(axis=1) <= 1
        length = np.maximum(np.sqrt((out * out).sum(axis=1)), np.finfo(float).tiny)
        face_normal = np.zeros_like(points)
        face_normal[rows, deepest] = 1.0
        direction = np.where(on_face[:, None], face_normal, out / length[:, None])
        return np.where(on_face, beyond[rows, deepest], length), direction, on_face

    def first_order(points):
        length, direction, _ = distance(points)
        return length - fillet, np.where(points < 0.0, -1.0, 1.0) * direction

    def hessian(points):
        length, direction, on_face = distance(points)
        sign = np.where(points < 0.0, -1.0, 1.0)
        active = (np.abs(points) > inner).astype(float)
        second = active[:, :, None] * np.eye(3) - direction[:, :, None] * direction[:, None, :]
        second *= sign[:, :, None] * sign[:, None, :]
        return second * np.where(on_face, 0.0, 1.0 / np.where(on_face, 1.0, length))[:, None, None]

    return Field(first_order, hessian)


def polyhedron(normals, levels) -> Field:
    """max over planes of n . x - b: an intersection of half spaces, with unit normals n."""
    normals, levels = np.asarray(normals, dtype=float), np.asarray(levels, dtype=float)

    def first_order(points):
        heights = points @ normals.T - levels
        highest = heights.argmax(axis=1)
        return heights[np.arange(len(points)), highest], normals[highest]

    return Field(first_order, lambda points: np.zeros((len(points), 3, 3)))


def union(first: Field, second: Field) -> Field:
    """The lower of two fields: both bodies together."""

    def first_order(points):
        (value, gradient), (other, other_gradient) = (
            field.first_order(points) for field in (first, second)
        )
        lower = value <= other
        return np.where(lower, value, other), np.where(lower[:, None], gradient, other_gradient)

    def hessian(points):
        lower = first.first_order(points)[0] <= second.first_order(points)[0]
        return np.where(lower[:, None, None], first.hessian(points), second.hessian(points))

    return Field(first_order, hessian)
