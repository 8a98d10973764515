"""Smooth rims: surfaces that meet there are made tangent.

Measured surfaces are tangent within their errors only. Then they intersect in two curves or in
none, and no CAD kernel finds where one passes into the other.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import approx_fprime
from scipy.spatial.transform import Rotation

from touchatlas.atlas.cad.kernel import NotWritten
from touchatlas.atlas.cad.surfaces import LawSurface, frame_about
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.faces import Faces
from touchatlas.patch.geometry.arrays import cross


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
            # Two points fix a line, three a circle.
            out.append(Rim(*pair, points[:: max(1, len(points) // 12)]))
    return out


def rim_plane(first: LawSurface, second: LawSurface) -> RimPlane | None:
    """The plane in which two surfaces touch if they are tangent; None where there is none.

    A sphere or a torus touches a cylinder or a cone in a circle across their axis, about its centre
    or about that of its tube. A plane or another cylinder touches them in a line, which lies in one
    plane with their axis.
    """
    one, other = (first, second) if first.kind in ("cylinder", "cone") else (second, first)
    if one.kind not in ("cylinder", "cone"):
        return None
    axis = one.axes[2]
    if other.kind == "sphere":
        centre = other.origin - other.radius * np.sin(one.half_angle) * axis
        return RimPlane(LawSurface("plane", centre, frame_about(axis)), False)
    if other.kind == "torus":
        # The plane of the circle passes the centre of the torus.
        return RimPlane(LawSurface("plane", other.origin, frame_about(axis)), False)
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

    Gauss-Newton steps of least norm, each of which about squares the error.

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
        rows = zip(numbers, change.reshape(len(numbers), -1), strict=True)
        return {**surfaces, **{k: _moved(surfaces[k], row, extent) for k, row in rows}}

    def gaps(change) -> np.ndarray:
        now = moved(change)
        return np.concatenate([_gaps(now[r.first], now[r.second], r.points) for r in rims]) / extent

    change = np.zeros(7 * len(numbers))
    for _ in range(6):
        slopes = approx_fprime(change, gaps, 1e-7)
        # Rounding leaves singular values of 1e-10 where surfaces may move freely; the least of
        # a stadium's is 4e-6.
        change = change - np.linalg.lstsq(slopes, gaps(change), rcond=1e-7)[0]
    # The kernel takes points within 1e-7 of a body of size 1 for one: a hundredth of that.
    if not np.abs(gaps(change)).max() <= 1e-9:
        raise NotWritten("faces at smooth rims cannot all be tangent")
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
    # Each round of projections about squares the distance from all three.
    for _ in range(3):
        for surface in (first, second, plane.surface):
            distance, normal = surface.at(points)
            points = points - distance[:, None] * normal
    return first.at(points)[0] - second.at(points)[0]
