"""PassedAir: balls of air where a probe passed through what the faces have as inside."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.surfaces.sextic_sites import pairs_within

# Points of a way: a ball of air about each overlaps the next where a way passes samples by a
# sixteenth of its length.
_STEPS = 32


@dataclass(frozen=True, eq=False)
class PassedAir:
    """Balls in which there is air, because a probe passed their middles.

    Parameters
    ----------
    middles : (m, 3) float, length, world
    radii : (m,) float, length
        Half of the distance of the middle from the nearest sample: between a ball and that sample
        the surface is a guess.
    """

    middles: np.ndarray
    radii: np.ndarray

    def moved(self, points, distance, normal, deviation) -> dict[str, np.ndarray]:
        """Distance (n,), normal (n, 3) and deviation (n,) at points (n, 3) of a body without the
        balls, by name: the larger one of its distance and of that of the complement of the balls,
        which is the difference of solids (A. Ricci, "A constructive geometry for computer
        graphics", The Computer Journal 16, 1973). Where that changes the distance,
        the deviation is the radius: the surface may be so far from the ball."""
        rows, ball, depth = self._deepest(points)
        outside = depth > distance[rows]
        rows, ball, depth = rows[outside], ball[outside], depth[outside]
        distance, normal, deviation = distance.copy(), normal.copy(), deviation.copy()
        deviation[rows] = np.maximum(deviation[rows], self.radii[ball])
        distance[rows] = depth
        inward = points[rows] - self.middles[ball]
        length = np.linalg.norm(inward, axis=1)
        off = length > 0.0
        normal[rows[off]] = -inward[off] / length[off, None]
        return {"distance": distance, "normal": normal, "deviation": deviation}

    def _deepest(self, points) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The points (k,) of points (n, 3) near balls, the ball in which each lies deepest, and how
        deep, length. Balls are asked by their sizes: large ones reach many points."""
        size = np.floor(np.log2(self.radii / self.radii.max()))
        parts = [self._depths(points, np.flatnonzero(size == one)) for one in np.unique(size)]
        rows, ball, depth = (np.concatenate(column) for column in zip(*parts, strict=True))
        # The ball in which a point lies deepest comes last among its balls.
        order = np.lexsort((depth, rows))
        order = order[np.diff(rows[order], append=-1) != 0]
        return rows[order], ball[order], depth[order]

    def _depths(self, points, balls) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The same of all pairs of near points and some balls (m,)."""
        trees, reach = (cKDTree(points), cKDTree(self.middles[balls])), self.radii[balls].max()
        rows, ball, away = pairs_within(*trees, 2.0 * float(reach))
        ball = balls[ball]
        return rows, ball, self.radii[ball] - away


def air_inside(
    ways,
    distance: Callable[[np.ndarray], np.ndarray],
    away: Callable[[np.ndarray], np.ndarray],
    is_known: Callable[[np.ndarray], np.ndarray],
    reach: float,
    std: float,
    sure: float,
) -> PassedAir | None:
    """Balls of air about points of straight ways that faces have inside; None where none is.

    Below a known surface these are points near a place where the way crosses it: a way along the
    inner side of a wall, behind which faces have the body solid, says nothing of the wall.

    Parameters
    ----------
    ways : (m, 2, 3) float, length, world
        Ends of straight ways on which a probe passed.
    distance, away : function from points (n, 3) to (n,) float, length
        Signed distance from the faces, and distance from the nearest sample.
    is_known : function from points (n, 3) to (n,) bool
        Whether the surface is known at their feet.
    reach : float, length
        Distance from samples up to which faces are believed.
    std : float, length
        Standard deviation of a sample.
    sure : float
        Depth inside of the faces at which these are wrong, in such deviations, beyond a fifth of
        the distance of the nearest sample.
    """
    points, way = _along(ways).reshape(-1, 3), np.tile(np.arange(len(ways)), _STEPS)
    clear = away(points)
    # A sample on a way has no room for air, whatever the faces make of it.
    some = (clear > 0.0) & (clear < reach)
    points, way, clear = points[some], way[some], clear[some]
    inside = distance(points) < -(0.2 * clear + sure * std)
    if not inside.any():
        return None
    points, way, radii = points[inside], way[inside], 0.5 * clear[inside]
    kept = ~is_known(points)
    crossed, _ = crossings(_along(ways[np.unique(way[~kept])]), distance)
    if len(crossed):
        kept |= cKDTree(crossed).query(points)[0] <= radii
    return PassedAir(points[kept], radii[kept]) if kept.any() else None


def through_openings(
    ways,
    at: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    is_open: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> np.ndarray:
    """(m,) whether ways pass through a surface where it is open, or begin inside, where they came
    through another opening: inside is air as well.

    Parameters
    ----------
    ways : (m, 2, 3) float, length, world
    at : function from points (n, 3) to signed distance (n,), length, and normal (n, 3) of faces
    is_open : function from points (n, 3) of faces and their normals (n, 3) to (n,) bool
    """
    points = _along(ways)
    crossed, way = crossings(points, lambda some: at(some)[0])
    entered = np.bincount(way, is_open(crossed, at(crossed)[1]), len(ways)) > 0
    return np.asarray(entered | (at(points[0])[0] < 0.0))


def crossings(
    points, distance: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Where ways cross a surface (k, 3), and the number of the way (k,), by the signed distances of
    points (s, m, 3) along each of them: where a straight line between two places is zero."""
    depth = distance(points.reshape(-1, 3)).reshape(points.shape[:2])
    place, way = np.nonzero((depth[:-1] < 0.0) != (depth[1:] < 0.0))
    first, second = depth[place, way], depth[place + 1, way]
    share = (first / (first - second))[:, None]
    return (1.0 - share) * points[place, way] + share * points[place + 1, way], way


def _along(ways) -> np.ndarray:
    """(s, m, 3) points of ways (m, 2, 3), at equal distances from end to end."""
    along = np.linspace(0.0, 1.0, _STEPS)[:, None, None]
    return np.asarray(ways[:, 0] + along * (ways[:, 1] - ways[:, 0]))
