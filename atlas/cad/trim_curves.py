"""Arcs that bound the cells of patches, each a polynomial curve through Chebyshev points.

Two kin patches meet on the plane where their powers are equal: there the arc runs midway
between them. Where a patch has no neighbour its cell ends at its own core, a sphere.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.cad.bezier import chebyshev_points
from touchatlas.patch.geometry.patch import Patch

ARC_DEGREE = 8
_NEWTON_STEPS, _END_STEPS = 6, 20
# Slope of a patch along a line below which Newton's step on it is held back.
_LEAST_SLOPE = 0.2
_RIM_SPAN = np.pi / 4.0


@dataclass(frozen=True, eq=False)
class SharedCurve:
    """The whole curve in which two patches meet, a height over a chord in its plane.

    Parameters
    ----------
    patches : pair of Patch
    base : (3,) float, length, world
        Where the plane of equal power cuts the line of the two centres.
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
        """(n,) height over the chord, midway between the two patches, at abscissas (n,)."""
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

        There s^2 + lift(s)^2 is the squared half chord: solved by fixed points.
        """
        s = side * np.sqrt(self.half_square)
        for _ in range(_END_STEPS):
            s = side * np.sqrt(max(self.half_square - self.lift(np.array([s]))[0] ** 2, 0.0))
        return self.at(np.array([s]))[0]

    def arc(self, start, end) -> np.ndarray:
        """(ARC_DEGREE + 1, 3) points of the curve from start to end, both given exactly.

        What the ends are off the curve, no more than the patches are apart, is shared out
        linearly.
        """
        share = chebyshev_points(ARC_DEGREE)
        first, last = self.abscissa(start), self.abscissa(end)
        points = self.at(first + (last - first) * share)
        return _tied(points, share, start, end)


def shared_curve(first: Patch, second: Patch, sites, powers) -> SharedCurve:
    """The curve in which two kin patches meet whose cores are balls about ``sites`` (2, 3) of
    squared radii ``powers`` (2,)."""
    offset = sites[1] - sites[0]
    square = offset @ offset
    share = 0.5 * (1.0 + (powers[0] - powers[1]) / square)
    across = first.frame.normal + second.frame.normal
    across = across - (across @ offset) / square * offset
    across = across / np.sqrt(across @ across)
    along = np.cross(across, offset / np.sqrt(square))
    base = sites[0] + share * offset
    return SharedCurve((first, second), base, along, across, float(powers[0] - share**2 * square))


def rim_arcs(patch: Patch, power: float, start=None, end=None) -> list[np.ndarray]:
    """Arcs (ARC_DEGREE + 1, 3), world, of the rim of a core, counter-clockwise from start to end.

    Parameters
    ----------
    patch : Patch
    power : float, length^2
        Squared core radius.
    start, end : (3,) float, world, optional
        On the rim, or a little off it: the radius then changes linearly with the angle, and
        what they are off the patch is shared out. The whole rim without them.
    """
    if start is None:
        angles, squares = (0.0, 2.0 * np.pi), (power, power)
    else:
        ends = patch.frame.to_local(np.array([start, end]))
        first, last = np.arctan2(ends[:, 1], ends[:, 0])
        angles = (first, last if last > first else last + 2.0 * np.pi)
        squares = (ends * ends).sum(axis=1)
    count = int(np.ceil((angles[1] - angles[0]) / _RIM_SPAN))
    share = (np.arange(count)[:, None] + chebyshev_points(ARC_DEGREE)).ravel() / count
    angle = angles[0] + (angles[1] - angles[0]) * share
    square = squares[0] + (squares[1] - squares[0]) * share
    points = _on_sphere(patch, angle, square)
    closed = points[:1]
    points = _tied(points, share, start, end) if start is not None else points
    points = points.reshape(count, ARC_DEGREE + 1, 3)
    # Pieces share their ends bit for bit.
    points[1:, 0] = points[:-1, -1]
    if start is None:
        points[-1, -1] = closed
    return list(points)


def _on_sphere(patch: Patch, angle, square) -> np.ndarray:
    """(n, 3) points of a patch at given angles and squared distances from its origin, world.

    Newton's method for the elevation on each meridian of the sphere, which works upright too.
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


def _tied(points, share, start, end) -> np.ndarray:
    """Points (n, 3) moved so that the ends are exact, the change linear in ``share`` (n,)."""
    moved = points + np.outer(1.0 - share, start - points[0]) + np.outer(share, end - points[-1])
    moved[0], moved[-1] = start, end
    return moved
