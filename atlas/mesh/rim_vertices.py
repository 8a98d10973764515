"""Rim vertices: the triangles across a rim of the surface end there."""

import numpy as np

from touchatlas.atlas.state import AtlasState


def ended_at_rims(state: AtlasState, faces, points, axes, known) -> tuple[np.ndarray, np.ndarray]:
    """The vertices with those beyond a rim moved onto it, as far as a triangle joins them with a
    known one on the near side; and which vertices are known then.

    Parameters
    ----------
    state : AtlasState
    faces : (f, 3) int
    points : (v, 3) float, length, world
    axes : (v, 3) float, unit, world
        Of the patches in whose cells the vertices lie.
    known : (v,) bool
        Whether the surface is known at the vertices.

    Returns
    -------
    points : (v, 3) float, length, world
    known : (v,) bool
    """
    beyond = known & state.rims.beyond(points, axes)
    if not beyond.any():
        return points, known
    across = np.unique(faces[(known & ~beyond)[faces].any(axis=1)])
    moved = across[beyond[across]]
    points, known = points.copy(), known & ~beyond
    onto = state.rims.onto(points[moved], axes[moved])
    # On the tangent plane they left the surface by the sagitta of the way.
    found = state.field.at(onto)
    points[moved] = onto - np.where(found.known, found.distance, 0.0)[:, None] * np.where(
        found.known[:, None], found.normal, 0.0
    )
    known[moved] = found.known
    return points, known
