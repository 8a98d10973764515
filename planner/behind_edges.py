"""Behind edges and bends: where contours end there, the surface beyond is touched from outside."""

from typing import NamedTuple

import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.planner.attempts import Target
from touchatlas.planner.clearance import clear_height
from touchatlas.planner.places import Places
from touchatlas.planner.probe_plan import ProbePlan, Reason
from touchatlas.planner.view import View

# Guesses in turn: whether the edge is convex, and how far from it to touch, in reaches. The near
# ones are for thin walls, low steps and blunt edges.
_GUESSES = ((True, 0.3), (False, 0.3), (True, 0.08), (False, 0.08))


class EdgeEnds(NamedTuple):
    """The k ends of contours at edges: the last samples (k, 3) before the edges, length, world; the
    directions of travel and the outward normals (k, 3) there, unit; and the distances (k,) between
    samples, length."""

    points: np.ndarray
    tangents: np.ndarray
    normals: np.ndarray
    steps: np.ndarray


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
    table = np.reshape([one for one in found if one is not None], (-1, 10))
    ends = EdgeEnds(table[:, :3], table[:, 3:6], table[:, 6:9], table[:, 9])
    if atlas.body is None or not len(ends.points):
        return ends
    ahead, known = atlas.body.at(ends.points + ends.steps[:, None] * ends.tangents)
    other = (ahead.normal * ends.normals).sum(axis=1) < np.cos(np.deg2rad(20.0))
    return EdgeEnds(*(column[~(known & other)] for column in ends))


def _end(pool: SamplePool, i: int) -> np.ndarray | None:
    """Point, direction of travel, normal and step (10,) at the last sample ``i`` of a contour, from
    the three samples of its plane that are nearest; None where none is apart from it."""
    point, normal = pool.points[i], pool.normals[i]
    same = pool.points[(pool.across == pool.across[i]).all(axis=1)]
    away = np.linalg.norm(same - point, axis=1)
    before = np.argsort(away, kind="stable")[1:4]
    if not len(before) or not away[before[-1]] > 0.0:
        return None
    chord = point - same[before[-1]]
    tangent = chord - (chord @ normal) * normal
    size = float(np.linalg.norm(tangent))
    step = away[before[-1]] / len(before)
    return np.array([*point, *(tangent / size), *normal, step]) if size > 0.0 else None


def bend_near(target: Target, view: View) -> Target:
    """A target where the surface ends; instead of it the nearest sharp bend, from outside, where
    three arms or more ended before one: arms of a touch there would end before the bend, too.

    A bend in an oblique plane may be that of its contour alone. What faces the bend, as at the
    bottom of a groove, stands in the way from outside.
    """
    bends = np.reshape(view.attempts.bends, (-1, 2, 3))
    away = np.linalg.norm(bends[:, 0] - target.point, axis=1)
    near = away <= view.options.levels.about * view.extent
    free = np.flatnonzero(near & view.is_free(bends[:, 0]))
    if np.count_nonzero(near) < 3 or not len(free):
        return target
    point, ahead = bends[free[away[free].argmin()]]
    if clear_height(view.atlas, point, ahead, view.options.levels.about * view.extent) > 0.0:
        return target
    return Target(point, ahead, Reason.EXPAND)


def sharp_bends(touch: Touch, plan: ProbePlan) -> list[np.ndarray]:
    """Points before sharp bends at the ends of the contours of a touch, and the directions of the
    arms there: (2, 3) each, length and unit, world."""
    found = (_bend(touch, plan, one, last) for one in touch.contours for last in (False, True))
    return [bend for bend in found if bend is not None]


def _bend(touch: Touch, plan: ProbePlan, contour: Contour, last: bool) -> np.ndarray | None:
    """The bend (2, 3) at the first or last end of a contour: an arm that turned away though it had
    turned by 45 degrees less than it may would have turned as far within one step."""
    contact = int(((contour.points - touch.contact) ** 2).sum(axis=1).argmin())
    arm = contour.points[contact:] if last else contour.points[contact::-1]
    if contour.ends[last] is not ContourEnd.TURNED_AWAY or len(arm) < 3:
        return None
    chords = np.array([arm[1] - arm[0], arm[-1] - arm[-2]])
    lengths = np.linalg.norm(chords, axis=1)
    if not lengths.min() > 0.0:
        return None
    first, ahead = chords / lengths[:, None]
    if np.arccos(np.clip(first @ ahead, -1.0, 1.0)) > plan.max_turn - np.pi / 4.0:
        return None
    outward = cross(contour.plane.normal, np.array([first, ahead]))
    outward *= 1.0 if outward[0] @ touch.approach > 0.0 else -1.0
    # An eighth of a step inside the surface before the bend, the probe meets the bend itself.
    return np.array([arm[-1] - plan.step / 8.0 * outward[1], ahead])
