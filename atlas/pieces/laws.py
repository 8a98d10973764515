"""Laws in words and numbers: the plane, sphere, cylinder, cone or torus that a piece is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.pieces.fit_cylinder import refined_cylinder
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece

# Decimals of unit vectors. Doubled, digits are shown that are noise.
_UNIT_DECIMALS = 3
# Differences for derivatives by coefficients, no unit. Doubled, nothing changes.
_DIFFERENCE = 1e-6


@dataclass(frozen=True, eq=False)
class Law:
    """What a lawful face is.

    Parameters
    ----------
    kind : str
        "plane", "sphere", "cylinder", "cone", "torus" or "quadric".
    words : str
        Kind and numbers.
    numbers : dict
        Names mapped to a float or a list of three floats: lengths in the user's unit, unit vectors.
        A name that ends in ``_std`` is a standard deviation.
    """

    kind: str
    words: str
    numbers: dict[str, float | list[float]]


def law_of(piece: Piece, points, std) -> Law:
    """The law of a lawful piece of samples (n, 3) with a standard deviation, or one of each. That
    of a cylinder is fitted to these samples again; where none fits, it is the law of a quadric.

    Raises
    ------
    ValueError
        For a quartic, which obeys no law.
    """
    if piece.kind not in _LAWS:
        raise ValueError("a quartic has no law; its face is free-form")
    return _LAWS[piece.kind](piece, points, std)


def _plane(piece: Piece, *_) -> Law:
    foot = piece.feet(piece.origin[None])
    normal = piece.at(foot)[1][0]
    # The two slopes are coefficients of x and y, over cos of a small tilt.
    tilt = float(np.sqrt(np.trace(piece.covariance[1:3, 1:3]) / 2.0))
    level = float(normal @ foot[0])
    deviation = float(np.sqrt(piece.predicted(foot)[2][0]))
    words = f"plane, normal {vector(normal)}, level {with_deviation(level, deviation)}"
    numbers = {"normal": normal.tolist(), "normal_std": tilt, "level": level}
    return Law("plane", words, numbers | {"level_std": deviation})


def _sphere(piece: Piece, *_) -> Law:
    """|x - c| = r from z = c0 + c1 x + c2 y + c3 (x^2 + y^2 + z^2)."""

    def centre_and_radius(c):
        centre = np.array([-c[1], -c[2], 1.0]) / (2.0 * c[3])
        return np.append(centre, np.sqrt(max(centre @ centre - c[0] / c[3], 0.0)))

    four = piece.coefficients[:4]
    values = centre_and_radius(four)
    steps = _DIFFERENCE * np.eye(4)
    slopes = np.stack(
        [(centre_and_radius(four + s) - centre_and_radius(four - s)) / 2.0 for s in steps], axis=1
    )
    slopes = slopes / _DIFFERENCE
    covariance = slopes @ piece.covariance[:4, :4] @ slopes.T * piece.scale**2
    centre = piece.origin + piece.scale * values[:3] @ piece.axes
    radius, deviation = float(piece.scale * values[3]), float(np.sqrt(covariance[3, 3]))
    centre_std = float(np.sqrt(np.trace(covariance[:3, :3]) / 3.0))
    side = "" if four[3] < 0.0 else "hollow "
    words = (
        f"{side}sphere, radius {with_deviation(radius, deviation)}, "
        f"centre {vector(centre, centre_std)}"
    )
    numbers = {"radius": radius, "radius_std": deviation, "centre": centre.tolist()}
    return Law("sphere", words, numbers | {"centre_std": centre_std})


def _cylinder(piece: Piece, points, std) -> Law:
    cylinder = refined_cylinder(piece, points, std)
    if cylinder is None:
        return _quadric(piece)
    axis = cylinder.axis * (1.0 if cylinder.axis[np.abs(cylinder.axis).argmax()] > 0.0 else -1.0)
    # The point of the axis that is nearest to the samples' mean.
    point = cylinder.point + ((points.mean(axis=0) - cylinder.point) @ axis) * axis
    deviation = float(np.sqrt(cylinder.covariance[2, 2]))
    tilt = float(np.sqrt(np.trace(cylinder.covariance[3:, 3:]) / 2.0))
    side = "" if cylinder.outward > 0.0 else "hollow "
    words = (
        f"{side}cylinder, radius {with_deviation(cylinder.radius, deviation)}, axis {vector(axis)}"
    )
    numbers = {"radius": float(cylinder.radius), "radius_std": deviation, "axis": axis.tolist()}
    return Law("cylinder", words, numbers | {"axis_std": tilt, "point": point.tolist()})


def _cone(piece: Piece, *_) -> Law:
    cone, deviations = piece.coefficients, np.sqrt(np.diagonal(piece.covariance))
    apex, apex_std, axis, tilt = _axis_of(piece)
    angle, angle_std = np.rad2deg([abs(cone[6]), deviations[6]]).tolist()
    side = "" if cone[6] > 0.0 else "hollow "
    words = (
        f"{side}cone, half angle {with_deviation(angle, angle_std)}°, "
        f"apex {vector(apex, apex_std)}, axis {vector(axis)}"
    )
    numbers = {"half_angle": float(abs(cone[6])), "half_angle_std": float(deviations[6])}
    placed = {"apex": apex.tolist(), "apex_std": apex_std, "axis": axis.tolist(), "axis_std": tilt}
    return Law("cone", words, numbers | placed)


def _torus(piece: Piece, *_) -> Law:
    torus, deviations = piece.coefficients, np.sqrt(np.diagonal(piece.covariance))
    centre, centre_std, axis, tilt = _axis_of(piece)
    axis = axis * (1.0 if axis[np.abs(axis).argmax()] > 0.0 else -1.0)
    ring, tube = (piece.scale * np.abs(torus[6:])).tolist()
    ring_std, tube_std = (piece.scale * deviations[6:]).tolist()
    side = "" if torus[7] > 0.0 else "hollow "
    words = (
        f"{side}torus, radii {with_deviation(ring, ring_std)} and "
        f"{with_deviation(tube, tube_std)}, axis {vector(axis)}"
    )
    numbers = {"radius": ring, "radius_std": ring_std, "tube_radius": tube}
    numbers |= {"tube_radius_std": tube_std, "axis": axis.tolist(), "axis_std": tilt}
    return Law("torus", words, numbers | {"centre": centre.tolist(), "centre_std": centre_std})


def _axis_of(piece: Piece) -> tuple[np.ndarray, float, np.ndarray, float]:
    """The point (3,) of a cone or torus, world, the standard deviation of a coordinate of it,
    length, the axis (3,), a unit vector, and the standard deviation of its tilt, rad."""
    variances = np.diagonal(piece.covariance)
    point = piece.origin + piece.scale * piece.coefficients[:3] @ piece.axes
    point_std = float(piece.scale * np.sqrt(variances[:3].mean()))
    tilt = float(np.sqrt(variances[3:6].sum() / 2.0))
    return point, point_std, piece.coefficients[3:6] @ piece.axes, tilt


def _quadric(piece: Piece, *_) -> Law:
    """Principal curvatures in the middle, positive where the surface bends toward the outside."""
    foot = piece.feet(piece.origin[None])
    shape = -piece.shape_operators(foot)[0]
    values = np.linalg.eigvalsh(0.5 * (shape + shape.T))
    # The third eigenvalue belongs to the normal and is zero.
    low, high = np.delete(values, np.abs(values).argmin())
    words = f"quadric, principal curvatures {high:.3g} and {low:.3g} in the middle"
    numbers = {"k1": float(high), "k2": float(low), "middle": foot[0].tolist()}
    return Law("quadric", words, numbers)


# From a piece, its samples (n, 3) and their deviations.
_LAWS: dict[Kind, Callable[..., Law]] = {
    Kind.PLANE: _plane,
    Kind.SPHERE: _sphere,
    Kind.CYLINDER: _cylinder,
    Kind.CONE: _cone,
    Kind.TORUS: _torus,
    Kind.QUADRIC: _quadric,
}


def with_deviation(value: float, deviation: float) -> str:
    """A number with its standard deviation, to the first digit of this.

    >>> with_deviation(5.0123, 0.0113), with_deviation(1234.5, 20.0)
    ('5.01 ± 0.01', '1230 ± 20')
    """
    if not 0.0 < deviation < np.inf:
        return f"{value:.6g}"
    decimals = int(-np.floor(np.log10(deviation)))
    decimals -= round(deviation, decimals) >= 10.0 ** (1 - decimals)
    number = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return f"{number} ± {round(deviation, decimals):.{max(decimals, 0)}f}"


def vector(values, deviation: float | None = None) -> str:
    """Three numbers in brackets: a unit vector, or a point with the deviation of each coordinate.

    >>> vector(np.array([0.0, -1e-9, 1.0])), vector(np.array([1.234, 0.0, -5.678]), 0.02)
    ('(0.000, 0.000, 1.000)', '(1.23, 0.00, -5.68)')
    """
    decimals = _UNIT_DECIMALS
    if deviation is not None and 0.0 < deviation < np.inf:
        decimals = max(int(-np.floor(np.log10(deviation))), 0)
    # Adding zero makes -0 into 0.
    return "(" + ", ".join(f"{round(float(v), decimals) + 0.0:.{decimals}f}" for v in values) + ")"
