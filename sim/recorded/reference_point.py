"""The reference point of recorded curves: where they meet, or a given one near them."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.sim.recorded.curves import Curve

# A curve that misses the reference point by more than this fraction of its size does not run
# through it.
_FAR = 0.25


def meeting_point(curves) -> np.ndarray:
    """(3,) point nearest to all curves (n, 3) in least squares, taken as polylines.

    Starts at the best of some samples and goes on by Gauss-Newton, each curve a line near its foot.

    >>> x = np.linspace(-1.0, 2.0, 7)[:, None]
    >>> curves = [x * [1.0, 0, 0], x * [0, 1.0, 0], x * [0.6, 0.8, 0] + [0, 0, 0.3]]
    >>> meeting_point(curves).round(6) + 0.0
    array([0. , 0. , 0.1])
    """
    # Three thousand samples are starts enough.
    stride = 1 + sum(map(len, curves)) // 3000
    samples = np.concatenate([curve[::stride] for curve in curves])
    total = sum(cKDTree(curve).query(samples)[0] ** 2 for curve in curves)
    point, best, least = samples[np.argmin(total)], samples[np.argmin(total)], np.inf
    for _ in range(20):
        feet, tangents = zip(*(foot(curve, point) for curve in curves), strict=True)
        miss = np.array(feet) - point
        if (square := float((miss * miss).sum())) < least:
            best, least = point, square
        across = len(curves) * np.eye(3) - np.array(tangents).T @ np.array(tangents)
        point = point + np.linalg.lstsq(across, miss.sum(axis=0), rcond=1e-6)[0]
    return best


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
    if not away <= _FAR * size:
        raise ValueError(
            f"the point {written(point)} is {away:.4g} away from all curves; give a point on "
            "them, or leave it out"
        )
    return np.asarray(point, dtype=float)


def common_point(curves: list[Curve]) -> np.ndarray:
    """Where the curves meet, no farther from any than they may miss each other."""
    point = meeting_point([curve.points for curve in curves])
    size = max(float(np.ptp(curve.points, axis=0).max()) for curve in curves)
    away = max(_misses(curves, point))
    if away > _FAR * size:
        raise ValueError(
            f"the curves meet nowhere: one passes {away:.4g} away from {written(point)}, the point "
            f"nearest to all; {_displaced(curves)}"
        )
    return point


def _misses(curves: list[Curve], point) -> list[float]:
    """Distance of each curve from a point."""
    return [float(np.hypot.reduce(foot(curve.points, point)[0] - point)) for curve in curves]


def _displaced(curves: list[Curve]) -> str:
    """What to do: leave out the curve without which the others meet, if there is one."""
    # The time to try each grows as the square of their number.
    if len(curves) > 20:
        return "give curves through one point to `fit`; `learn` takes any others"
    left = []
    for i in range(len(curves)):
        others = curves[:i] + curves[i + 1 :]
        size = max(float(np.ptp(curve.points, axis=0).max()) for curve in others)
        point = meeting_point([curve.points for curve in others])
        left.append(max(_misses(others, point)) / size)
    order = np.argsort(left)
    if left[order[0]] > 0.25 * left[order[1]] or left[order[0]] > _FAR:
        return "leaving out no single curve mends that; record curves through one point"
    name = curves[order[0]].name
    return (
        f"without curve {name!r} the others meet: see whether it has another unit or its columns "
        "in another order, or leave it out"
    )


def written(point) -> str:
    """A point as the user writes it."""
    return ",".join(f"{x:.4g}" for x in point)
