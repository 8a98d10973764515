"""Sources: where to touch next comes from the first source in ``SOURCES`` that has a target.

A source is a pure function from a View and Places to a Target or None. Another idea of where to
touch is one more function, and one more line of the list.
"""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.round_holes import smallest_hole
from touchatlas.atlas.body.uncrossed_edges import guessed_edges
from touchatlas.atlas.mesh.surface import fine_edge
from touchatlas.patch.entry_points import PLANNERS, load_added
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner.attempts import Target
from touchatlas.planner.behind_edges import behind_edge, bend_near
from touchatlas.planner.features import missed_feature
from touchatlas.planner.places import Places, places_of, planning_cube
from touchatlas.planner.probe_plan import Reason
from touchatlas.planner.search import GOLDEN, other_part
from touchatlas.planner.view import Phase, View, distance_to

Source = Callable[[View, Places], Target | None]


def next_target(view: View, places: Places) -> Target | None:
    """Where to touch next: the target of the first source that has one in the view's phase."""
    for source, phases in SOURCES:
        target = source(view, places) if view.phase in phases else None
        if target is not None:
            return target
    return None


def closer(view: View, _: Places) -> Target | None:
    """The place of a touch whose contours were too short for a patch, with shorter arms."""
    return next(iter(view.attempts.closer), None)


def from_known(view: View, _: Places) -> Target | None:
    """The known sample nearest to a place that the probe missed, with a plane through that place:
    the contour shows how the surface bends away or ends. None where no sample faces as it does."""
    pool = view.atlas.pool
    for missed in view.attempts.missed:
        facing = np.flatnonzero(pool.normals @ missed.normal > 0.0)
        if not len(facing):
            continue
        offset = missed.point - pool.points[facing]
        nearest = int((offset * offset).sum(axis=1).argmin())
        point, normal = pool.points[facing[nearest]], pool.normals[facing[nearest]]
        away = offset[nearest] - (offset[nearest] @ normal) * normal
        if away @ away > 0.0:
            # The first approach may have begun behind an opposite wall.
            near = 2.0 * view.options.step * view.extent
            return Target(point, normal, missed.reason, away, near, sought=missed.point)
    return None


def first(view: View, _: Places) -> Target | None:
    """The start; where nothing is met there, deeper below it, then as deep at 22 places on a spiral
    about it, across the approach; the golden angle between two leaves no direction out. None while
    one is not answered."""
    attempts = view.attempts
    k, count = attempts.starts, 24
    if k and not any((place == attempts.start).all() for place in attempts.in_vain):
        # What was met there, and taught nothing, would be met again from deeper below.
        k += 1
    if attempts.pending or k >= count:
        return None
    if k == 0:
        return Target(attempts.start, attempts.outward, Reason.START)
    e1 = any_tangent(attempts.outward)
    e2 = np.cross(attempts.outward, e1)
    # Nothing is known of the size. With a scale of five deviations of the noise, 500 scales are
    # half the extent of a body to which the probe is good to 1/5000. A usual first approach begins
    # 100 above, as this one does, and ends 100 below the start.
    deep, height = 500.0 * view.atlas.scale, 600.0 * view.atlas.scale
    radius, angle = deep * np.sqrt((k - 1) / count), GOLDEN * (k - 1)
    offset = radius * (np.cos(angle) * e1 + np.sin(angle) * e2) - deep * attempts.outward
    return Target(attempts.start + offset, attempts.outward, Reason.START, approach=height)


def datum(view: View, _: Places) -> Target | None:
    """The first place again, each time that so many touches more were made as the options say."""
    every, attempts = view.options.datum, view.attempts
    if not every or len(attempts.touched) < (attempts.datums + 1) * every:
        return None
    pool, point = view.atlas.pool, attempts.touched[0]
    return Target(point, pool.normals[pool.nearest(point)], Reason.DATUM)


def large_opening(view: View, places: Places) -> Target | None:
    """The rim of an opening that is too large to be closed across, far from all touches; the bend
    there, from outside, where arms ended before a sharp one."""
    target = _rim(view, places, places.are_large(view.extent))
    return None if target is None else bend_near(target, view)


