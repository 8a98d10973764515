"""Curves between two pieces: where they intersect, and the valley where their normals agree best.

Tangent surfaces with errors of some micrometres intersect in two curves or none. Their normals
agree on the rim, and off it differ by the jump of the curvature times the distance.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.arrays import cross

# Newton steps; each about squares the error.
_STEPS = 5
# Least sine of the angle of two surfaces that intersect.
_LEAST_SINE = 0.05
# Least jump of the curvature times the search distance, rad.
_LEAST_JUMP = 1e-3


@dataclass(frozen=True, eq=False)
class CurvePoints:
    """Points (m, 3) of a curve, length, and the standard deviations (m,) of their distances from
    it, length."""

    points: np.ndarray
    deviation: np.ndarray


def mean_foot(first: Piece, second: Piece, points) -> np.ndarray:
    """(m, 3) points moved to half-way between two surfaces."""
    for _ in range(2):
        distance, normals = first.at(points)
        other, other_normals = second.at(points)
        shift = distance[:, None] * normals + other[:, None] * other_normals
        points = points - 0.5 * shift
    return points


def angles(first: Piece, second: Piece, points) -> np.ndarray:
    """(m,) angles between the normals of two pieces, rad."""
    difference = first.at(points)[1] - second.at(points)[1]
    chord = np.sqrt((difference * difference).sum(axis=1))
    return 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))


def gap(first: Piece, second: Piece, points) -> float:
    """Root mean square of the difference of the distances of points (m, 3) from two pieces."""
    difference = first.at(points)[0] - second.at(points)[0]
    return float(np.sqrt((difference * difference).mean()))


def curvature_jump(first: Piece, second: Piece, points) -> tuple[np.ndarray, float]:
    """Directions (m, 3) in which the normal curvatures of two pieces differ most, and the median of
    that difference, 1/length."""
    vectors, values = _strongest(first, second, points)
    return vectors, float(np.median(np.abs(values)))


def _strongest(first: Piece, second: Piece, points) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvector (m, 3) and eigenvalue (m,) of the difference of the shape operators, of largest
    absolute value."""
    difference = first.shape_operators(points) - second.shape_operators(points)
    values, vectors = np.linalg.eigh(0.5 * (difference + difference.transpose(0, 2, 1)))
    which = np.abs(values).argmax(axis=1)
    rows = np.arange(len(points))
    return vectors[rows, :, which], values[rows, which]


def intersection_points(first: Piece, second: Piece, points, reach: float) -> CurvePoints:
    """Points where two pieces intersect, by Newton steps of least length from points (m, 3).

    Those that are farther than ``reach`` from their start are left out. The deviation is
    √(s₁² + s₂² - 2 s₁ s₂ cos θ) / sin θ at most, with the predicted deviations s and the angle θ.
    """
    at = points
    for _ in range(_STEPS):
        distance, normals = first.at(at)
        other, other_normals = second.at(at)
        cosine = (normals * other_normals).sum(axis=1)
        square = np.maximum(1.0 - cosine**2, _LEAST_SINE**2)
        along = (distance - cosine * other) / square
        across = (other - cosine * distance) / square
        step = along[:, None] * normals + across[:, None] * other_normals
        length = np.sqrt((step * step).sum(axis=1))
        at = at - step * (reach / np.maximum(length, reach))[:, None]
    distance, normals, variance = first.predicted(at)
    other, other_normals, other_variance = second.predicted(at)
    cosine = (normals * other_normals).sum(axis=1)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, _LEAST_SINE**2))
    moved = at - points
    good = (moved * moved).sum(axis=1) < reach**2
    good &= np.maximum(np.abs(distance), np.abs(other)) < 1e-3 * reach
    good &= (sine > _LEAST_SINE) & np.isfinite(variance + other_variance)
    total = variance + other_variance + 2.0 * np.abs(cosine) * np.sqrt(variance * other_variance)
    return CurvePoints(at[good], (np.sqrt(total) / sine)[good])


