"""Smooth rims: surfaces that meet there are made tangent, and end there.

Measured surfaces are tangent within their errors only. Then they intersect in two curves or in
none, and no CAD kernel finds where one passes into the other.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import approx_fprime
from scipy.spatial.transform import Rotation

from touchatlas.atlas.cad.lawful.law_surfaces import LawSurface
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.faces import Faces
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Points of a rim at which both surfaces shall be one: two fix a line, three a circle. Doubled,
# nothing changes.
_POINTS = 12
# Steps that move such a point onto both surfaces; each about squares its error. Doubled, nothing
# changes.
_STEPS = 3
# Largest distance of surfaces that are tangent, over the extent: a hundredth of the 1e-7 up to
# which the CAD kernel takes points of a body of size 1 for one. Doubled, nothing changes.
_TANGENT = 1e-9
# Numbers that move a surface: shift, rotation, and growth of the radius.
_NUMBERS = 7
# Newton steps that make surfaces tangent; each about squares the error. Doubled, nothing changes.
_ROUNDS = 6
# Change of these numbers by which slopes are found, and least singular value of the slopes, over
# the largest, both no unit: rounding makes 1e-10 of none, and two parallel planes that touch the
# same two cylinders 4e-6. Doubled, nothing changes.
_CHANGE, _LEAST_SLOPE = 1e-7, 1e-7


class Rim(NamedTuple):
    """A rim between two surfaces, by their numbers, with points (k, 3) near it."""

    first: int
    second: int
    points: np.ndarray


class RimPlane(NamedTuple):
    """The plane in which two tangent surfaces touch, and whether they do on the side of its first
    axis only."""

    surface: LawSurface
    is_half: bool


def smooth_rims(faces: Faces, same, surfaces: Mapping[int, LawSurface]) -> list[Rim]:
    """The smooth rims of lawful faces whose surfaces can touch in a line or a circle.

    Parameters
    ----------
    faces : Faces
    same : (f,) int
        The face whose surface each face has.
    surfaces : mapping of int and LawSurface
    """
    out = []
    for edge in faces.edges:
        pair = int(same[edge.first]), int(same[edge.second])
        if edge.kind is not EdgeKind.SMOOTH_RIM or not edge.curves or pair[0] == pair[1]:
            continue
        if rim_plane(*(surfaces[k] for k in pair)) is not None:
            points = np.concatenate(edge.curves)
            out.append(Rim(*pair, points[:: max(1, len(points) // _POINTS)]))
    return out


def rim_plane(first: LawSurface, second: LawSurface) -> RimPlane | None:
    """The plane in which two surfaces touch if they are tangent; None where there is none.

    A sphere touches a cylinder or a cone in a circle across their axis. A plane or another cylinder
    touches them in a line, which lies in one plane with their axis.
    """
    one, other = (first, second) if first.kind in ("cylinder", "cone") else (second, first)
    if one.kind not in ("cylinder", "cone"):
        return None
    axis = one.axes[2]
    if other.kind == "sphere":
        along, x = other.radius * np.sin(one.half_angle), any_tangent(axis)
        circle = np.stack([x, cross(axis, x), axis])
        return RimPlane(LawSurface("plane", other.origin - along * axis, circle), False)
    toward = other.axes[2] if other.kind == "plane" else other.origin - one.origin
    x = toward - (toward @ axis) * axis
    length = float(np.linalg.norm(x))
    if length == 0.0:
        return None
    x = x / length
    sides = one.origin + one.radius * np.stack([x, -x])
    x = x if np.abs(other.at(sides)[0]).argmin() == 0 else -x
    return RimPlane(LawSurface("plane", one.origin, np.stack([x, axis, cross(x, axis)])), True)


def made_tangent(
    surfaces: Mapping[int, LawSurface], rims: list[Rim], extent: float
) -> dict[int, LawSurface]:
    """Surfaces moved by as little as makes them tangent at their rims.

    Parameters
    ----------
    surfaces : mapping of int and LawSurface
    rims : list of Rim
    extent : float, length
        Of the body: at this distance a rotation counts as much as a shift.

    Raises
    ------
    NotWritten
        Some cannot be tangent together.
    """
    numbers = sorted({k for rim in rims for k in (rim.first, rim.second)})
    if not numbers:
        return dict(surfaces)

    def moved(change) -> dict[int, LawSurface]:
        rows = zip(numbers, change.reshape(-1, _NUMBERS), strict=True)
        return {**surfaces, **{k: _moved(surfaces[k], row, extent) for k, row in rows}}

    def gaps(change) -> np.ndarray:
        now = moved(change)
        return np.concatenate([_gaps(now[r.first], now[r.second], r.points) for r in rims]) / extent

    # Steps of least length lead to a solution near the smallest.
    change = np.zeros(_NUMBERS * len(numbers))
    for _ in range(_ROUNDS):
        slopes = approx_fprime(change, gaps, _CHANGE)
        change = change - np.linalg.lstsq(slopes, gaps(change), rcond=_LEAST_SLOPE)[0]
    if not np.abs(gaps(change)).max() <= _TANGENT:
        raise NotWritten("faces beside smooth rims cannot all be tangent")
    return moved(change)


def _moved(surface: LawSurface, change, extent: float) -> LawSurface:
    """A surface shifted, rotated and grown by seven numbers, parts of the extent."""
    turn = Rotation.from_rotvec(change[3:6]).as_matrix()
    growth = 0.0 if surface.kind == "plane" else extent * change[6]
    return replace(
        surface,
        origin=surface.origin + extent * change[:3],
        axes=surface.axes @ turn.T,
        radius=surface.radius + growth,
    )


def _gaps(first: LawSurface, second: LawSurface, points) -> np.ndarray:
    """(k,) distances of two surfaces in their rim plane near points (k, 3), length."""
    plane = rim_plane(first, second)
    if plane is None:
        return np.zeros(len(points))
    for _ in range(_STEPS):
        for surface in (first, second, plane.surface):
            distance, normal = surface.at(points)
            points = points - distance[:, None] * normal
    return first.at(points)[0] - second.at(points)[0]
