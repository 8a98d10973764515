"""Surfaces that have a name in STEP: plane, cylinder, cone and sphere, with parameters u and v.

About an axis u is the angle from x, on a sphere the longitude, in rad. v is the height along the
axis of a cylinder and the length along the side of a cone, or the latitude of a sphere, rad. The
normal that follows from them points away from axis or centre; ``outward`` is -1 where the body is
on that side.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.cad.fit_cone import fit_cone
from touchatlas.atlas.faces.faces import Face
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent


@dataclass(frozen=True, eq=False)
class LawSurface:
    """A surface in a frame.

    Parameters
    ----------
    kind : str
        "plane", "cylinder", "cone" or "sphere".
    origin : (3,) float, length, world
        On the plane or on the axis; the centre of a sphere.
    axes : (3, 3) float, unit rows, world
        The third is the normal of a plane, or the axis; a cone widens along it.
    radius : float, length
        0 for a plane; that of a cone at the origin.
    outward : float
        1, or -1 where the outside of the body lies toward the axis or centre.
    half_angle : float, rad
        Between axis and sides of a cone, otherwise 0.
    """

    kind: str
    origin: np.ndarray
    axes: np.ndarray
    radius: float = 0.0
    outward: float = 1.0
    half_angle: float = 0.0

    def at(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), length, and outward unit normal (n, 3) at points (n, 3)."""
        offset = points - self.origin
        if self.kind == "plane":
            normal = np.broadcast_to(self.axes[2], offset.shape)
            return offset @ self.axes[2], normal
        along = offset @ self.axes[2] if self.kind != "sphere" else np.zeros(len(offset))
        offset = offset - np.outer(along, self.axes[2])
        away = np.maximum(np.sqrt((offset * offset).sum(axis=1)), np.finfo(float).tiny)
        cosine, sine = np.cos(self.half_angle), np.sin(self.half_angle)
        normal = cosine * offset / away[:, None] - sine * self.axes[2]
        distance = cosine * (away - self.radius) - sine * along
        return self.outward * distance, self.outward * normal

    @property
    def periodic(self) -> bool:
        """Whether u is an angle."""
        return self.kind != "plane"

    def parameters(self, points) -> np.ndarray:
        """(n, 2) parameters u and v of points (n, 3); an angle u is between 0 and 2 pi."""
        local = (points - self.origin) @ self.axes.T
        if not self.periodic:
            return local[:, :2]
        u = np.arctan2(local[:, 1], local[:, 0]) % (2.0 * np.pi)
        away = np.hypot(local[:, 0], local[:, 1])
        if self.kind == "sphere":
            return np.column_stack([u, np.arctan2(local[:, 2], away)])
        cosine, sine = np.cos(self.half_angle), np.sin(self.half_angle)
        return np.column_stack([u, cosine * local[:, 2] + sine * (away - self.radius)])

    def points(self, uv) -> np.ndarray:
        """(n, 3) points of parameters u and v (n, 2)."""
        u, v = uv.T
        local = np.column_stack([u, v, np.zeros(len(u))])
        if self.periodic:
            ring, height = self._ring(v)
            local = np.column_stack([ring * np.cos(u), ring * np.sin(u), height])
        return np.asarray(self.origin + local @ self.axes)

    def _ring(self, v) -> tuple[np.ndarray, np.ndarray]:
        """Distance (n,) from the axis and height (n,) along it, length, at v (n,)."""
        if self.kind == "sphere":
            return self.radius * np.cos(v), self.radius * np.sin(v)
        return self.radius + v * np.sin(self.half_angle), v * np.cos(self.half_angle)

    def pole(self, sign: int) -> float | None:
        """The v of the end of the axis below, -1, or above, 1; None where there is none."""
        if self.kind == "sphere":
            return sign * 0.5 * np.pi
        is_apex = self.kind == "cone" and sign < 0
        return -self.radius / np.sin(self.half_angle) if is_apex else None

    def about(self, axis, toward) -> "LawSurface":
        """The same with another axis (3,) and with u = 0 toward a direction (3,)."""
        axis = axis / np.sqrt(axis @ axis)
        x = toward - (toward @ axis) * axis
        x = x / np.sqrt(x @ x)
        return replace(self, axes=np.stack([x, cross(axis, x), axis]))


def law_surface(face: Face, points) -> LawSurface | None:
    """The surface of a lawful face with samples (n, 3); None where it has no name in STEP."""
    numbers = face.law.numbers if face.law is not None else {}
    if face.kind == "plane":
        normal, middle = np.array(numbers["normal"]), points.mean(axis=0)
        foot = middle + (numbers["level"] - normal @ middle) * normal
        return LawSurface("plane", foot, _frame(normal))
    bare = _round_surface(face, points, numbers)
    if bare is None:
        return None
    agree = (bare.at(points)[1] * face.pieces[0].at(points)[1]).sum(axis=1)
    return replace(bare, outward=1.0 if agree.mean() > 0.0 else -1.0)


def _round_surface(face: Face, points, numbers) -> LawSurface | None:
    """The cylinder, cone or sphere of a face, its normal away from axis or centre."""
    if face.kind == "cylinder" and "axis" in numbers:
        frame = _frame(np.array(numbers["axis"]))
        return LawSurface("cylinder", np.array(numbers["point"]), frame, float(numbers["radius"]))
    if face.kind == "sphere":
        centre = np.array(numbers["centre"])
        return LawSurface("sphere", centre, np.eye(3), float(numbers["radius"]))
    cone = fit_cone(face.pieces[0], points, face.deviation) if face.kind == "quadric" else None
    if cone is None:
        return None
    height = float(((points - cone.apex) @ cone.axis).mean())
    radius = height * float(np.tan(cone.half_angle))
    origin = cone.apex + height * cone.axis
    return LawSurface("cone", origin, _frame(cone.axis), radius, half_angle=cone.half_angle)


def _frame(axis) -> np.ndarray:
    """(3, 3) a right-handed frame whose third axis is a unit vector (3,)."""
    x = any_tangent(axis)
    return np.stack([x, cross(axis, x), axis])
