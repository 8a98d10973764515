"""The reference point of recorded curves: where they meet, or a given one near them."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.sim.recorded.contour_file import Curve

# A curve that misses the reference point by more than this fraction of its size does not run
# through it. Twice as much accepts curves of another place.
_ASTRAY = 0.25
# Samples of each curve, at most, among which the start of the meeting point is sought. Doubled, the
# search takes twice as long and starts half as far from the point.
_STARTS = 1000


def meeting_point(curves) -> np.ndarray:
    """(3,) point nearest to all curves (n, 3) in least squares, taken as polylines.

    Starts at the best of some samples and goes on by Gauss-Newton, each curve a line near its foot.

    >>> x = np.linspace(-1.0, 2.0, 7)[:, None]
    >>> curves = [x * [1.0, 0, 0], x * [0, 1.0, 0], x * [0.6, 0.8, 0] + [0, 0, 0.3]]
    >>> meeting_point(curves).round(6) + 0.0
    array([0. , 0. , 0.1])
    """
    samples = np.concatenate([curve[:: 1 + len(curve) // _STARTS] for curve in curves])
    total = sum(cKDTree(curve).query(samples)[0] ** 2 for curve in curves)
    point = samples[np.argmin(total)]
    for _ in range(20):
        feet, tangents = zip(*(foot(curve, point) for curve in curves), strict=True)
        across = len(curves) * np.eye(3) - np.array(tangents).T @ np.array(tangents)
        step = (np.array(feet) - point).sum(axis=0)
        point = point + np.linalg.lstsq(across, step, rcond=1e-6)[0]
    return point


def foot(curve, point):
    """Nearest point of a polyline (n, 3), and the direction of its segment there."""
    chord = np.diff(curve, axis=0)
    square = (chord * chord).sum(axis=1)
    fraction = np.clip(((point - curve[:-1]) * chord).sum(axis=1) / square, 0.0, 1.0)
    feet = curve[:-1] + fraction[:, None] * chord
    nearest = int(((feet - point) ** 2).sum(axis=1).argmin())
    return feet[nearest], chord[nearest] / np.sqrt(square[nearest])


def checked_point(point, curves: list[Curve]) -> np.ndarray:
    """A reference point that the user gave, near the curves."""
    samples = np.concatenate([curve.points for curve in curves])
    # np.hypot does not overflow for the largest numbers allowed.
    away = float(np.hypot.reduce(samples - point, axis=1).min())
    size = min(float(np.ptp(curve.points, axis=0).max()) for curve in curves)
    if not away <= _ASTRAY * size:
        raise ValueError(
            f"the point {written(point)} is {away:.4g} away from all curves; give a point on "
            "them, or leave it out"
        )
    return np.asarray(point, dtype=float)


def common_point(curves: list[Curve]) -> np.ndarray:
    """Where the curves meet, no farther from any than they may miss each other."""
    point = meeting_point([curve.points for curve in curves])
    size = max(float(np.ptp(curve.points, axis=0).max()) for curve in curves)
    for curve in curves:
        away = float(np.sqrt(((foot(curve.points, point)[0] - point) ** 2).sum()))
        if away > _ASTRAY * size:
            raise ValueError(
                f"curve {curve.name!r} passes {away:.4g} away from {written(point)}, the point "
                "nearest to all curves; record curves through one point, or leave this one out"
            )
    return point


def written(point) -> str:
    """A point as the user writes it."""
    return ",".join(f"{x:.4g}" for x in point)
