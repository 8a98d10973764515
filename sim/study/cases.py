"""One case: tracked curves of a known surface, as a method gets them, and the exact answer.

Surfaces are graphs z = height(x, y) about the origin; the unit is the reach.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.sim.study.heights import Height, Shape, graph_shape


@dataclass(frozen=True, eq=False)
class Truth:
    """The exact surface about the reference point, world.

    Parameters
    ----------
    around : callable
        (point (3,), distance) to points (n, 3) of the surface within that distance of the point.
    at : callable
        Point (3,) near the surface to the Shape at its foot.
    """

    around: Callable[[np.ndarray, float], np.ndarray]
    at: Callable[[np.ndarray], Shape]


@dataclass(frozen=True, eq=False)
class Track:
    """A recorded curve that no record has checked yet.

    Parameters
    ----------
    points : (n, 3) float, length, world
    through, normal : (3,) float, world
        A point of the sampling plane, and its unit normal.
    noise_std : float, length
        As the probe states it.
    """

    points: np.ndarray
    through: np.ndarray
    normal: np.ndarray
    noise_std: float


@dataclass(frozen=True, eq=False)
class Case:
    """What a method gets, and what it should find.

    Parameters
    ----------
    point, outward : (3,) float, world
        Reference point as a probe reports it, and a vector on the outer side.
    tracks : tuple of Track
    truth : Truth
    noise_std : float, length
        The true standard deviation of each coordinate of a good sample.
    reach : float, length
        How far a contour of full length runs from the reference point.
    probe : callable, optional
        (direction (3,), arm) to the Track of one more curve through the reference point, of good
        contacts. None where the case cannot be touched again.
    """

    point: np.ndarray
    outward: np.ndarray
    tracks: tuple[Track, ...]
    truth: Truth
    noise_std: float
    reach: float
    probe: Callable[[np.ndarray, float], Track] | None = None

    def contours(self) -> tuple[Contour, ...]:
        """The tracks as records. ValueError where a record refuses them."""
        ends = (ContourEnd.LENGTH_REACHED, ContourEnd.LENGTH_REACHED)
        return tuple(
            Contour(t.points, SamplingPlane(t.through, t.normal), t.noise_std, ends)
            for t in self.tracks
        )

    def with_points(self, change: Callable[[int, np.ndarray], np.ndarray]) -> "Case":
        """The case with other points: ``change`` maps number and points (n, 3) of each track."""
        tracks = [replace(t, points=change(i, t.points)) for i, t in enumerate(self.tracks)]
        return replace(self, tracks=tuple(tracks))

    def moved(self, rotation, scale: float, shift) -> "Case":
        """The case after x -> scale (rotation x) + shift."""
        old, again = self.truth, self.probe

        def back(point):
            return ((point - shift) / scale) @ rotation

        def there(points):
            return scale * points @ rotation.T + shift

        def around(point, distance: float):
            return there(old.around(back(point), distance / scale))

        def at(point) -> Shape:
            shape = old.at(back(point))
            return Shape(rotation @ shape.normal, shape.k1 / scale, shape.k2 / scale)

        def track(t: Track) -> Track:
            normal = rotation @ t.normal
            return Track(there(t.points), there(t.through), normal, scale * t.noise_std)

        return Case(
            *(there(self.point), rotation @ self.outward, tuple(map(track, self.tracks))),
            *(Truth(around, at), scale * self.noise_std, scale * self.reach),
            again and (lambda direction, arm: track(again(direction @ rotation, arm / scale))),
        )


@dataclass(frozen=True)
class Plan:
    """How the curves of a touch run; lengths in reaches. A good touch has the noise and the count
    of samples of the paper's.

    Parameters
    ----------
    angles, tilts : tuple of float, rad
        Directions of the curves in the tangent plane, and leans of their planes from the normal.
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
    counts: tuple[int, ...] = (19,) * 3
    misses: tuple[float, ...] = (0.0, 0.0, 0.0)
    noise: float = 1e-3
    stated: float | None = None

    def curves(self):
        """Angle, tilt, arms, count and miss of each curve."""
        parts = (self.angles, self.tilts, self.arms, self.counts, self.misses)
        return zip(*parts, strict=True)


