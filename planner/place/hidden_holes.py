"""Hidden holes: places where another hole like the smallest of a body may be between samples."""

import numpy as np

from touchatlas.atlas.body.round_holes import smallest_hole
from touchatlas.planner.place.choose import Target, View, distance_to
from touchatlas.planner.place.places import Places
from touchatlas.planner.probe_plan import Reason

# Radius of the smallest hole that is looked for, in extents: the length of contours goes with one
# over it. Doubled, holes of a tenth of the extent stay hidden.
_LEAST = 0.025


def hidden_hole_target(view: View, places: Places, borne: float = 0.0) -> Target | None:
    """The place farthest from all samples and attempts where another hole like the smallest of the
    body may be; None where samples leave no room for one, or its radius is at most what is
    ``borne``, length.

    A law is believed between samples, but a part that has a hole may have others like it.
    """
    body = view.atlas.body
    if body is None or body.field.is_one:
        return None
    radius = smallest_hole(body)
    if not borne < radius < np.inf:
        return None
    away = np.minimum(body.away(places.points), distance_to(view.done, places.points))
    away = np.where(view.is_free(places.points), away, 0.0)
    if not away.max(initial=0.0) > max(radius, _LEAST * view.extent):
        return None
    best = int(away.argmax())
    return Target(places.points[best], places.normals[best], Reason.VERIFY)
