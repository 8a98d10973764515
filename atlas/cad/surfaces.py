"""Surfaces that have a name in STEP: plane, cylinder, cone, sphere and torus."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas.faces.faces import Face
from touchatlas.atlas.pieces.torus import value_gradient_terms
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent


@dataclass(frozen=True, eq=False)
class LawSurface:
    """A surface in a frame.

    Parameters
    ----------
    kind : str
        "plane", "cylinder", "cone", "sphere" or "torus".
    origin : (3,) float, length, world
        On the plane or on the axis; the centre of a sphere or torus.
    axes : (3, 3) float, unit rows, world
        The third is the normal of a plane, or the axis; a cone widens along it. About an axis the
        CAD kernel begins and ends at the first, where a face around it has a seam.
    radius : float, length
        0 for a plane; that of a cone at the origin, and of the tube of a torus.
    outward : float
        1, or -1 where the outside of the body lies toward the axis or centre, or in the tube.
    half_angle : float, rad
        Between axis and sides of a cone, otherwise 0.
    ring : float, length
        Radius of the circle about which a torus is a tube, otherwise 0.
    """

    kind: str
    origin: np.ndarray
    axes: np.ndarray
    radius: float = 0.0
    outward: float = 1.0
    half_angle: float = 0.0
    ring: float = 0.0

    def at(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), length, and outward unit normal (n, 3) at points (n, 3)."""
        offset = points - self.origin
        if self.kind == "plane":
            normal = np.broadcast_to(self.axes[2], offset.shape)
            return offset @ self.axes[2], normal
        if self.kind == "torus":
            torus = np.concatenate([self.origin, self.axes[2], [self.ring, self.radius]])
            distance, normal, _ = value_gradient_terms(torus, points)
            return self.outward * distance, self.outward * normal
        along = offset @ self.axes[2] if self.kind != "sphere" else np.zeros(len(offset))
        offset = offset - np.outer(along, self.axes[2])
        away = np.maximum(np.sqrt((offset * offset).sum(axis=1)), np.finfo(float).tiny)
        cosine, sine = np.cos(self.half_angle), np.sin(self.half_angle)
        normal = cosine * offset / away[:, None] - sine * self.axes[2]
        distance = cosine * (away - self.radius) - sine * along
        return self.outward * distance, self.outward * normal


def law_surface(face: Face, points) -> LawSurface | None:
    """The surface of a lawful face with samples (n, 3), its seam far from these; None where it has
    no name in STEP."""
    numbers = face.law.numbers if face.law is not None else {}
    if face.kind == "plane":
        normal, middle = np.array(numbers["normal"]), points.mean(axis=0)
        foot = middle + (numbers["level"] - normal @ middle) * normal
        return LawSurface("plane", foot, frame_about(normal))
    bare = _round_surface(face, points, numbers)
    if bare is None:
        return None
    agree = (bare.at(points)[1] * face.pieces[0].at(points)[1]).sum(axis=1)
    return _seamed(replace(bare, outward=1.0 if agree.mean() > 0.0 else -1.0), points)


def _round_surface(face: Face, points, numbers) -> LawSurface | None:
    """The cylinder, cone, sphere or torus of a face, its normal away from axis or centre, or out of
    the tube."""
    if face.kind == "cylinder":
        axes, radius = frame_about(np.array(numbers["axis"])), float(numbers["radius"])
        return LawSurface("cylinder", np.array(numbers["point"]), axes, radius)
    if face.kind == "sphere":
        centre = np.array(numbers["centre"])
        return LawSurface("sphere", centre, np.eye(3), float(numbers["radius"]))
    if face.kind == "torus":
        axes, radius = frame_about(np.array(numbers["axis"])), float(numbers["tube_radius"])
        centre, ring = np.array(numbers["centre"]), float(numbers["radius"])
        return LawSurface("torus", centre, axes, radius, ring=ring)
    if face.kind == "cone":
        axes, half_angle = frame_about(np.array(numbers["axis"])), float(numbers["half_angle"])
        apex = np.array(numbers["apex"])
        # Amid its samples, where its radius is that of the cone there.
        height = float(((points - apex) @ axes[2]).mean())
        radius = height * float(np.tan(half_angle))
        return LawSurface("cone", apex + height * axes[2], axes, radius, half_angle=half_angle)
    return None


def _seamed(surface: LawSurface, points) -> LawSurface:
    """The surface with its seam in the middle of the widest gap between points (n, 3) about its
    axis; that of a sphere with points on one half is opposite of their middle."""
    offset = points - surface.origin
    if surface.kind == "sphere":
        middle = offset.mean(axis=0)
        middle = middle / max(float(np.linalg.norm(middle)), np.finfo(float).tiny)
        if (offset @ middle).min() < 0.0:
            return replace(surface, axes=frame_about(middle))
        across = any_tangent(middle)
        return replace(surface, axes=np.stack([-middle, cross(middle, across), across]))
    x, y, axis = surface.axes
    angle = np.sort(np.arctan2(offset @ y, offset @ x))
    gap = np.append(np.diff(angle), angle[0] + 2.0 * np.pi - angle[-1])
    widest = int(gap.argmax())
    seam = angle[widest] + 0.5 * gap[widest]
    turned = np.cos(seam) * x + np.sin(seam) * y
    return replace(surface, axes=np.stack([turned, cross(axis, turned), axis]))


def frame_about(axis) -> np.ndarray:
    """(3, 3) a right-handed frame whose third axis is a unit vector (3,)."""
    x = any_tangent(axis)
    return np.stack([x, cross(axis, x), axis])
