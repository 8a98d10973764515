"""Features: how large a hole or a horn no sample has met, and a touch where one may be."""

import numpy as np

from touchatlas.atlas.check.free_disc import FreeDisc, free_disc_of
from touchatlas.planner.attempts import Target
from touchatlas.planner.places import Places
from touchatlas.planner.probe_plan import Reason
from touchatlas.planner.view import View


def free_disc(view: View, places: Places, besides=()) -> FreeDisc | None:
    """The largest disc on the surface, where that is wanted, without a sample and without points
    ``besides`` (k, 3), length, world; None where nothing is drawn."""
    if places.surface is None:
        return None
    corners = places.surface.vertices[places.surface.faces]
    return free_disc_of(view.atlas, corners[view.is_wanted(corners.mean(axis=1))], besides)


def missed_feature(view: View, places: Places) -> Target | None:
    """The centre of the largest disc without a sample or an attempt, where a hole or a horn of the
    feature that the options ask for, or a larger one, may be. None where no feature is asked for,
    and where no disc is as large."""
    if not view.options.feature:
        return None
    disc = free_disc(view, places, np.concatenate([view.done, view.pending]))
    if disc is None or disc.diameter < view.options.feature:
        return None
    return Target(disc.centre, disc.normal, Reason.VERIFY)
