"""Search: approaches along rays that pass what is known, for parts that no contour leads to."""

import numpy as np

from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.attempts import Target
from touchatlas.planner.places import Places
from touchatlas.planner.probe_plan import Reason
from touchatlas.planner.view import View

GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def other_part(view: View, places: Places) -> Target | None:
    """The ray that passes most of the room that no ray has passed. None where none is left, or no
    more are asked for.

    The room is a ball about what is known, of one extent. A ray sees what is within a tenth of the
    extent, and keeps a twentieth, and the pin's radius, clear of what is known.
    """
    rays, extent = view.attempts.rays, view.extent
    if len(rays) >= view.options.search:
        return None
    samples, seen = view.atlas.pool.points, 0.1 * extent
    middle = 0.5 * (samples.min(axis=0) + samples.max(axis=0))
    points, normals = _rays(middle, extent)
    solid = np.concatenate([samples, places.points])
    least = max(0.5 * seen, view.options.pin_radius)
    clear = distances_from_lines(solid, points, normals).min(axis=1) > least
    unseen = middle + extent * _ball(1000)
    for point, normal in rays:
        unseen = unseen[distances_from_lines(unseen, point[None], normal[None])[0] > seen]
    passed = (distances_from_lines(unseen, points, normals) <= seen).sum(axis=1) * clear
    best = int(passed.argmax())
    if not passed[best]:
        return None
    point = points[best]
    half = float(np.sqrt(max(extent**2 - ((point - middle) ** 2).sum(), 0.0)))
    return Target(point, normals[best], Reason.SEARCH, approach=half)


def _rays(middle, room: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles (n, 3), length, of chords of a ball about ``middle`` (3,), and their directions
    (n, 3): spirals over half of all directions, and over the disc across each."""
    directions, offsets = 48, 60
    height = 1.0 - (np.arange(directions) + 0.5) / directions
    around, flat = GOLDEN * np.arange(directions), np.sqrt(1.0 - height**2)
    normals = np.stack([flat * np.cos(around), flat * np.sin(around), height], axis=1)
    radius = np.sqrt((np.arange(offsets) + 0.5) / offsets)
    angle = GOLDEN * np.arange(offsets)
    first = np.array([any_tangent(normal) for normal in normals])
    axes = np.stack([first, np.cross(normals, first)], axis=1)
    disc = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = middle + room * np.einsum("oi,dix->dox", disc, axes)
    return points.reshape(-1, 3), np.repeat(normals, offsets, axis=0)


def _ball(count: int) -> np.ndarray:
    """(n, 3) points of equal volumes of the unit ball: a spiral over its directions, with radii
    that follow the additive sequence of the square root of 2."""
    each = np.arange(count) + 0.5
    height, around = 1.0 - 2.0 * each / count, GOLDEN * each
    flat, radius = np.sqrt(1.0 - height**2), np.cbrt((np.sqrt(2.0) * each) % 1.0)
    return radius[:, None] * np.stack(
        [flat * np.cos(around), flat * np.sin(around), height], axis=1
    )


def distances_from_lines(points, through, along) -> np.ndarray:
    """(m, n) distances of points (n, 3) from lines through points (m, 3) with unit directions
    (m, 3), length."""
    # |p - a|^2 - ((p - a) d)^2, without an array of (m, n, 3).
    parallel = points @ along.T - (through * along).sum(axis=1)
    square = (points**2).sum(axis=1)[:, None] - 2.0 * points @ through.T + (through**2).sum(axis=1)
    out: np.ndarray = np.sqrt(np.maximum(square - parallel**2, 0.0)).T
    return out
