"""Implicit functions of the built-in objects: value, gradient and Hessian, negative inside."""

from collections.abc import Callable

import numpy as np

# points (n, 3) -> value (n,), gradient (n, 3), Hessian (n, 3, 3)
Field = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def quadric_with_bumps(half_axes, centres=(), widths=(), amplitudes=()) -> Field:
    """sum (x/a)^2 - 1 + sum A exp(-|x - c|^2 / (2 w^2)): A > 0 dents, A < 0 swells."""
    weight = np.asarray(half_axes, dtype=float) ** -2.0
    centres = np.asarray(centres, dtype=float).reshape(-1, 3)
    inverse = np.asarray(widths, dtype=float) ** -2.0
    amplitudes = np.asarray(amplitudes, dtype=float)

    def field(points):
        value = (points * points) @ weight - 1.0
        gradient = 2.0 * points * weight
        hessian = np.broadcast_to(np.diag(2.0 * weight), (len(points), 3, 3)).copy()
        if len(centres):
            offset = points[:, None] - centres
            bump = amplitudes * np.exp(-0.5 * (offset * offset).sum(axis=2) * inverse)
            slope = bump * inverse
            value = value + bump.sum(axis=1)
            gradient = gradient - (slope[:, :, None] * offset).sum(axis=1)
            hessian += np.einsum("nk,nki,nkj->nij", slope * inverse, offset, offset)
            hessian -= slope.sum(axis=1)[:, None, None] * np.eye(3)
        return value, gradient, hessian

    return field


def torus(major: float, minor: float) -> Field:
    """(rho - a)^2 + z^2 - b^2 with rho the distance from the z axis."""

    def field(points):
        x, y, z = points.T
        # On the axis itself the gradient has no direction; any small distance will do.
        rho = np.maximum(np.hypot(x, y), 1e-9 * major)
        value = (rho - major) ** 2 + z * z - minor**2
        flat = np.stack([x, y, np.zeros_like(x)], axis=1)
        share = major / rho
        gradient = 2.0 * (1.0 - share)[:, None] * flat
        gradient[:, 2] = 2.0 * z
        hessian = 2.0 * (share / rho**2)[:, None, None] * flat[:, :, None] * flat[:, None, :]
        hessian[:, 0, 0] += 2.0 * (1.0 - share)
        hessian[:, 1, 1] += 2.0 * (1.0 - share)
        hessian[:, 2, 2] = 2.0
        return value, gradient, hessian

    return field


def bottle(body: float, neck: float, half_height: float, shoulder: float, softness: float) -> Field:
    """rho^2 - s(z)^2 (1 - (z/h)^8): s falls from body to neck radius at height ``shoulder``."""

    def squared_profile(z):
        """P, P', P'' of rho^2 = P(z)."""
        t = np.tanh((z - shoulder) / softness)
        half = 0.5 * (neck - body)
        bell = 1.0 - t * t
        s, s1 = body + half * (1.0 + t), half * bell / softness
        s2 = -2.0 * half * t * bell / softness**2
        u = z / half_height
        c, c1, c2 = 1.0 - u**8, -8.0 * u**7 / half_height, -56.0 * u**6 / half_height**2
        q, q1, q2 = s * s, 2.0 * s * s1, 2.0 * (s1 * s1 + s * s2)
        return q * c, q1 * c + q * c1, q2 * c + 2.0 * q1 * c1 + q * c2

    def field(points):
        x, y, z = points.T
        p, p1, p2 = squared_profile(z)
        gradient = np.stack([2.0 * x, 2.0 * y, -p1], axis=1)
        hessian = np.zeros((len(points), 3, 3))
        hessian[:, 0, 0] = hessian[:, 1, 1] = 2.0
        hessian[:, 2, 2] = -p2
        return x * x + y * y - p, gradient, hessian

    return field


def rounded_box(half_sides, fillet: float) -> Field:
    """Signed distance of a box whose edges are rounded; fillet 0 leaves them sharp."""
    inner = np.asarray(half_sides, dtype=float) - fillet

    def field(points):
        sign = np.where(points < 0.0, -1.0, 1.0)
        beyond = np.abs(points) - inner
        deepest = beyond.argmax(axis=1)
        on_face = (np.maximum(beyond, 0.0) > 0.0).sum(axis=1) <= 1
        if fillet == 0.0:
            on_face[:] = True
        rows = np.arange(len(points))
        out = np.maximum(beyond, 0.0)
        length = np.maximum(np.sqrt((out * out).sum(axis=1)), np.finfo(float).tiny)
        value = np.where(on_face, beyond[rows, deepest], length) - fillet
        face_normal = np.zeros_like(points)
        face_normal[rows, deepest] = 1.0
        direction = np.where(on_face[:, None], face_normal, out / length[:, None])
        active = (out > 0.0).astype(float)
        bend = active[:, :, None] * np.eye(3) - direction[:, :, None] * direction[:, None, :]
        hessian = np.where(on_face[:, None, None], 0.0, bend / length[:, None, None])
        flip = sign[:, :, None] * sign[:, None, :]
        return value, sign * direction, hessian * flip

    return field


def polyhedron(normals, levels) -> Field:
    """max over planes of n . x - b: an intersection of half spaces, with unit normals n."""
    normals, levels = np.asarray(normals, dtype=float), np.asarray(levels, dtype=float)

    def field(points):
        heights = points @ normals.T - levels
        highest = heights.argmax(axis=1)
        value = heights[np.arange(len(points)), highest]
        return value, normals[highest], np.zeros((len(points), 3, 3))

    return field


def union(first: Field, second: Field) -> Field:
    """The lower of two fields: both bodies together."""

    def field(points):
        parts = zip(first(points), second(points), strict=True)
        lower = None
        out = []
        for a, b in parts:
            lower = a <= b if lower is None else lower
            out.append(np.where(lower.reshape(-1, *[1] * (a.ndim - 1)), a, b))
        return tuple(out)

    return field
