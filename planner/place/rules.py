"""Rules: which place is touched next, by name. All but ``tolerance`` are baselines.

Another rule is one more function here, from a View, Places and a generator to a Target or None.
"""

from collections.abc import Callable

import numpy as np

from touchatlas.atlas.body.guessed_edges import guessed_edges
from touchatlas.atlas.contouring.body_surface import fine_edge
from touchatlas.planner.place.choose import APART, APART_HOLES, Target, View, distance_to
from touchatlas.planner.place.hidden_holes import hidden_hole_target
from touchatlas.planner.place.largest_sum import largest_sum_about
from touchatlas.planner.place.places import Places, places_of, planning_edge
from touchatlas.planner.probe_plan import Reason

Rule = Callable[[View, Places, np.random.Generator | None], Target | None]

# Cost of a touch besides the way to it, in extents. With the way, 15 explorations of five bodies
# tracked and travelled 5 % less. Doubled, touches jump farther.
_SET_UP = 0.3
# Distance about a touch within which it takes most of the variance, in extents. Doubled, touches go
# amid what is vague rather than where it is vaguest.
_ABOUT = 0.1
# Deviation of a place that needs no touch, in deviations of a sample: a dozen samples give it.
# Doubled, explorations to tolerances near the noise end too early.
SUREST = 0.3


def tolerance(view: View, places: Places, _: np.random.Generator | None) -> Target | None:
    """Where the surface ends, far from all touches; else where another hole of the body may be
    hidden; else where a touch can take most of the variance; else at a small hole of the surface.
    """
    target = rim_target(view, places, places.are_large(view.extent))
    target = hidden_hole_target(view, places) if target is None else target
    target = weak_target(view, places) if target is None else target
    return rim_target(view, places, places.rim_size > 0.0) if target is None else target


def left_target(view: View, places: Places) -> Target | None:
    """What is left to touch of a surface that is known to the tolerance elsewhere: a large opening,
    where a hole larger than the tolerance may be hidden, a rim that is not sure, an edge that is
    drawn by a guess, or a hole of the fine drawing."""
    target = rim_target(view, places, places.are_large(view.extent))
    if target is None:
        target = hidden_hole_target(view, places, view.atlas.tolerance)
    target = unsure_rim_target(view) if target is None else target
    target = guessed_edge_target(view) if target is None else target
    return hole_target(view, places) if target is None else target


def random(view: View, places: Places, rng: np.random.Generator | None) -> Target | None:
    """A place at random, each with its share of the area."""
    if rng is None:
        raise ValueError("the rule random needs rng, a numpy.random.Generator; pass one")
    points, _ = _all_places(places)
    share = np.concatenate([places.rim_area, places.area]) * view.is_free(points)
    if not share.sum() > 0.0:
        return None
    return _target(places, int(rng.choice(len(share), p=share / share.sum())))


def farthest(view: View, places: Places, _: np.random.Generator | None) -> Target | None:
    """The place farthest from all touches, whether anything is known there or not."""
    points, _normals = _all_places(places)
    away = np.where(view.is_free(points), distance_to(view.touched, points), 0.0)
    return _target(places, int(away.argmax())) if away.max(initial=0.0) > 0.0 else None


def variance(view: View, places: Places, _: np.random.Generator | None) -> Target | None:
    """The place of largest predicted variance: first where nothing is known, next to the last
    touch."""
    free = np.flatnonzero(view.is_free(places.rim))
    if len(free):
        offset = places.rim[free] - view.touched[-1]
        return _target(places, int(free[(offset * offset).sum(axis=1).argmin()]))
    weak = np.where(view.is_free(places.points), places.deviation, 0.0)
    if not weak.max(initial=0.0) > 0.0:
        return None
    return _target(places, len(places.rim) + int(weak.argmax()))


def rim_target(view: View, places: Places, asked) -> Target | None:
    """The place at some of the rims, ``asked`` (k,) bool, that teaches most for its cost: the
    square of its distance to all touches, and attempts in vain, over the way from the last touch.
    None where all of that is near touches or attempts."""
    free = np.flatnonzero(asked & view.is_free(places.rim))
    if not len(free):
        # What is left of the rims are small holes, which may lie beside a touch.
        free = np.flatnonzero(asked & (view.apart(places.rim) > APART_HOLES * view.extent))
    if not len(free):
        return None
    reached, points = np.concatenate([view.touched, view.in_vain]), places.rim[free]
    away, offset = distance_to(reached, points), points - view.touched[-1]
    travel = np.sqrt((offset * offset).sum(axis=1))
    return _target(places, int(free[(away**2 / (_SET_UP * view.extent + travel)).argmax()]))


def hole_target(view: View, places: Places) -> Target | None:
    """The place at a hole of the surface as it is drawn at the end, finely, which would be off by
    more than the tolerance where it is closed; None where none is left."""
    atlas = view.atlas
    if atlas.body is None:
        return None
    edge = fine_edge(atlas.body, atlas.options.facets * atlas.tolerance)
    if edge < planning_edge(atlas):
        places = places_of(atlas, edge)
    return rim_target(view, places, places.stay_open(atlas.tolerance, view.extent))


def unsure_rim_target(view: View) -> Target | None:
    """The place half-way between two ends of contours at a rim where the rim is least sure; None
    where none is left that is less sure than the tolerance, and than touches are apart."""
    limit = max(view.atlas.tolerance, APART * view.extent)
    points, normals, apart = view.atlas.rims.unsure(limit)
    apart = np.where(view.is_free(points), apart, 0.0)
    if not apart.max(initial=0.0) > 0.0:
        return None
    best = int(apart.argmax())
    return Target(points[best], normals[best], Reason.REFINE)


def guessed_edge_target(view: View) -> Target | None:
    """The middle of an edge that is drawn sharp by a guess, the one nearest to the last touch; None
    where none is away from touches and attempts."""
    body = view.atlas.body
    if body is None:
        return None
    edges = guessed_edges(body, view.atlas.tolerance)
    free = np.flatnonzero(view.is_free(edges.points))
    if not len(free):
        return None
    offset = edges.points[free] - view.touched[-1]
    nearest = int(free[(offset * offset).sum(axis=1).argmin()])
    return Target(edges.points[nearest], edges.normals[nearest], Reason.REFINE)


def weak_target(view: View, places: Places) -> Target | None:
    """The place about which a touch can take most of the variance: of its integral over the surface
    about it. None where all places are near touches or attempts, or much surer than a single
    sample."""
    least = SUREST * view.atlas.sample_std
    gain = places.area * np.maximum(places.deviation**2 - least**2, 0.0)
    asked = np.flatnonzero((gain > 0.0) & view.is_free(places.points))
    if not len(asked):
        return None
    best = largest_sum_about(places.points, gain, asked, _ABOUT * view.extent)
    return _target(places, len(places.rim) + best)


def _all_places(places: Places) -> tuple[np.ndarray, np.ndarray]:
    """Rims and places: points and normals (n, 3)."""
    return (
        np.concatenate([places.rim, places.points]),
        np.concatenate([places.rim_normals, places.normals]),
    )


def _target(places: Places, number: int) -> Target:
    """The target at one of all places."""
    points, normals = _all_places(places)
    reason = Reason.EXPAND if number < len(places.rim) else Reason.REFINE
    return Target(points[number], normals[number], reason)


RULES: dict[str, Rule] = {rule.__name__: rule for rule in (tolerance, random, farthest, variance)}
