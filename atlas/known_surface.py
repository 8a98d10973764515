"""What an atlas knows of the surface at points: distance, normal, deviation, and by what patch."""

import numpy as np

from touchatlas.atlas.faces.gaps import Gaps
from touchatlas.atlas.field.blend import Blend, Field
from touchatlas.atlas.field.predicted_deviation import predicted_deviation
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import frozen_array


def blend(state: AtlasState, points) -> Blend:
    """See ``Atlas.blend``."""
    points = frozen_array(points, (None, 3), "points")
    if state.body is None:
        return _within_rims(state, points, whole_field(state).at(points))
    found, known = state.body.at(points)
    curvature = state.body.gaussian_curvature(points, found.face)
    columns = found.distance, known, found.normal, found.deviation, curvature, found.face
    return Blend(*columns).without(np.flatnonzero(~known))


def blend_of_patches(state: AtlasState, points, curved: bool = True) -> Blend:
    """The same of overlapping patches, whatever faces there are; curvatures are NaN without
    ``curved``."""
    return _within_rims(state, points, state.field.at(points, curved=curved))


def deviations(state: AtlasState, found: Blend) -> np.ndarray:
    """(n,) predicted deviation of the surface at the points of a ``blend``, length, with what
    samples leave unexplained; NaN where it is unknown."""
    return predicted_deviation(state.table, found) if state.body is None else found.deviation


def whole_field(state: AtlasState) -> Field:
    """The field of the patches, and where none of them knows the surface that of the faces."""
    beside = state.known_law.beside
    if beside is None or not (len(state) and state.fills):
        return state.field
    return Field(state.table, state.surface_graph, Gaps(beside, state.table, state.membership))


def _within_rims(state: AtlasState, points, found: Blend) -> Blend:
    """What was found at points (n, 3), unknown beyond the rims of the surface."""
    if not state.rims:
        return found
    some = np.flatnonzero(found.known)
    return found.without(some[state.rims.beyond(points[some], found.normal[some])])