def hidden_hole(view: View, places: Places) -> Target | None:
    """The place farthest from all samples and attempts where another hole like the smallest of the
    body may be. None where samples leave no room for one, and on a free-form body.

    A law is believed between samples, but a part that has a hole may have others like it. At the
    end, holes whose radius is within the tolerance do not matter.
    """
    body = view.atlas.body
    if body is None or body.is_one_face:
        return None
    radius = smallest_hole(body)
    least = view.atlas.tolerance if view.phase is Phase.FINISH else 0.0
    if not least < radius < np.inf:
        return None
    points = places.points
    away = np.minimum(body.away(points), distance_to(view.done, points))
    away = np.where(view.is_free(points), away, 0.0)
    if not away.max(initial=0.0) > max(radius, view.options.levels.hidden_hole * view.extent):
        return None
    best = int(away.argmax())
    return Target(points[best], places.normals[best], Reason.VERIFY)


def vague_surface(view: View, places: Places) -> Target | None:
    """The place of largest expected gain: of the area about it that a touch is expected to bring
    within the next tolerance, over its cost. None where all places are near touches or attempts, or
    as surely within it as samples can make them."""
    levels, law = view.options.levels, view.atlas.law
    tolerance = next_tolerance(view, places)
    least = np.array([levels.surest * view.atlas.sample_std])
    sure = law.chance(tolerance, least, 0.0)
    more = sure - law.chance(tolerance, places.deviation, places.away)
    gain = places.area * np.maximum(more, 0.0)
    free = np.flatnonzero((gain > 0.0) & view.is_free(places.points))
    if not len(free):
        return None
    cost = view.cost(places.points)
    best = largest_sum_about(places.points, gain, free, levels.about * view.extent, cost)
    return Target(places.points[best], places.normals[best], Reason.REFINE)


def next_tolerance(view: View, places: Places) -> float:
    """The largest power of two, in scales, within which less of the places is expected than what is
    wanted of the surface, length. The tolerance at which an exploration ends does not change what
    is touched on the way to it."""
    law, scale = view.atlas.law, view.atlas.scale
    wanted = view.options.coverage * places.area.sum()
    power = np.floor(np.log2(view.extent / scale))
    while True:
        tolerance = float(scale * 2.0**power)
        inside = places.area @ law.chance(tolerance, places.deviation, places.away)
        # Where there is no area, none is within any tolerance.
        if not inside >= wanted > 0.0:
            return tolerance
        power -= 1.0


def small_hole(view: View, places: Places) -> Target | None:
    """The rim of any opening, large or small."""
    return _rim(view, places, np.ones(len(places.rim), bool))


def baseline(view: View, places: Places) -> Target | None:
    """The place that the baseline of the options' name chooses, ours or another package's."""
    name = view.options.name
    return (BASELINES.get(name) or load_added(PLANNERS, name))(view, places)


def unsure_rim(view: View, _: Places) -> Target | None:
    """The place half-way between two ends of contours at a rim where the rim is least sure; None
    where none is left that is less sure than the tolerance, and than touches are apart."""
    limit = max(view.atlas.tolerance, view.options.levels.apart * view.extent)
    points, normals, apart = view.atlas.rims.unsure(limit)
    apart = np.where(view.is_free(points), apart, 0.0)
    if not apart.max(initial=0.0) > 0.0:
        return None
    best = int(apart.argmax())
    return Target(points[best], normals[best], Reason.REFINE)


def guessed_edge(view: View, _: Places) -> Target | None:
    """The middle of an edge that is drawn sharp by a guess, the one nearest to the last touch."""
    if view.atlas.body is None:
        return None
    edges = guessed_edges(view.atlas.body, view.atlas.tolerance)
    free = np.flatnonzero(view.is_free(edges.points))
    if not len(free):
        return None
    nearest = free[view.nearest(edges.points[free])]
    return Target(edges.points[nearest], edges.normals[nearest], Reason.REFINE)


def hole_in_fine_surface(view: View, places: Places) -> Target | None:
    """The rim of a hole of the surface as it is drawn at the end, finely, which would be off by
    more than the tolerance where it is closed."""
    atlas = view.atlas
    if atlas.body is None:
        return None
    cube = fine_edge(atlas.body, atlas.options.facets * atlas.tolerance)
    if cube < planning_cube(atlas):
        places = view.limited(places_of(atlas, cube))
    return _rim(view, places, places.stay_open(atlas.tolerance, view.extent))


