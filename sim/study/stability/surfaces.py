"""Known surfaces about the origin, z outward: graphs of functions, and a ball that folds."""

from collections.abc import Callable

import numpy as np

from touchatlas.sim.study.stability.case import Shape, Truth

Height = Callable[[np.ndarray, np.ndarray], np.ndarray]
# Step of central differences, in reaches: truncation and rounding of second derivatives are then
# both below 1e-7. Doubled, truncation is sixteen times as large.
_STEP = 5e-3
# Offsets, and weights of first and second differences of fourth order over them.
_OFFSETS = _STEP * np.arange(-2.0, 3.0)
_FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * _STEP)
_SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * _STEP**2)
# Points of the truth in a disc, by the golden angle: 4 % of its radius apart.
_COUNT = 300
_RADII = np.sqrt((np.arange(_COUNT) + 0.5) / _COUNT)
_ANGLES = np.arange(_COUNT) * np.pi * (3.0 - np.sqrt(5.0))


def graph_truth(height: Height) -> Truth:
    """The graph z = height(x, y) over the plane; one reach is the unit of length."""

    def around(point, distance: float):
        x = point[0] + distance * _RADII * np.cos(_ANGLES)
        y = point[1] + distance * _RADII * np.sin(_ANGLES)
        points = np.column_stack([x, y, height(x, y)])
        near = ((points - point) ** 2).sum(axis=1) <= distance**2
        # Over a steep place all points may be farther: the nearest ones stand for them.
        return points[near] if near.any() else points[:1]

    def at(point) -> Shape:
        return graph_shape(height, point[0], point[1])

    return Truth(around, at)


def graph_shape(height: Height, x: float, y: float) -> Shape:
    """Normal and principal curvatures of a graph: do Carmo, section 3-3, example 5."""
    z = height(x + _OFFSETS[:, None], y + _OFFSETS[None, :])
    fx, fy = _FIRST @ z[:, 2], z[2] @ _FIRST
    fxx, fyy, fxy = _SECOND @ z[:, 2], z[2] @ _SECOND, _FIRST @ z @ _FIRST
    first = np.array([[1.0 + fx * fx, fx * fy], [fx * fy, 1.0 + fy * fy]])
    length = np.sqrt(1.0 + fx * fx + fy * fy)
    root = np.linalg.inv(np.linalg.cholesky(first))
    second = np.array([[fxx, fxy], [fxy, fyy]]) / length
    k2, k1 = np.linalg.eigvalsh(root @ second @ root.T)
    return Shape(np.array([-fx, -fy, 1.0]) / length, float(k1), float(k2))


def ball_truth(radius: float) -> Truth:
    """The ball whose highest point is the origin, all of it."""
    centre = np.array([0.0, 0.0, -radius])

    def around(point, distance: float):
        normal = (point - centre) / np.linalg.norm(point - centre)
        # A chord c spans the height c^2 / (2 radius): even in area by Archimedes.
        chord = min(distance, 2.0 * radius) * _RADII
        drop = chord**2 / (2.0 * radius)
        across = np.sqrt(np.maximum(chord**2 - drop**2, 0.0))
        side = np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0])
        side /= np.linalg.norm(side)
        flat = np.outer(across * np.cos(_ANGLES), side)
        flat += np.outer(across * np.sin(_ANGLES), np.cross(normal, side))
        return centre + flat + np.outer(radius - drop, normal)

    def at(point) -> Shape:
        outward = (point - centre) / np.linalg.norm(point - centre)
        return Shape(outward, -1.0 / radius, -1.0 / radius)

    return Truth(around, at)


def quadric(k1: float, k2: float, angle: float = 0.0) -> Height:
    """z = (k1 u^2 + k2 v^2)/2 with u at an angle from x."""
    c, s = np.cos(angle), np.sin(angle)
    return lambda x, y: 0.5 * (k1 * (c * x + s * y) ** 2 + k2 * (c * y - s * x) ** 2)


def wavy(rng: np.random.Generator, length: float = 2.5, bend: float = 0.4) -> Height:
    """Sum of five sines less their tangent plane at the origin: smooth, and no polynomial.

    ``length`` is the inverse of the waves' typical wave number, ``bend`` the typical curvature
    at the origin, both in reaches.
    """
    waves = rng.normal(size=(5, 2)) / length
    phase = rng.uniform(0.0, 2.0 * np.pi, 5)
    size = bend * length**2 * rng.normal(size=5) / np.sqrt(5.0)
    sine, cosine = np.sin(phase), np.cos(phase)

    def height(x, y):
        along = np.multiply.outer(x, waves[:, 0]) + np.multiply.outer(y, waves[:, 1])
        return (np.sin(along + phase) - sine - cosine * along) @ size

    # Arrays broadcast first, because the outer product would not.
    return lambda x, y: height(*np.broadcast_arrays(x, y))


def crease(distance: float, angle: float, direction: float) -> Height:
    """A plane that falls by an angle (rad) beyond a straight edge at a distance from the origin."""
    c, s, slope = np.cos(direction), np.sin(direction), np.tan(angle)
    return lambda x, y: -slope * np.maximum(c * x + s * y - distance, 0.0)


def total(*heights: Height) -> Height:
    """The sum of heights."""
    return lambda x, y: sum((h(x, y) for h in heights), np.zeros(np.broadcast(x, y).shape))
