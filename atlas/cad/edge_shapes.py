"""Curves of edges: straight lines, arcs of circles, and cubic splines through points of both faces.

A spline is in B-spline form, which STEP files store. Its parameter is the length along its chords.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from touchatlas.atlas.cad.face_layout import NotWritten
from touchatlas.atlas.cad.law_surfaces import LawSurface
from touchatlas.atlas.cad.shared_points import LEAST_SINE, shared_points
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Points between two of a spline at which it is compared with its faces. Doubled, nothing changes.
_BETWEEN = 4
# Least and most points of a spline; from the one to the other the error falls to a millionth.
# Doubled, files are larger.
_FEWEST, _MOST = 9, 300
# Points at which arcs and lines are compared with faces, and traces are made. Doubled, the largest
# error is found to 0.1 % instead of 0.5 %.
_SAMPLED = 33
# Error of a trace that is a straight line, in its own extent. Doubled, nothing changes.
_STRAIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line between two points (3,)."""

    start: np.ndarray
    end: np.ndarray

    @property
    def last(self) -> float:
        """The parameter at the end, length; it is 0 at the start."""
        return float(np.linalg.norm(self.end - self.start))

    def points(self, parameter) -> np.ndarray:
        return self.start + np.outer(np.asarray(parameter) / self.last, self.end - self.start)


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc of a circle, or all of it, counter-clockwise about the third axis from the first.

    Parameters
    ----------
    centre : (3,) float, length
    axes : (3, 3) float, unit rows
    radius : float, length
    last : float, rad
        The parameter at the end, up to 2 pi.
    """

    centre: np.ndarray
    axes: np.ndarray
    radius: float
    last: float

    def points(self, parameter) -> np.ndarray:
        circle = np.column_stack([np.cos(parameter), np.sin(parameter)])
        return self.centre + self.radius * circle @ self.axes[:2]


@dataclass(frozen=True, eq=False)
class Spline:
    """A spline with its ``curve``, whose parameter goes from 0 to ``last``."""

    curve: BSpline

    @property
    def last(self) -> float:
        return float(self.curve.t[-1])

    def points(self, parameter) -> np.ndarray:
        return np.asarray(self.curve(parameter))


Curve = Line | Arc | Spline


def parameters(curve: Curve) -> np.ndarray:
    """(k,) evenly spaced parameters at which a curve is compared with its faces."""
    count = _BETWEEN * len(curve.curve.c) if isinstance(curve, Spline) else _SAMPLED
    return np.linspace(0.0, curve.last, count)


def curve_between(surfaces: list[LawSurface], points, exact: float) -> Curve:
    """The curve through points (k, 3) that lie on two faces, or on one at a rim.

    A line or an arc where all points are within ``exact`` (length) of it, else a spline that is
    within ``exact`` of both faces, if 300 points suffice. The ends are kept.
    """
    closed = np.array_equal(points[0], points[-1])
    if not closed and _off_line(points) <= exact:
        return Line(points[0], points[-1])
    circle = _circle(surfaces, points, exact)
    return circle if circle is not None else _spline(surfaces, points, exact)


def _off_line(points) -> float:
    """Largest distance of points (k, 3) from the line between the first and the last, length."""
    along = points[-1] - points[0]
    along = along / np.sqrt(along @ along)
    offset = points - points[0]
    offset = offset - np.outer(offset @ along, along)
    return float(np.sqrt((offset * offset).sum(axis=1)).max())


def _circle(surfaces, points, exact: float) -> Arc | None:
    """The arc through the points in which a plane cuts a sphere, or a cylinder across its axis, or
    two spheres intersect."""
    flat = [s for s in surfaces if s.kind == "plane"]
    rounds = [s for s in surfaces if s.periodic]
    if not flat and [s.kind for s in rounds] == ["sphere", "sphere"]:
        flat = [_radical_plane(*rounds)]
    if not flat or not rounds:
        return None
    normal, other = flat[0].axes[2], rounds[0]
    height = flat[0].at(other.origin[None])[0][0]
    if other.kind == "sphere":
        centre, square = other.origin - height * normal, other.radius**2 - height**2
    else:
        cosine = other.axes[2] @ normal
        if abs(cosine) < LEAST_SINE:
            return None
        along = -height / cosine
        centre = other.origin + along * other.axes[2]
        square = (other.radius + along * np.tan(other.half_angle)) ** 2
    if square <= 0.0:
        return None
    return _arc(centre, normal, float(np.sqrt(square)), points, exact)


def _radical_plane(first: LawSurface, second: LawSurface) -> LawSurface:
    """The plane in which two spheres intersect."""
    offset = second.origin - first.origin
    square = offset @ offset
    along = 0.5 + (first.radius**2 - second.radius**2) / (2.0 * square)
    middle = first.origin + along * offset
    return LawSurface(
        "plane", middle, first.about(offset, any_tangent(offset / np.sqrt(square))).axes
    )


def _arc(centre, normal, radius: float, points, exact: float) -> Arc | None:
    """The arc from the first to the last of points (k, 3); None where they are not on it."""
    offset = points - centre
    away = np.hypot(np.linalg.norm(cross(offset, normal), axis=1) - radius, offset @ normal)
    if away.max() > exact:
        return None
    x = offset[0] - (offset[0] @ normal) * normal
    x = x / np.sqrt(x @ x)
    y = cross(normal, x)
    angle = np.unwrap(np.arctan2(offset @ y, offset @ x))
    if np.array_equal(points[0], points[-1]):
        angle[-1] = np.copysign(2.0 * np.pi, angle[-1])
    if angle[-1] < 0.0:
        y, normal = -y, -normal
    return Arc(centre, np.stack([x, y, normal]), radius, float(abs(angle[-1])))


def _spline(surfaces, points, exact: float) -> Spline:
    """The spline through as many points on both faces as it takes."""
    while True:
        curve = _through(surfaces, points)
        if len(surfaces) < 2 and len(points) >= _FEWEST:
            return Spline(curve)
        between = curve(_finer(curve, points))
        moved = shared_points(surfaces, between)
        error = np.sqrt(((moved - between) ** 2).sum(axis=1)).max()
        if (error <= exact and len(points) >= _FEWEST) or 2 * len(points) > _MOST:
            return Spline(curve)
        moved[0], moved[-1] = points[0], points[-1]
        points = moved


def _finer(curve: BSpline, points) -> np.ndarray:
    """(2 k - 1,) parameters of k points and of the middles between them."""
    at = _chords(points)
    return np.interp(np.arange(2 * len(at) - 1) / 2.0, np.arange(len(at)), at)


def _chords(points) -> np.ndarray:
    """(k,) length along the chords of points (k, 3)."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def _through(surfaces, points) -> BSpline:
    """The cubic spline through points (k, 3), along both faces at its ends."""
    at = _chords(points)
    if not (np.diff(at) > 0.0).all():
        raise NotWritten("points of an edge coincide")
    if len(points) < 4 or len(surfaces) < 2:
        return make_interp_spline(at, points, k=min(3, len(points) - 1))
    ends = points[[0, -1]]
    along = cross(surfaces[0].at(ends)[1], surfaces[1].at(ends)[1])
    length = np.linalg.norm(along, axis=1)
    if length.min() < LEAST_SINE:
        return make_interp_spline(at, points, k=3)
    chord = points[[1, -1]] - points[[0, -2]]
    along *= (np.sign((along * chord).sum(axis=1)) / length)[:, None]
    return make_interp_spline(at, points, k=3, bc_type=([(1, along[0])], [(1, along[1])]))


def trace(curve: Curve, surface: LawSurface) -> BSpline:
    """The curve (n, 2) of parameters of a surface below a curve, of the same parameter."""
    at = np.linspace(0.0, curve.last, 2 * len(parameters(curve)) - 1)
    uv = surface.parameters(curve.points(at))
    if surface.periodic:
        uv[:, 0] = np.unwrap(uv[:, 0])
        uv[:, 0] -= 2.0 * np.pi * np.floor(uv[len(uv) // 2, 0] / (2.0 * np.pi))
    straight = uv[0] + np.outer(at / curve.last, uv[-1] - uv[0])
    if np.abs(uv - straight).max() <= _STRAIGHT * np.abs(uv).max():
        return make_interp_spline(at[[0, -1]], uv[[0, -1]], k=1)
    return make_interp_spline(at, uv, k=3)
