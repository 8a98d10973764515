"""Fit a circular cone to the samples of a quadric face, because STEP has a name for it."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Root mean square of the distances from the cone, over that from the quadric, up to which the face
# is a cone: a quadric has three parameters more. Doubled, blunt hyperboloids are cones.
_AS_GOOD = 1.2
# Least and largest half angle of a cone, rad: flatter or steeper ones are planes or cylinders to
# the eye. Doubled, slightly tapered pins are no cones.
_LEAST, _MOST = np.deg2rad(1.0), np.deg2rad(89.0)


class Cone(NamedTuple):
    """Apex (3,), length; unit axis (3,) toward the samples; half angle, rad."""

    apex: np.ndarray
    axis: np.ndarray
    half_angle: float


def fit_cone(piece: Piece, points, deviation: float) -> Cone | None:
    """The cone that fits points (n, 3) best, started from a quadric piece, or None where it fits
    worse; ``deviation`` (length) is the root mean square of their distances from the piece."""
    start = _osculating(piece, points)
    if start is None:
        return None
    scale = float(np.linalg.norm(points - start.apex, axis=1).mean())
    across = np.stack([any_tangent(start.axis), cross(start.axis, any_tangent(start.axis))])

    def cone(change) -> Cone:
        axis = start.axis + change[3:5] @ across
        axis = axis / np.sqrt(axis @ axis)
        return Cone(start.apex + scale * change[:3], axis, start.half_angle + float(change[5]))

    found = least_squares(lambda c: cone_distances(cone(c), points) / scale, np.zeros(6))
    fitted = cone(found.x)
    error = float(np.sqrt((cone_distances(fitted, points) ** 2).mean()))
    is_cone = error <= _AS_GOOD * deviation and _LEAST < fitted.half_angle < _MOST
    return fitted if is_cone else None


def cone_distances(cone: Cone, points) -> np.ndarray:
    """(n,) signed distances of points (n, 3), length, positive away from the axis."""
    offset = points - cone.apex
    along = offset @ cone.axis
    away = np.linalg.norm(offset - np.outer(along, cone.axis), axis=1)
    return np.asarray(away * np.cos(cone.half_angle) - along * np.sin(cone.half_angle))


def _osculating(piece: Piece, points) -> Cone | None:
    """The cone nearest to a quadric: its centre, and the axis whose eigenvalue has the sign that
    the other two have not."""
    _, x, y, xx, xy, yy, xz, yz, zz = piece.coefficients
    second = np.array([[2.0 * xx, xy, xz], [xy, 2.0 * yy, yz], [xz, yz, 2.0 * zz]])
    values, vectors = np.linalg.eigh(second)
    sign = np.sign(values)
    if abs(sign.sum()) != 1.0:
        return None
    odd = int(np.flatnonzero(sign == -sign.sum())[0])
    others = np.delete(values, odd)
    # The gradient of z - φ is zero at the centre.
    centre = np.linalg.solve(second, np.array([-x, -y, 1.0]))
    apex = piece.origin + piece.scale * centre @ piece.axes
    axis = vectors[:, odd] @ piece.axes
    axis = axis * np.sign((points.mean(axis=0) - apex) @ axis)
    return Cone(apex, axis, float(np.arctan(np.sqrt(-values[odd] / others.mean()))))
