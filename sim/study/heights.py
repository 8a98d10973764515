"""Graphs z = height(x, y) about the origin, in reaches, and their shape there."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Height = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Shape:
    """The surface at one point: outward unit normal (3,) and principal curvatures k1 >= k2."""

    normal: np.ndarray
    k1: float
    k2: float


def graph_shape(height: Height, x: float, y: float, step: float = 5e-3) -> Shape:
    """Normal and principal curvatures of a graph: do Carmo, section 3-3, example 5.

    Derivatives are central differences of fourth order, whose truncation and rounding both are
    below 1e-7 with this step.
    """
    offsets = step * np.arange(-2.0, 3.0)
    d1 = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * step)
    d2 = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * step**2)
    z = height(x + offsets[:, None], y + offsets[None, :])
    fx, fy = d1 @ z[:, 2], z[2] @ d1
    fxx, fyy, fxy = d2 @ z[:, 2], z[2] @ d2, d1 @ z @ d1
    return shape_of(fx, fy, fxx, fxy, fyy)


def shape_of(fx, fy, fxx, fxy, fyy) -> Shape:
    """Normal and principal curvatures of a height with these derivatives: eigenvalues of the second
    fundamental form against the first."""
    first = np.array([[1.0 + fx * fx, fx * fy], [fx * fy, 1.0 + fy * fy]])
    length = np.sqrt(1.0 + fx * fx + fy * fy)
    root = np.linalg.inv(np.linalg.cholesky(first))
    second = np.array([[fxx, fxy], [fxy, fyy]]) / length
    k2, k1 = np.linalg.eigvalsh(root @ second @ root.T)
    return Shape(np.array([-fx, -fy, 1.0]) / length, float(k1), float(k2))


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
