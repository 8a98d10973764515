"""One case: tracked curves of a known surface, as a method gets them, and the exact answer."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch import Contour, ContourEnd, SamplingPlane

SOFT = (ContourEnd.LENGTH_REACHED, ContourEnd.LENGTH_REACHED)


@dataclass(frozen=True, eq=False)
class Shape:
    """The surface at one point: outward unit normal (3,) and principal curvatures k1 >= k2."""

    normal: np.ndarray
    k1: float
    k2: float


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
    through : (3,) float, length, world
        A point of the sampling plane.
    normal : (3,) float, unit, world
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
        return tuple(
            Contour(t.points, SamplingPlane(t.through, t.normal), t.noise_std, SOFT)
            for t in self.tracks
        )


def with_points(case: Case, change: Callable[[int, np.ndarray], np.ndarray]) -> Case:
    """The case with other points: ``change`` maps number and points (n, 3) of each track."""
    tracks = [replace(t, points=change(i, t.points)) for i, t in enumerate(case.tracks)]
    return replace(case, tracks=tuple(tracks))


def moved(case: Case, rotation, scale: float, shift) -> Case:
    """The case after x -> scale (rotation x) + shift."""
    old = case.truth

    def back(point):
        return ((point - shift) / scale) @ rotation

    def around(point, distance: float):
        return scale * old.around(back(point), distance / scale) @ rotation.T + shift

    def at(point) -> Shape:
        shape = old.at(back(point))
        return Shape(rotation @ shape.normal, shape.k1 / scale, shape.k2 / scale)

    def there(points):
        return scale * points @ rotation.T + shift

    def track(t: Track) -> Track:
        return Track(there(t.points), there(t.through), rotation @ t.normal, scale * t.noise_std)

    def probe(direction, arm: float) -> Track:
        assert case.probe is not None
        return track(case.probe(direction @ rotation, arm / scale))

    return Case(
        *(there(case.point), rotation @ case.outward, tuple(map(track, case.tracks))),
        *(Truth(around, at), scale * case.noise_std, scale * case.reach),
        probe if case.probe else None,
    )