def even_plan(rng: np.random.Generator, lean: float = np.pi / 18.0, **changes) -> Plan:
    """Three curves 60 degrees apart, their planes up to ``lean`` from upright."""
    tilts, start = tuple(lean * rng.uniform(-1.0, 1.0, 3)), rng.uniform(0.0, np.pi)
    angles = tuple(start + np.pi / 3.0 * i for i in range(3))
    return Plan(**({"angles": angles, "tilts": tilts} | changes))


def placed(case: Case, rng: np.random.Generator) -> Case:
    """The case turned and somewhere in the world, in millimetres."""
    return case.moved(random_rotation(rng), 20.0, 100.0 * rng.normal(size=3))


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """(3, 3) rotation, uniform."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def touch_graph(height: Height, plan: Plan, rng: np.random.Generator) -> Case:
    """A touch of the graph z = height(x, y) at the origin."""
    stated = plan.noise if plan.stated is None else plan.stated
    curves = [_graph_curve(height, *parts) for parts in plan.curves()]
    tracks = tuple(_track(curve, plan.noise, stated, rng) for curve in curves)
    origin = np.array([0.0, 0.0, float(height(*np.zeros((2, 1)))[0])])
    contact = origin + plan.noise * rng.normal(size=3)

    def probe(direction, arm: float) -> Track:
        angle = float(np.arctan2(direction[1], direction[0]))
        curve = _graph_curve(height, angle, 0.0, (arm, arm), Plan.counts[0], 0.0)
        return _track(curve, plan.noise, plan.noise, rng)

    up = np.array([0.0, 0.0, 1.0])
    return Case(contact, up, tracks, graph_truth(height), plan.noise, 1.0, probe)


def _track(curve, noise: float, stated: float, rng) -> Track:
    """What a probe reports of exact points on a plane."""
    points, through, normal = curve
    return Track(points + noise * rng.normal(size=points.shape), through, normal, stated)


def _graph_curve(height: Height, angle, tilt, arms, count, miss):
    """Exact points (n, 3) and plane of one curve, even along its direction.

    Newton's method along the upward axis; the curve ends where there is no root.
    """
    direction = np.array([np.cos(angle), np.sin(angle), 0.0])
    side = np.array([-np.sin(angle), np.cos(angle), 0.0])
    up = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * side
    s = np.linspace(-arms[0], arms[1], count)
    start, step = s[:, None] * direction + miss * side, 1e-6

    def above(t):
        x, y, z = (start + t[:, None] * up).T
        return z - height(x, y)

    t = np.zeros(count)
    for _ in range(60):
        value = above(t)
        slope = (above(t + step) - value) / step
        t = t - np.clip(value / np.where(np.abs(slope) > 1e-3, slope, 1e-3), -0.1, 0.1)
    first, last = _run(np.abs(above(t)) < 1e-11, int(np.abs(s).argmin()))
    return start[first:last] + t[first:last, None] * up, miss * side, np.cross(direction, up)


def _run(found, middle: int):
    """First and end of the unbroken run of True about the middle."""
    lost = np.flatnonzero(~found)
    first = int(max(lost[lost <= middle], default=-1)) + 1
    last = int(min(lost[lost > middle], default=len(found)))
    return (first, last) if last > first else (middle, middle + 1)


def graph_truth(height: Height) -> Truth:
    """The graph z = height(x, y) over the plane."""

    def around(point, distance: float):
        # Even in a disc, by the golden angle.
        number = np.arange(300)
        radii, angles = np.sqrt((number + 0.5) / 300), number * np.pi * (3.0 - np.sqrt(5.0))
        x = point[0] + distance * radii * np.cos(angles)
        y = point[1] + distance * radii * np.sin(angles)
        points = np.column_stack([x, y, height(x, y)])
        near = ((points - point) ** 2).sum(axis=1) <= distance**2
        # Over a steep place all points may be farther: the nearest one stands for them.
        return points[near] if near.any() else points[:1]

    return Truth(around, lambda point: graph_shape(height, point[0], point[1]))
