"""Rules: which place is touched next, by name. All but ``tolerance`` are baselines.

Another rule is one more function here, from a View and a generator to a Target or None.
"""

from collections.abc import Callable

import numpy as np

from touchatlas.planner.place.choose import (
    Target,
    View,
    at_open,
    distance_to,
    known_places,
    open_places,
    open_target,
    weak_target,
)
from touchatlas.planner.place.gpis import gpis
from touchatlas.planner.place.places import Known
from touchatlas.planner.place.raster import raster
from touchatlas.planner.probe_plan import Reason

Rule = Callable[[View, np.random.Generator | None], Target | None]


def tolerance(view: View, _: np.random.Generator | None) -> Target | None:
    """Where nothing is known, far from all touches; else where a touch can take most of
    the variance."""
    target = open_target(view)
    return weak_target(view) if target is None else target


def random(view: View, rng: np.random.Generator | None) -> Target | None:
    """A place at random, each with its share of the area."""
    if rng is None:
        raise ValueError("the rule random needs rng, a numpy.random.Generator; pass one")
    (points, homes), known = open_places(view), known_places(view)
    share = np.concatenate([view.places.open_area(view.atlas, homes), known.area])
    if not share.sum() > 0.0:
        return None
    chosen = int(rng.choice(len(share), p=share / share.sum()))
    if chosen < len(points):
        return at_open(view, points[chosen], homes[chosen])
    return _at_known(known, chosen - len(points))


def farthest(view: View, _: np.random.Generator | None) -> Target | None:
    """The place farthest from all touches, whether anything is known there or not."""
    (points, homes), known = open_places(view), known_places(view)
    away = distance_to(view.touched, np.concatenate([points, known.points]))
    if not len(away):
        return None
    chosen = int(away.argmax())
    if chosen < len(points):
        return at_open(view, points[chosen], homes[chosen])
    return _at_known(known, chosen - len(points))


def variance(view: View, _: np.random.Generator | None) -> Target | None:
    """The place of largest predicted variance: first where nothing is known, next to the last
    touch."""
    points, homes = open_places(view)
    if len(points):
        chosen = int(((points - view.touched[-1]) ** 2).sum(axis=1).argmin())
        return at_open(view, points[chosen], homes[chosen])
    known = known_places(view)
    return _at_known(known, int(known.deviation.argmax())) if len(known.points) else None


def _at_known(known: Known, number: int) -> Target:
    """The target at one of n known places."""
    return Target(known.points[number], known.normals[number], Reason.REFINE)


RULES: dict[str, Rule] = {
    rule.__name__: rule for rule in (tolerance, random, farthest, variance, gpis, raster)
}