def random(view: View, places: Places) -> Target | None:
    """Baseline: a place at random, each with its share of the area."""
    points, _ = places.all
    share = np.cumsum(np.append(places.rim_area.sum(axis=1), places.area) * view.is_free(points))
    if not len(share) or not share[-1] > 0.0:
        return None
    return target_at(places, int(np.searchsorted(share, view.draw * share[-1], side="right")))


def farthest(view: View, places: Places) -> Target | None:
    """Baseline: the place farthest from all touches, whether anything is known there or not."""
    points, _ = places.all
    away = np.where(view.is_free(points), distance_to(view.touched, points), 0.0)
    return target_at(places, int(away.argmax())) if away.max(initial=0.0) > 0.0 else None


def variance(view: View, places: Places) -> Target | None:
    """Baseline: the place of largest predicted variance; first where nothing is known, next to the
    last touch."""
    free = np.flatnonzero(view.is_free(places.rim))
    if len(free):
        return target_at(places, int(free[view.nearest(places.rim[free])]))
    vague = np.where(view.is_free(places.points), places.deviation, 0.0)
    if not vague.max(initial=0.0) > 0.0:
        return None
    return target_at(places, len(places.rim) + int(vague.argmax()))


def largest_sum_about(points, values, asked, radius: float, cost) -> int:
    """Of the places ``asked`` (k,) int about which the sum of values (n,) at points (n, 3) within a
    radius, length, over the ``cost`` (n,), is largest. The largest value in each cube of that edge
    is compared.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [4, 0, 0], [5, 0, 0]])
    >>> largest_sum_about(points, np.array([1.5, 1, 1]), np.arange(3), 2.0, np.ones(3))
    1
    """
    # No wall of the cubes passes places on a lattice.
    offset = np.array([0.31, 0.43, 0.37])
    cube = np.floor((points[asked] - points.min(axis=0)) / radius + offset).astype(np.int64)
    order = np.lexsort((-values[asked], *cube.T))
    new = np.append(True, (np.diff(cube[order], axis=0) != 0).any(axis=1))
    compared = np.sort(asked[order[new]])
    near = cKDTree(points).query_ball_point(points[compared], radius)
    return int(compared[np.argmax([values[some].sum() for some in near] / cost[compared])])


def _rim(view: View, places: Places, some) -> Target | None:
    """The place at ``some`` (k,) bool of the rims that teaches most for its cost: the square of its
    distance to all touches, and attempts in vain, over the way from the last touch. None where all
    of them are near touches or attempts."""
    levels, extent = view.options.levels, view.extent
    free = np.flatnonzero(some & view.is_free(places.rim))
    if not len(free):
        # What is left of the rims are small holes, which may lie next to a touch.
        free = np.flatnonzero(some & (view.apart(places.rim) > 0.25 * levels.apart * extent))
    if not len(free):
        return None
    points, in_vain = places.rim[free], np.reshape(view.attempts.in_vain, (-1, 3))
    away = distance_to(np.concatenate([view.touched, in_vain]), points)
    return target_at(places, int(free[(away**2 / view.cost(points)).argmax()]))


def target_at(places: Places, number: int) -> Target:
    """The target at one of all places, rims first."""
    points, normals = places.all
    reason = Reason.EXPAND if number < len(places.rim) else Reason.REFINE
    return Target(points[number], normals[number], reason)


BASELINES: dict[str, Source] = {rule.__name__: rule for rule in (random, farthest, variance)}

_KNOWN_BODY = (Phase.GROW, Phase.COMPARE, Phase.FINISH, Phase.END)
# The order in which sources have their say, and the phases in which each has one.
SOURCES: tuple[tuple[Source, tuple[Phase, ...]], ...] = (
    (closer, tuple(Phase)),
    (from_known, tuple(Phase)),
    (first, (Phase.FIRST,)),
    (datum, (Phase.GROW, Phase.COMPARE, Phase.FINISH)),
    (behind_edge, _KNOWN_BODY),
    (large_opening, (Phase.GROW, Phase.FINISH)),
    (hidden_hole, (Phase.GROW, Phase.FINISH)),
    (vague_surface, (Phase.GROW,)),
    (small_hole, (Phase.GROW,)),
    (baseline, (Phase.COMPARE,)),
    (unsure_rim, (Phase.FINISH,)),
    (guessed_edge, (Phase.FINISH,)),
    (hole_in_fine_surface, (Phase.FINISH,)),
    (missed_feature, (Phase.FINISH, Phase.END)),
    (other_part, _KNOWN_BODY),
)
