"""Surfaces that have a name in STEP: plane, cylinder, cone, sphere and torus."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from touchatlas.atlas.faces.faces import Face
from touchatlas.atlas.pieces.piece import Piece
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
    return fit_cone(face.pieces[0], points, face.deviation) if face.kind == "quadric" else None


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


def fit_cone(piece: Piece, points, deviation: float) -> LawSurface | None:
    """The circular cone that fits samples of a quadric face.

    Parameters
    ----------
    piece : Piece
        The quadric, from which the fit starts.
    points : (n, 3) float, length, world
    deviation : float, length
        Root mean square of the distances of the points from the quadric.

    Returns
    -------
    LawSurface or None
        The cone, its origin at the mean height of the points. None where its distances are larger
        by a fifth than those of the quadric, which has three parameters more, or where it is a
        plane or a cylinder to within a degree.
    """
    start = _osculating(piece, points)
    if start is None:
        return None
    scale = float(np.linalg.norm(points - start.origin, axis=1).mean())

    def cone(change) -> LawSurface:
        axis = start.axes[2] + change[3:5] @ start.axes[:2]
        return replace(
            start,
            origin=start.origin + scale * change[:3],
            axes=frame_about(axis / np.sqrt(axis @ axis)),
            half_angle=start.half_angle + float(change[5]),
        )

    found = least_squares(lambda change: cone(change).at(points)[0] / scale, np.zeros(6))
    fitted, error = cone(found.x), scale * float(np.sqrt((found.fun**2).mean()))
    if error > 1.2 * deviation or not 1.0 < np.degrees(fitted.half_angle) < 89.0:
        return None
    height = float(((points - fitted.origin) @ fitted.axes[2]).mean())
    return replace(
        fitted,
        origin=fitted.origin + height * fitted.axes[2],
        radius=height * float(np.tan(fitted.half_angle)),
    )


def _osculating(piece: Piece, points) -> LawSurface | None:
    """The cone nearest to a quadric, its origin at the apex: the centre of the quadric, and the
    axis whose eigenvalue has the sign that the other two have not."""
    _, x, y, xx, xy, yy, xz, yz, zz = piece.coefficients
    second = np.array([[2.0 * xx, xy, xz], [xy, 2.0 * yy, yz], [xz, yz, 2.0 * zz]])
    values, vectors = np.linalg.eigh(second)
    sign = np.sign(values)
    if abs(sign.sum()) != 1.0:
        return None
    odd = int(np.flatnonzero(sign == -sign.sum())[0])
    others = np.delete(values, odd)
    # The gradient of the implicit quadric is zero at its centre.
    centre = np.linalg.solve(second, np.array([-x, -y, 1.0]))
    apex = piece.origin + piece.scale * centre @ piece.axes
    axis = vectors[:, odd] @ piece.axes
    axis = axis * np.sign((points.mean(axis=0) - apex) @ axis)
    half_angle = float(np.arctan(np.sqrt(-values[odd] / others.mean())))
    return LawSurface("cone", apex, frame_about(axis), half_angle=half_angle)
