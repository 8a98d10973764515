"""Rim vertices: the triangles across a rim of the surface end there."""

import numpy as np

from touchatlas.atlas.known_surface import whole_field
from touchatlas.atlas.state import AtlasState


def ended_at_rims(state: AtlasState, faces, points, axes, drawn) -> tuple[np.ndarray, np.ndarray]:
    """The vertices with those beyond a rim moved onto it, where a triangle joins them with a vertex
    that is drawn; and which vertices are drawn then.

    Parameters
    ----------
    state : AtlasState
    faces : (f, 3) int
    points : (v, 3) float, length, world
    axes : (v, 3) float, unit, world
        Of the patches in whose cells the vertices lie.
    drawn : (v,) bool

    Returns
    -------
    points : (v, 3) float, length, world
    drawn : (v,) bool
    """
    if not state.rims:
        return points, drawn
    moved = np.setdiff1d(faces[drawn[faces].any(axis=1)], np.flatnonzero(drawn))
    moved = moved[state.rims.beyond(points[moved], axes[moved])]
    points, drawn = points.copy(), drawn.copy()
    onto = state.rims.onto(points[moved], axes[moved])
    # On the tangent plane they left the surface by the sagitta of the way.
    found = whole_field(state).at(onto)
    points[moved] = onto - np.nan_to_num(found.distance[:, None] * found.normal)
    drawn[moved] = found.known
    return points, drawn
