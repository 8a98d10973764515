"""Trim curves: the arcs that bound the cells of patches, polynomials through Chebyshev points.

Two sheet neighbours meet in their radical plane, and the arc runs there midway between them. Where
a patch has no neighbour its cell ends at the rim of its own core, on a sphere.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.cad.bezier import chebyshev_points
from touchatlas.patch.geometry.patch import Patch

# Degree of an arc. A circle's arc that turns by 45 degrees is missed by 1e-11 of its radius;
# doubled, by rounding alone.
ARC_DEGREE = 8
# Steps of Newton's method onto a patch, each of which squares the error, and fixed-point steps to
# the end of a curve. Doubled, nothing changes beyond rounding.
_NEWTON_STEPS, _END_STEPS = 6, 20
# Least slope of a patch along a line, no unit, with which a Newton step is taken: it limits the
# step where the patch is almost parallel to the line. Doubled, steps on steep patches fall short.
_LEAST_SLOPE = 0.2
# Largest angle of one arc of a rim, rad: see the degree. Doubled, the error is 500 times as large.
_RIM_SPAN = np.pi / 4.0


@dataclass(frozen=True, eq=False)
class SharedCurve:
    """The whole curve in which two patches meet, as a height over a chord in the radical plane.

    Parameters
    ----------
    patches : pair of Patch
    base : (3,) float, length, world
        Where the radical plane cuts the line between the two sites.
    along, across : (3,) float, unit, world
        Axes of the plane; seen from outside, ``along`` runs counter-clockwise around the
        first patch, and ``across`` points outward.
    half_square : float, length^2
        Square of half the chord in which the two cores meet.
    """

    patches: tuple[Patch, Patch]
    base: np.ndarray
    along: np.ndarray
    across: np.ndarray
    half_square: float

    def lift(self, abscissa) -> np.ndarray:
        """(n,) height over the chord midway between the two patches, at abscissas (n,), length."""
        base = self.base + np.multiply.outer(abscissa, self.along)
        low, high = (_lift(patch, base, self.across) for patch in self.patches)
        return 0.5 * (low + high)

    def at(self, abscissa) -> np.ndarray:
        """(n, 3) points of the curve, world."""
        lift = self.lift(abscissa)
        return (
            self.base
            + np.multiply.outer(abscissa, self.along)
            + np.multiply.outer(lift, self.across)
        )

    def abscissa(self, point) -> float:
        """Of a point, along the chord."""
        return float((point - self.base) @ self.along)

    def free_end(self, side: int) -> np.ndarray:
        """(3,) where the curve leaves both cores, at the end -1 or 1 of the chord.

        There s^2 + lift(s)^2 is the squared half chord, which is solved by fixed-point iteration.
        """
        s = side * np.sqrt(self.half_square)
        for _ in range(_END_STEPS):
            s = side * np.sqrt(max(self.half_square - self.lift(np.array([s]))[0] ** 2, 0.0))
        return self.at(np.array([s]))[0]

    def arc(self, start, end) -> np.ndarray:
        """(ARC_DEGREE + 1, 3) points of the curve from start to end, both given exactly.

        The offsets of the ends from the curve, no more than the gap between the patches, are spread
        linearly over the arc.
        """
        parameter = chebyshev_points(ARC_DEGREE)
        first, last = self.abscissa(start), self.abscissa(end)
        points = self.at(first + (last - first) * parameter)
        return _with_ends(points, parameter, start, end)


def shared_curve(first: Patch, second: Patch, sites, weights) -> SharedCurve:
    """The curve in which two sheet neighbours meet, by their sites (2, 3), length, world, and
    weights (2,), length^2."""
    offset = sites[1] - sites[0]
    square = offset @ offset
    parameter = 0.5 * (1.0 + (weights[0] - weights[1]) / square)
    across = first.frame.normal + second.frame.normal
    across = across - (across @ offset) / square * offset
    across = across / np.sqrt(across @ across)
    along = np.cross(across, offset / np.sqrt(square))
    base = sites[0] + parameter * offset
    half_square = float(weights[0] - parameter**2 * square)
    return SharedCurve((first, second), base, along, across, half_square)


def rim_arcs(patch: Patch, weight: float, start=None, end=None) -> list[np.ndarray]:
    """Arcs (ARC_DEGREE + 1, 3), world, of the rim of a core, counter-clockwise from start to end.

    Parameters
    ----------
    patch : Patch
    weight : float, length^2
        Squared core radius.
    start, end : (3,) float, length, world, optional
        Points on the rim; without them the arcs make up the whole rim. Where they are off the rim,
        the radius changes linearly with the angle, and their offsets from the patch are spread
        linearly over the arcs.
    """
    if start is None:
        angles, squares = (0.0, 2.0 * np.pi), (weight, weight)
    else:
        ends = patch.frame.to_local(np.array([start, end]))
        first, last = np.arctan2(ends[:, 1], ends[:, 0])
        angles = (first, last if last > first else last + 2.0 * np.pi)
        squares = (ends * ends).sum(axis=1)
    count = int(np.ceil((angles[1] - angles[0]) / _RIM_SPAN))
    parameter = (np.arange(count)[:, None] + chebyshev_points(ARC_DEGREE)).ravel() / count
    angle = angles[0] + (angles[1] - angles[0]) * parameter
    square = squares[0] + (squares[1] - squares[0]) * parameter
    points = _on_sphere(patch, angle, square)
    points = _with_ends(
        points, parameter, *((points[0], points[0]) if start is None else (start, end))
    )
    points = points.reshape(count, ARC_DEGREE + 1, 3)
    # Arcs that follow each other share an end bit for bit.
    points[1:, 0] = points[:-1, -1]
    return list(points)


def _on_sphere(patch: Patch, angle, square) -> np.ndarray:
    """(n, 3) points of a patch at given angles and squared distances from its origin, world.

    Newton's method finds the elevation on each meridian of the sphere, also where the patch is
    upright.
    """
    radius, elevation = np.sqrt(square), np.zeros(len(angle))
    ray = np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    for _ in range(_NEWTON_STEPS):
        c, s = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
        points = patch.frame.to_world(radius[:, None] * (c * ray + s * up))
        rise = (c * up - s * ray) @ patch.frame.axes
        slope = np.maximum((patch.normal(points) * rise).sum(axis=1), _LEAST_SLOPE)
        elevation = elevation - patch.signed_distance(points) / (slope * radius)
    c, s = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
    return patch.frame.to_world(radius[:, None] * (c * ray + s * up))


def _lift(patch: Patch, base, across) -> np.ndarray:
    """(n,) distances from points (n, 3) along a direction (3,) to a patch, by Newton's method."""
    lift = np.zeros(len(base))
    for _ in range(_NEWTON_STEPS):
        points = base + lift[:, None] * across
        slope = np.maximum(patch.normal(points) @ across, _LEAST_SLOPE)
        lift = lift - patch.signed_distance(points) / slope
    return lift


def _with_ends(points, parameter, start, end) -> np.ndarray:
    """Points (n, 3) moved so that the ends are exact, by an offset linear in ``parameter`` (n,)."""
    first, last = start - points[0], end - points[-1]
    moved = points + np.outer(1.0 - parameter, first) + np.outer(parameter, last)
    moved[0], moved[-1] = start, end
    return moved
