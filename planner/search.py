"""Search: approaches along rays that pass what is known, for parts that no contour leads to."""

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.places import Places
from touchatlas.planner.planes import concurrent_planes
from touchatlas.planner.probe_plan import ProbePlan, Reason

# Radius of the ball about what is known in which other parts are looked for, in extents. Doubled,
# eight times as much room is searched with the same rays.
_ROOM = 1.0
# Distance from a ray within which a part is taken to be met, and least distance of a ray from what
# is known, in extents. Doubled, smaller parts are missed; parts near what is known are missed.
_SEEN, _CLEAR = 0.1, 0.05
# Directions of rays, rays of each direction, and points of the room that rays see. Doubled, the
# room is filled more evenly, and planning takes twice as long.
_DIRECTIONS, _OFFSETS, _POINTS = 48, 60, 1000
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def search_plan(
    atlas: Atlas, places: Places, before: list[np.ndarray], extent: float, options: PlannerOptions
) -> ProbePlan | None:
    """The plan of an approach along the ray that passes most of the room that no ray has passed;
    None where none is left.

    The room is a ball about what is known. Rays keep clear of what is known, and of the pin's
    radius. The plan has the number 0.

    Parameters
    ----------
    before : list of (2, 3) float
        A point, length, and the direction, unit, of each earlier ray.
    extent : float, length
        Diagonal of the bounding box of all samples.
    """
    samples = atlas.pool.points
    solid = np.concatenate([samples, places.points])
    middle, room = 0.5 * (samples.min(axis=0) + samples.max(axis=0)), _ROOM * extent
    points, normals = _rays(middle, room)
    clear = _distances(solid, points, normals).min(axis=1) > max(
        _CLEAR * extent, options.pin_radius
    )
    unseen = middle + room * _ball(_POINTS)
    for point, normal in before:
        unseen = unseen[_distances(unseen, point[None], normal[None])[0] > _SEEN * extent]
    seen = (_distances(unseen, points, normals) <= _SEEN * extent).sum(axis=1) * clear
    best = int(seen.argmax())
    if not seen[best]:
        return None
    point, normal = points[best], normals[best]
    return ProbePlan(
        0,
        point,
        normal,
        concurrent_planes(point, normal, any_tangent(normal), options.curves),
        options.reach * extent,
        options.step * extent,
        options.max_turn,
        Reason.SEARCH,
        step_turn=options.step_turn,
        approach=float(np.sqrt(max(room**2 - ((point - middle) ** 2).sum(), 0.0))),
    )


def _rays(middle, room: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles (n, 3), length, of chords of a ball about ``middle`` (3,), and their directions
    (n, 3): spirals over half of all directions, and over the disc across each."""
    height = 1.0 - (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    around = _GOLDEN * np.arange(_DIRECTIONS)
    flat = np.sqrt(1.0 - height**2)
    normals = np.stack([flat * np.cos(around), flat * np.sin(around), height], axis=1)
    radius = np.sqrt((np.arange(_OFFSETS) + 0.5) / _OFFSETS)
    angle = _GOLDEN * np.arange(_OFFSETS)
    first = np.array([any_tangent(normal) for normal in normals])
    axes = np.stack([first, np.cross(normals, first)], axis=1)
    offsets = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = middle + room * np.einsum("oi,dix->dox", offsets, axes)
    return points.reshape(-1, 3), np.repeat(normals, _OFFSETS, axis=0)


def _ball(count: int) -> np.ndarray:
    """(n, 3) points of equal volumes of the unit ball: a spiral over its directions, with radii
    that follow the additive sequence of the square root of 2."""
    each = np.arange(count) + 0.5
    height, around = 1.0 - 2.0 * each / count, _GOLDEN * each
    flat = np.sqrt(1.0 - height**2)
    radius = np.cbrt((np.sqrt(2.0) * each) % 1.0)
    return radius[:, None] * np.stack(
        [flat * np.cos(around), flat * np.sin(around), height], axis=1
    )


def _distances(points, through, along) -> np.ndarray:
    """(m, n) distances of points (n, 3) from lines through points (m, 3) with unit directions
    (m, 3), length."""
    # |p - a|^2 - ((p - a) d)^2, without an array of (m, n, 3).
    beside = points @ along.T - (through * along).sum(axis=1)
    square = (points**2).sum(axis=1)[:, None] - 2.0 * points @ through.T + (through**2).sum(axis=1)
    out: np.ndarray = np.sqrt(np.maximum(square - beside**2, 0.0)).T
    return out