def valley_points(first: Piece, second: Piece, points, reach: float) -> CurvePoints:
    """Points of the rim between two tangent pieces, from points (m, 3) near it.

    Newton steps on the difference of the normals along the direction e in which the curvatures
    differ most, by κ: it falls to zero at a distance of (n₁ - n₂)·e / κ. Points that end farther
    than ``reach`` from their start are left out. The deviation is that of the two slopes along e,
    over κ.
    """
    at = points
    for _ in range(_STEPS):
        at = mean_foot(first, second, at)
        direction, jump = _strongest(first, second, at)
        difference = ((first.at(at)[1] - second.at(at)[1]) * direction).sum(axis=1)
        shift = -difference / np.where(np.abs(jump) * reach > _LEAST_JUMP, jump, np.inf)
        at = at + np.clip(shift, -0.5 * reach, 0.5 * reach)[:, None] * direction
    at = mean_foot(first, second, at)
    direction, jump = _strongest(first, second, at)
    variance = first.slope_variance(at, direction) + second.slope_variance(at, direction)
    moved = at - points
    good = (moved * moved).sum(axis=1) < reach**2
    good &= (np.abs(jump) * reach > _LEAST_JUMP) & np.isfinite(at).all(axis=1)
    deviation = np.sqrt(variance[good]) / np.abs(jump[good])
    return CurvePoints(at[good], deviation)


def across_rim(first: Piece, second: Piece, points, toward) -> np.ndarray:
    """(m, 3) unit directions across the rim of two tangent pieces at points (m, 3) of it, on the
    side of directions ``toward`` (m, 3)."""
    return _turned(_strongest(first, second, points)[0], toward)


def rim_distances(first: Piece, second: Piece, points, rim, across) -> np.ndarray:
    """(m,) distances of points (m, 3) from the rim of two tangent pieces, length: (n₁ - n₂)·e / κ,
    positive on the side of directions ``across`` (m, 3) at points ``rim`` (m, 3) of it.

    Normals, e and κ are those of the rim abreast of a point, along its tangent: half-way round a
    fillet the normals agree no more.
    """
    along = cross(first.at(rim)[1], across)
    at = rim + ((points - rim) * along).sum(axis=1)[:, None] * along
    at = mean_foot(first, second, at)
    direction, jump = _strongest(first, second, at)
    direction = _turned(direction, across)
    difference = ((first.at(at)[1] - second.at(at)[1]) * direction).sum(axis=1)
    beyond = ((points - at) * direction).sum(axis=1)
    return beyond + difference / np.where(np.abs(jump) > 0.0, jump, np.inf)


def _turned(directions, toward) -> np.ndarray:
    """Directions (m, 3), or their opposites, on the side of others (m, 3)."""
    against = (directions * toward).sum(axis=1) < 0.0
    return np.where(against[:, None], -directions, directions)


def half_extent(samples, points, across, piece: Piece, width: float) -> float:
    """Half the extent of samples (n, 3) of a piece across a rim, length: the median over points
    (m, 3) of the rim with directions (m, 3), each in a strip so wide to either side."""
    beside = cross(piece.at(points)[1], across)
    strip = np.abs(samples @ beside.T - (points * beside).sum(axis=1)) < width
    along = samples @ across.T
    high = np.where(strip, along, -np.inf).max(axis=0, initial=-np.inf)
    low = np.where(strip, along, np.inf).min(axis=0, initial=np.inf)
    extents = (high - low)[strip.sum(axis=0) > 1]
    return 0.5 * float(np.median(extents)) if len(extents) else 0.0


def rim_slope(kind: Kind, misfit: float, half_length: float) -> float:
    """Largest error of the slope, rad, at the rim of a piece with a lack of fit.

    At the end of the half-length r the first Legendre polynomial that a kind leaves out, of degree
    n, has the slope P'(1) = n (n + 1) / 2 over its root mean square 1 / sqrt(2 n + 1): n = 2 of a
    plane, 5 of a quartic, 3 of others. At a corner the errors of both directions add.

    >>> round(rim_slope(Kind.PLANE, 0.01, 10.0), 4)
    0.0134
    """
    n = {Kind.PLANE: 2, Kind.QUARTIC: 5}.get(kind, 3)
    return float(misfit * np.sqrt(2 * n + 1) * n * (n + 1) / half_length)
