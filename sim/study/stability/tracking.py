"""Curves that a probe would track on a known surface: lengths, planes, counts, noise."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.sim.study.stability.case import Case, Track, moved
from touchatlas.sim.study.stability.surfaces import Height, ball_truth, graph_truth

# Noise of a good touch over the reach: 0.02 mm of 20 mm, as in the paper.
NOISE = 1e-3
# Samples of a contour, as in the paper.
COUNT = 19
_UP = np.array([0.0, 0.0, 1.0])
# The unit of a case, mm; and where it lies, in reaches.
_REACH, _PLACE = 20.0, 5.0
_NEWTON_STEPS, _CONVERGED, _STEP = 60, 1e-11, 1e-6


@dataclass(frozen=True)
class Plan:
    """How the curves of a touch run; lengths in reaches.

    Parameters
    ----------
    angles : tuple of float, rad
        Directions of the curves in the tangent plane.
    tilts : tuple of float, rad
        Lean of each sampling plane from the normal.
    arms : tuple of pairs of float
        Lengths before and after the reference point.
    counts : tuple of int
        Samples of each curve.
    misses : tuple of float
        How far each plane misses the reference point.
    noise, stated : float
        Standard deviation of each coordinate, true and as the probe states it.
    """

    angles: tuple[float, ...]
    tilts: tuple[float, ...] = (0.0, 0.0, 0.0)
    arms: tuple[tuple[float, float], ...] = ((1.0, 1.0),) * 3
    counts: tuple[int, ...] = (COUNT,) * 3
    misses: tuple[float, ...] = (0.0, 0.0, 0.0)
    noise: float = NOISE
    stated: float | None = None


def even_angles(rng: np.random.Generator, count: int = 3) -> tuple[float, ...]:
    """Directions spread evenly over 180 degrees, from a random one on."""
    start = rng.uniform(0.0, np.pi)
    return tuple(start + np.pi / count * i for i in range(count))


def placed(case: Case, rng: np.random.Generator) -> Case:
    """The case somewhere in the world, rotated, in millimetres."""
    return moved(case, random_rotation(rng), _REACH, _PLACE * _REACH * rng.normal(size=3))


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """(3, 3) rotation, uniform."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def touch_graph(height: Height, plan: Plan, rng: np.random.Generator) -> Case:
    """A touch of the graph z = height(x, y) at the origin; the reach is one."""
    curves = [_graph_curve(height, *parts) for parts in _parts(plan)]
    origin = np.array([0.0, 0.0, float(height(*np.zeros((2, 1)))[0])])
    case = _case(curves, graph_truth(height), origin, plan, rng)

    def probe(direction, arm: float) -> Track:
        angle = float(np.arctan2(direction[1], direction[0]))
        curve = _graph_curve(height, angle, 0.0, (arm, arm), COUNT, 0.0)
        return _track(curve, plan.noise, plan.noise, rng)

    return replace(case, probe=probe)


def touch_ball(radius: float, plan: Plan, rng: np.random.Generator) -> Case:
    """A touch of a ball at its highest point; arms are arc lengths and may pass the equator."""
    curves = [_ball_curve(radius, *parts) for parts in _parts(plan)]
    return _case(curves, ball_truth(radius), np.zeros(3), plan, rng)


def _parts(plan: Plan):
    return zip(plan.angles, plan.tilts, plan.arms, plan.counts, plan.misses, strict=True)


def _axes(angle: float, tilt: float):
    """Direction, side and the upward axis of a sampling plane."""
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    side = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return direction, side, np.cos(tilt) * _UP + np.sin(tilt) * side


def _graph_curve(height: Height, angle, tilt, arms, count, miss):
    """Exact points (n, 3) and plane of one curve, even along its direction.

    Newton's method along the upward axis; the curve ends where there is no root.
    """
    direction, side, up = _axes(angle, tilt)
    s = np.linspace(-arms[0], arms[1], count)
    start = s[:, None] * direction + miss * side
    t = np.zeros(count)
    for _ in range(_NEWTON_STEPS):
        value = _above(height, start + t[:, None] * up)
        slope = (_above(height, start + (t + _STEP)[:, None] * up) - value) / _STEP
        slope = np.where(np.abs(slope) > 1e-3, slope, 1e-3)
        t = t - np.clip(value / slope, -0.1, 0.1)
    found = np.abs(_above(height, start + t[:, None] * up)) < _CONVERGED
    first, last = _run(found, int(np.abs(s).argmin()))
    return start[first:last] + t[first:last, None] * up, miss * side, np.cross(direction, up)


def _above(height: Height, points):
    return points[:, 2] - height(points[:, 0], points[:, 1])


def _run(found, middle: int):
    """First and end of the unbroken run of True about the middle."""
    lost = np.flatnonzero(~found)
    before, after = lost[lost <= middle], lost[lost > middle]
    first = int(before.max()) + 1 if len(before) else 0
    last = int(after.min()) if len(after) else len(found)
    return (first, last) if last > first else (middle, middle + 1)


def _ball_curve(radius, angle, tilt, arms, count, miss):
    """Exact points and plane of a circle on the ball, even in arc length."""
    direction, side, up = _axes(angle, tilt)
    normal = np.cross(direction, up)
    centre = -radius * _UP
    off = (miss * side - centre) @ normal
    circle = np.sqrt(max(radius**2 - off**2, 0.0))
    middle = centre + off * normal
    s = np.linspace(-arms[0], arms[1], count) / circle
    return (
        middle + circle * (np.outer(np.sin(s), direction) + np.outer(np.cos(s), up)),
        (miss * side),
        normal,
    )


def _case(curves, truth, point, plan: Plan, rng) -> Case:
    stated = plan.noise if plan.stated is None else plan.stated
    tracks = tuple(_track(curve, plan.noise, stated, rng) for curve in curves)
    contact = point + plan.noise * rng.normal(size=3)
    return Case(contact, _UP, tracks, truth, plan.noise, 1.0)


def _track(curve, noise: float, stated: float, rng) -> Track:
    """What a probe reports of exact points on a plane."""
    points, through, normal = curve
    return Track(points + noise * rng.normal(size=points.shape), through, normal, stated)
