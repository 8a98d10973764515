"""What an atlas knows of the surface at points: distance, normal, deviation, and by what face."""

import numpy as np

from touchatlas.atlas.records.blend import Blend
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import frozen_array


def blend(state: AtlasState, points) -> Blend:
    """See ``Atlas.blend``."""
    points, state = frozen_array(points, (None, 3), "points"), state.without_tip
    if state.body is None:
        return _unknown(len(points))
    found, known = state.body.at(points)
    deviation = state.law.deviations(found.deviation)
    curvature = state.body.gaussian_curvature(points, found.face)
    known[known] = ~state.body.beyond(points[known], found.normal[known])
    columns = found.distance, known, found.normal, deviation, curvature, found.face
    return Blend(*columns).without(np.flatnonzero(~known))


def _unknown(count: int) -> Blend:
    """Of points where nothing is known."""
    none = np.full(count, np.nan)
    nowhere = np.full(count, -1)
    return Blend(none, np.zeros(count, bool), np.full((count, 3), np.nan), none, none, nowhere)
