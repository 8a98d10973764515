"""Surfaces that have a name in STEP: plane, cylinder and sphere, each with parameters u and v.

On a cylinder u is the angle about the axis from x, on a sphere the longitude, in rad; v is the height
along the axis, length, or the latitude, rad. The normal that follows from them points away from
axis or centre; ``outward`` is -1 where the body lies outside, as in a hole.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.faces.faces import Face
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent


@dataclass(frozen=True, eq=False)
class LawSurface:
    """A surface in a frame.

    Parameters
    ----------
    kind : str
        "plane", "cylinder" or "sphere".
    origin : (3,) float, length, world
        On the plane or on the axis; the centre of a sphere.
    axes : (3, 3) float, unit rows, world
        The third is the normal of a plane, or the axis.
    radius : float, length
        0 for a plane.
    outward : float
        1, or -1 where the outside of the body lies toward the axis or centre.
    """

    kind: str
    origin: np.ndarray
    axes: np.ndarray
    radius: float = 0.0
    outward: float = 1.0

    def at(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), length, and outward unit normal (n, 3) at points (n, 3)."""
        offset = points - self.origin
        if self.kind == "plane":
            normal = np.broadcast_to(self.axes[2], offset.shape)
            return offset @ self.axes[2], normal
        if self.kind == "cylinder":
            offset = offset - np.outer(offset @ self.axes[2], self.axes[2])
        away = np.maximum(np.sqrt((offset * offset).sum(axis=1)), np.finfo(float).tiny)
        normal = offset / away[:, None]
        return self.outward * (away - self.radius), self.outward * normal

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
        if self.kind == "cylinder":
            return np.column_stack([u, local[:, 2]])
        return np.column_stack([u, np.arctan2(local[:, 2], np.hypot(local[:, 0], local[:, 1]))])

    def points(self, uv) -> np.ndarray:
        """(n, 3) points of parameters u and v (n, 2)."""
        u, v = uv.T
        local = np.column_stack([u, v, np.zeros(len(u))])
        if self.periodic:
            ring = self.radius * (np.cos(v) if self.kind == "sphere" else np.ones(len(v)))
            height = self.radius * np.sin(v) if self.kind == "sphere" else v
            local = np.column_stack([ring * np.cos(u), ring * np.sin(u), height])
        return np.asarray(self.origin + local @ self.axes)

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
        normal = np.array(numbers["normal"])
        middle = points.mean(axis=0)
        return LawSurface(
            "plane", middle + (numbers["level"] - normal @ middle) * normal, _frame(normal)
        )
    if face.kind == "cylinder" and "axis" in numbers:
        axis, origin = np.array(numbers["axis"]), np.array(numbers["point"])
        bare = LawSurface("cylinder", origin, _frame(axis), float(numbers["radius"]))
    elif face.kind == "sphere":
        origin = np.array(numbers["centre"])
        bare = LawSurface("sphere", origin, np.eye(3), float(numbers["radius"]))
    else:
        return None
    agree = (bare.at(points)[1] * face.pieces[0].at(points)[1]).sum(axis=1)
    return replace(bare, outward=1.0 if agree.mean() > 0.0 else -1.0)


def _frame(axis) -> np.ndarray:
    """(3, 3) a right-handed frame whose third axis is a unit vector (3,)."""
    x = any_tangent(axis)
    return np.stack([x, cross(axis, x), axis])
