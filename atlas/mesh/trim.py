"""Trim: the surface ends where samples no longer support it.

Among samples it is interpolated, beyond them extrapolated. The predicted deviation of an
extrapolation holds only if the surface is as smooth beyond the samples as among them. Past a rim
that no contour crossed nothing shows that it is.
"""

import numpy as np

from touchatlas.atlas.known_surface import whole_field
from touchatlas.atlas.mesh.resolution import facet_bound
from touchatlas.atlas.patches.sample_hull import along
from touchatlas.atlas.state import AtlasState

# Largest deviation inside of the touched surface over the one at its rim, no unit: patches all
# around leave no room for another surface. Doubled, less certain surface is drawn.
_INSIDE_FACTOR = 3.0
# Distance from the origin at which is asked whether the surface goes on, in distances of the
# outline: there the patch itself no longer knows it. With twice the excess, narrow gaps between
# patches pass for open rims.
_BEYOND = 1.35
# Points of an outline beyond which nothing is known at an open rim, of 24: a straight rim leaves 60
# degrees or more. Where the surface is bent a single point may lie off it. Doubled, corners of the
# touched surface are not cut.
_LEAST_BARE = 3


def supported(state: AtlasState, patch, points, deviation) -> np.ndarray:
    """(n,) whether the surface is to be drawn at points (n, 3) in the cells of patches (n,).

    At an open rim the surface ends at the convex hull, over the tangent plane, of the samples that
    its patch is fitted to, or where the predicted deviations (n,) exceed ``trust`` tolerances. A
    patch is inside when other patches cover its outline and those of its neighbours. There the
    deviation may be three times as large.
    """
    trusted = state.options.trust * state.tolerance
    out = deviation <= _INSIDE_FACTOR * trusted
    if not np.isfinite(trusted):
        return out
    at_rim = np.isin(np.arange(state.table.size), rim(state))[patch]
    out &= ~at_rim | (deviation <= trusted)
    doubt = np.flatnonzero(out & at_rim)
    for row in np.unique(patch[doubt]).tolist():
        here = doubt[patch[doubt] == row]
        samples = state.membership.pool.points[state.membership.fitted[row]]
        extent = along(state.table, row, samples).max(axis=0, initial=-np.inf)
        out[here] = (along(state.table, row, points[here]) <= extent).all(axis=1)
    doubt = doubt[~out[doubt]]
    out[doubt] = _on_faces(state, points[doubt])
    return out


def _on_faces(state: AtlasState, points) -> np.ndarray:
    """(n,) whether points (n, 3) lie on faces that are known there, beyond the samples of their
    patches."""
    out, gaps = np.zeros(len(points), bool), whole_field(state).gaps
    if gaps is not None and len(points):
        which, distance, *_ = gaps.at(points)
        out[which] = np.abs(distance) <= facet_bound(state)
    return out


def rim(state: AtlasState) -> list[int]:
    """Rows with an open outline, and their neighbours, ascending. In an atlas that is filled only
    those beyond whose outline no patch knows the surface."""
    if not state.fills:
        bare = state.table.rows[state.open_outlines().any(axis=1)]
        return sorted(state.neighbours.around(bare.tolist()))
    which, place = np.nonzero(state.open_outlines())
    rows = state.table.rows[which]
    origin = state.table.origin[rows]
    outlines = state.surface_graph.outlines.points(rows)[np.arange(len(rows)), place]
    beyond = origin + _BEYOND * (outlines - origin)
    bare = ~state.field.at(beyond).known & ~state.rims.beyond(beyond, state.table.axes[rows, 2])
    found, count = np.unique(rows[bare], return_counts=True)
    return sorted(state.neighbours.around(found[count >= _LEAST_BARE].tolist()))
