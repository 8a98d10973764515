"""Behind edges: guesses where the face behind the end of a contour at an edge may be touched."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.planner.attempts import Target
from touchatlas.planner.places import Places
from touchatlas.planner.probe_plan import Reason
from touchatlas.planner.view import View

# Guesses in turn: whether the edge is convex, and how far from it to touch, in reaches. The near
# ones are for thin walls, low steps and blunt edges.
_GUESSES = ((True, 0.3), (False, 0.3), (True, 0.08), (False, 0.08))


@dataclass(frozen=True, eq=False)
class EdgeEnds:
    """The k ends of contours at edges, as arrays.

    Parameters
    ----------
    points : (k, 3) float, length, world
        The last sample before the edge.
    tangents, normals : (k, 3) float, unit, world
        Direction of travel at the end, and outward normal of the face.
    steps : (k,) float, length
        Distance between samples.
    """

    points: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray
    steps: np.ndarray

    def some(self, index) -> "EdgeEnds":
        """Those of an index or mask."""
        return EdgeEnds(*(column[index] for column in vars(self).values()))


def behind_edge(view: View, _: Places) -> Target | None:
    """The next guess at a face behind an edge, where more than a fourth of all arms end at edges.
    None where all guesses were made, or one is not answered.

    Where most contours run over edges, places behind the others are found as others are. Ends with
    the fewest guesses come first, and of these the one nearest to the probe.
    """
    atlas, attempts = view.atlas, view.attempts
    arms = 2 * view.options.curves * atlas.touches
    if atlas.pool.edges.sum() <= 0.25 * arms or attempts.guesses:
        return None
    ends = unknown_ends(atlas)
    offset = ends.points[:, None] - np.reshape(attempts.ends, (-1, 3))
    guesses = ((offset * offset).sum(axis=2) <= atlas.scale**2).sum(axis=1)
    if not guesses.min(initial=len(_GUESSES)) < len(_GUESSES):
        return None
    away = ((ends.points - view.touched[-1]) ** 2).sum(axis=1)
    i = int(np.lexsort((away, guesses))[0])
    convex, fraction = _GUESSES[guesses[i]]
    tangent, half = ends.tangents[i], 0.5 * ends.steps[i]
    edge = ends.points[i] + half * tangent
    height = fraction * view.options.reach * view.extent * ends.normals[i]
    # Behind a convex edge the face is taken to fall away at a right angle, with its outward normal
    # along the travel. Behind a concave edge it is taken to rise, facing back.
    side = 1.0 if convex else -1.0
    point = edge + half * tangent - height if convex else edge + height
    return Target(point, side * tangent, Reason.EXPAND, end=ends.points[i])


def unknown_ends(atlas: Atlas) -> EdgeEnds:
    """The ends of contours at edges behind which no face of another direction is known: one step
    ahead, its normal would differ by more than 20 degrees."""
    pool = atlas.pool
    found = [_end(pool, i) for i in np.flatnonzero(pool.edges).tolist()]
    columns = zip(*(one for one in found if one is not None), strict=True)
    shapes = (-1, 3), (-1, 3), (-1, 3), (-1,)
    arrays = list(columns) or [()] * 4
    ends = EdgeEnds(*(np.reshape(a, s) for a, s in zip(arrays, shapes, strict=True)))
    if atlas.body is None or not len(ends.points):
        return ends
    ahead, known = atlas.body.at(ends.points + ends.steps[:, None] * ends.tangents)
    other = (ahead.normal * ends.normals).sum(axis=1) < np.cos(np.deg2rad(20.0))
    return ends.some(~(known & other))


def _end(pool: SamplePool, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float] | None:
    """Point, direction of travel, normal and step at the last sample ``i`` of a contour, from the
    three samples of its plane that are nearest; None where none is apart from it."""
    point, normal = pool.points[i], pool.normals[i]
    same = pool.points[(pool.across == pool.across[i]).all(axis=1)]
    away = np.linalg.norm(same - point, axis=1)
    before = np.argsort(away, kind="stable")[1:4]
    if not len(before) or not away[before[-1]] > 0.0:
        return None
    chord = point - same[before[-1]]
    tangent = chord - (chord @ normal) * normal
    size = float(np.linalg.norm(tangent))
    if not size > 0.0:
        return None
    return point, tangent / size, normal, float(away[before[-1]]) / len(before)
