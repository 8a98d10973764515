"""Safe ways: how a tip comes from one touch to the next without meeting what is known."""

from collections.abc import Callable

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent


def safe_way(
    atlas: Atlas, start, goal, radius: float, margin: float, directions: int = 60
) -> np.ndarray | None:
    """Points of a way of a tip's centre that is free as far as is known.

    It is straight where that keeps clear of what is known. Otherwise it leaves the sphere about
    everything that is known, goes around outside of it, and comes in again: ways between touches
    are few, and a detour takes a second.

    Parameters
    ----------
    atlas : Atlas
    start, goal : (3,) float, length, world
        Centre of the tip now, and where the next approach begins.
    radius, margin : float, length
        Of the tip; and what is kept clear besides, but near both ends, which are as near to the
        surface as they are.
    directions : int
        Spread evenly, in which a clear way out of the sphere is looked for.

    Returns
    -------
    (k, 3) float, length, world, or None
        The last is the goal; the start is not among them. None where no straight way out of the
        sphere is clear from one of them: the goal is not reached.
    """
    start, goal = np.asarray(start, float), np.asarray(goal, float)
    known = _Known(atlas, radius, margin)
    if known.is_clear(start, goal, leaves=True):
        return goal[None].copy()
    leave, enter = known.leave(start, directions), known.way_out(goal, directions)
    if leave is None or enter is None:
        return None
    return np.vstack([leave, known.around(leave[-1], enter), enter, goal])


def ways_of(
    atlas: Atlas, margin: float
) -> Callable[[np.ndarray, np.ndarray, float], np.ndarray | None]:
    """A function from start, goal and radius of a tip to ``safe_way``."""
    return lambda start, goal, radius: safe_way(atlas, start, goal, radius, margin)


class _Known:
    """What is known of a body, as an obstacle for a tip, and the sphere about it."""

    def __init__(self, atlas: Atlas, radius: float, margin: float) -> None:
        points = atlas.pool.points
        self._points, self._body, self._room = points, atlas.body, radius + margin
        self._noise = atlas.levels.sure * atlas.pool.noise
        if len(points):
            low, high = points.min(axis=0), points.max(axis=0)
            self.centre = 0.5 * (low + high)
            self.radius = self._room + float(np.linalg.norm(points - self.centre, axis=1).max())

    def is_clear(self, start, goal, leaves: bool = False) -> bool:
        """Whether a straight way keeps clear of the points, and out of the body. A tip that
        ``leaves`` is at the start."""
        if not len(self._points):
            return True
        way = goal - start
        square = float(way @ way)
        if square == 0.0:
            return True
        offset = self._points - start
        at = np.clip(offset @ way / square, 0.0, 1.0)
        near = np.linalg.norm(offset - at[:, None] * way, axis=1)
        ends = np.minimum(
            np.linalg.norm(offset, axis=1), np.linalg.norm(self._points - goal, axis=1)
        )
        # Nothing is nearer on the way than it is at one end, or than there is room; samples are as
        # far off as their noise.
        if (near < 0.99 * np.minimum(self._room, ends) - self._noise).any():
            return False
        return self._body is None or not self._enters(start, way, np.sqrt(square), leaves)

    def _enters(self, start, way, length: float, leaves: bool) -> bool:
        """Whether a way comes nearer to the known body than there is room, looked at in steps of
        that; near its ends whether it is inside. A tip that is inside of what is known shows it to
        be wrong there, and leaves by a way that leads out all along."""
        count = min(2 + int(length / self._room), 400)
        at = np.linspace(0.0, 1.0, count)[:-1]
        assert self._body is not None
        found, sure = self._body.at(start + at[:, None] * way)
        inside = np.logical_and.accumulate(sure & (found.distance < 0.0))
        within = int(inside.sum()) if leaves else 0
        if (np.diff(found.distance[:within]) < 0.0).any():
            return True
        at, distance, sure = at[within:], found.distance[within:], sure[within:]
        if not len(at):
            return False
        inner = np.minimum(at - at[0], 1.0 - at) * length > 2.0 * self._room
        return bool((sure & (distance < np.where(inner, self._room, 0.0))).any())

    def leave(self, start, directions: int) -> np.ndarray | None:
        """(k, 3) points of a clear way of a tip that is at a start to where it leaves the sphere:
        straight, or first along the normal of the known surface, as far as there has to be room; a
        way that leans comes nearer to samples beside it. None where there is none."""
        out = self.way_out(start, directions, True)
        if out is not None:
            return out[None]
        if self._body is None:
            return None
        lifted = start + self._room * self._body.at(start[None])[0].normal[0]
        out = self.way_out(lifted, directions)
        clear = out is not None and self.is_clear(start, lifted, leaves=True)
        return np.stack([lifted, out]) if clear and out is not None else None

    def way_out(self, point, directions: int, leaves: bool = False) -> np.ndarray | None:
        """(3,) where a clear straight way from a point leaves the sphere, as straight outward as
        there is one; None where there is none."""
        if not len(self._points) or np.linalg.norm(point - self.centre) >= self.radius:
            return np.array(point)
        outward = point - self.centre
        length = float(np.linalg.norm(outward))
        outward = outward / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
        tried = np.vstack([outward, _sphere(directions)])
        order = np.argsort(-(tried @ outward), kind="stable")
        exits = (self._exit(point, tried[k]) for k in order)
        return next((end for end in exits if self.is_clear(point, end, leaves)), None)

    def _exit(self, point, direction) -> np.ndarray:
        """(3,) where a ray from a point inside leaves the sphere."""
        offset = point - self.centre
        half = float(offset @ direction)
        found: np.ndarray = point + direction * (
            np.sqrt(half * half + self.radius**2 - offset @ offset) - half
        )
        return found

    def around(self, start, goal, chord: float = np.pi / 8.0) -> np.ndarray:
        """(k, 3) points of a great circle about the sphere between two points on or outside of it,
        so far out that chords over an angle (rad) stay outside."""
        if not len(self._points):
            return np.zeros((0, 3))
        a, b = ((p - self.centre) / np.linalg.norm(p - self.centre) for p in (start, goal))
        angle = float(np.arccos(np.clip(a @ b, -1.0, 1.0)))
        count = int(np.ceil(angle / chord))
        aside = b - (a @ b) * a
        size = float(np.linalg.norm(aside))
        aside = aside / size if size > 1e-9 else any_tangent(a)
        at = angle * np.linspace(0.0, 1.0, count + 1)[:, None]
        out = max(self.radius, *(float(np.linalg.norm(p - self.centre)) for p in (start, goal)))
        arc = np.cos(at) * a + np.sin(at) * aside
        found: np.ndarray = self.centre + out / np.cos(0.5 * chord) * arc
        return found


def _sphere(count: int) -> np.ndarray:
    """(count, 3) unit vectors, spread evenly: a Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    level = np.sqrt(1.0 - z * z)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
