"""Fit a circular cylinder to samples: Gauss-Newton on distances, started from a quadric."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.frame import any_tangent

# Least curvature times the size of the piece: flatter ones are planes within 1 % of their size.
# Doubled, shallow cylinders become quadrics.
_LEAST_BEND = 0.02
# Steps; each squares the relative error. Doubled, nothing changes but rounding.
_STEPS = 6
# Last step in radii and rad; the error is its square. Doubled, nothing changes.
_CONVERGED = 1e-5
# Longest step of position and radius in radii, and of the axis in rad. Doubled, some diverge.
_LONGEST, _TILT = 0.5, 0.3
# Differences for the derivatives of the coefficients, no unit. Doubled, nothing changes.
_DIFFERENCE = 1e-5


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A circular cylinder.

    Parameters
    ----------
    point : (3,) float, length, world
        On the axis.
    axis : (3,) float, unit, world
    radius : float, length
    outward : float
        1 where the outside is away from the axis (a boss), -1 in a hole.
    covariance : (5, 5) float
        Of two shifts of the point along ``across``, length, the radius, length, and two tilts of
        the axis toward them, rad.
    """

    point: np.ndarray
    axis: np.ndarray
    radius: float
    outward: float
    covariance: np.ndarray

    @cached_property
    def across(self) -> np.ndarray:
        """(2, 3) unit directions across the axis."""
        u = any_tangent(self.axis)
        return np.stack([u, cross(self.axis, u)])

    def moved(self, change) -> "Cylinder":
        """The cylinder after shifts, growth and tilts (5,)."""
        u, w = self.across
        axis = self.axis + change[3] * u + change[4] * w
        point = self.point + change[0] * u + change[1] * w
        axis = axis / np.sqrt(axis @ axis)
        return Cylinder(point, axis, self.radius + change[2], self.outward, self.covariance)


def fit_cylinder(points, normals, std) -> Piece | None:
    """The cylinder that fits samples (n, 3) best, started from their quadric; None where they bend
    too little, or too much both ways."""
    start = linear_fit(Kind.QUADRIC, points, *frame_of(points, normals), std)
    cylinder = refined_cylinder(start, points, std)
    return None if cylinder is None else cylinder_piece(cylinder, start)


def refined_cylinder(start: Piece, points, std) -> Cylinder | None:
    """The cylinder itself, by Gauss-Newton steps from the curvature of a piece."""
    cylinder, least = _osculating(start), float(np.min(std))
    if cylinder is None:
        return None
    # Deviations of the samples (n, 1) over the least of them.
    relative = np.reshape(std / least, (-1, 1))
    for _ in range(_STEPS):
        distance, jacobian = _distances(cylinder, points)
        unit = np.array([1.0, 1.0, 1.0, 1.0 / start.scale, 1.0 / start.scale])
        distance, jacobian = distance / relative[:, 0], jacobian * unit / relative
        gram = jacobian.T @ jacobian + 1e-9 * len(points) * np.eye(5)
        inverse = np.linalg.inv(gram)
        change = -unit * (inverse @ (jacobian.T @ distance))
        shift, tilt = np.abs(change[:3]).max(), np.abs(change[3:]).max()
        change *= min(
            1.0, _LONGEST * cylinder.radius / max(shift, 1e-300), _TILT / max(tilt, 1e-300)
        )
        cylinder = cylinder.moved(change)
        if max(shift / cylinder.radius, tilt) < _CONVERGED:
            break
        if not 0.0 < cylinder.radius * _LEAST_BEND < start.scale:
            return None
    covariance = inverse * least**2 * unit[:, None] * unit
    return Cylinder(cylinder.point, cylinder.axis, cylinder.radius, cylinder.outward, covariance)


def _osculating(piece: Piece) -> Cylinder | None:
    """The cylinder of the largest principal curvature at the origin of a piece."""
    foot = piece.feet(piece.origin[None])
    normal = piece.at(foot)[1][0]
    values, vectors = np.linalg.eigh(piece.shape_operators(foot)[0])
    strongest = np.abs(values).argmax()
    bend = values[strongest]
    if not abs(bend) * piece.scale > _LEAST_BEND:
        return None
    axis = cross(normal, vectors[:, strongest])
    axis = axis / np.sqrt(axis @ axis)
    return Cylinder(foot[0] - normal / bend, axis, 1.0 / abs(bend), np.sign(bend), np.zeros((5, 5)))


def _distances(cylinder: Cylinder, points) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) from a cylinder and their derivatives (n, 5) by its parameters."""
    offset = points - cylinder.point
    along = offset @ cylinder.axis
    side = offset - along[:, None] * cylinder.axis
    rho = np.maximum(np.sqrt((side * side).sum(axis=1)), np.finfo(float).tiny)
    radial = (side / rho[:, None]) @ cylinder.across.T
    ones = np.ones((len(points), 1))
    jacobian = np.concatenate([-radial, -ones, -along[:, None] * radial], axis=1)
    return rho - cylinder.radius, jacobian


def cylinder_piece(cylinder: Cylinder, frame: Piece) -> Piece:
    """A cylinder as a piece in the frame of another."""
    mean = _coefficients(cylinder, frame)
    size = np.array([1.0, 1.0, 1.0, 1.0 / frame.scale, 1.0 / frame.scale]) * cylinder.radius
    steps = _DIFFERENCE * np.diag(size)
    slopes = np.stack(
        [
            (_coefficients(cylinder.moved(s), frame) - _coefficients(cylinder.moved(-s), frame))
            / (2.0 * s.sum())
            for s in steps
        ],
        axis=1,
    )
    covariance = slopes @ cylinder.covariance @ slopes.T
    return Piece(Kind.CYLINDER, frame.origin, frame.axes, frame.scale, mean, covariance)


def _coefficients(cylinder: Cylinder, frame: Piece) -> np.ndarray:
    """(9,) coefficients of φ: |P (x - c)|^2 - r^2, divided by what multiplies -z."""
    project = np.eye(3) - np.outer(cylinder.axis, cylinder.axis)
    offset = project @ (frame.origin - cylinder.point)
    square = frame.axes @ project @ frame.axes.T * frame.scale**2
    line = 2.0 * frame.scale * (frame.axes @ offset)
    level = offset @ offset - cylinder.radius**2
    terms = [level, line[0], line[1], square[0, 0], 2.0 * square[0, 1], square[1, 1]]
    terms += [2.0 * square[0, 2], 2.0 * square[1, 2], square[2, 2]]
    divisor = line[2] if abs(line[2]) > 1e-300 else 1e-300
    return np.array(terms) / -divisor
