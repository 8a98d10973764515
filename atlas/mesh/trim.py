"""Where samples support the surface: among them it is interpolated, beyond them a guess.

How sure a polynomial is beyond its last samples, its deviation says, as far as the surface is as
smooth there as among them. Past a rim that no contour crossed it is not, and no sample tells.
"""

import numpy as np

from touchatlas.atlas.state import AtlasState

# In so many directions it is asked how far samples reach: what lies among these half planes is
# within the hull of the samples, but for 0.9 % of the radius.
_DIRECTIONS = 24
# Amid others a patch may be so many times as unsure as at a rim: no other surface can be there.
_WITHIN = 3.0
_ANGLES = 2.0 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS)
_ALONG = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def supported(state: AtlasState, patch, points, deviation) -> np.ndarray:
    """(n,) whether the surface is to be drawn at points (n, 3) of patches (n,).

    At a rim of what was touched it ends at the convex hull of the samples that its patch is fitted
    to, over the tangent plane, or where the deviations (n,) exceed what is trusted. A patch lies
    within what was touched when others cover its outline and those of its neighbours: there the
    surface goes on up to three times the deviation. Creases end patches where their samples end.
    """
    trusted = state.options.trust * state.tolerance
    out = deviation <= _WITHIN * trusted
    if not np.isfinite(trusted):
        return out
    at_rim = np.isin(np.arange(state.table.size), rim(state))[patch]
    out &= ~at_rim | (deviation <= trusted)
    doubt = np.flatnonzero(out & at_rim)
    for row in np.unique(patch[doubt]).tolist():
        here = doubt[patch[doubt] == row]
        reach = _over(state, row, _samples(state, row)).max(axis=0, initial=-np.inf)
        out[here] = (_over(state, row, points[here]) <= reach).all(axis=1)
    return out


def rim(state: AtlasState) -> list[int]:
    """Rows whose outlines, or those of neighbours of theirs, no patch covers everywhere."""
    bare = state.table.rows[state.open_outlines().any(axis=1)].tolist()
    return sorted(state.neighbours.around(bare))


def _samples(state: AtlasState, row: int) -> np.ndarray:
    """(n, 3) what a row learned from, and the creases of its sheet: the surface reaches them."""
    curve, fitted = state.surface_graph.curves.curve, state.membership.fitted[row]
    lines = [curve(row, j) for j in sorted(state.creases.of(row))]
    return np.concatenate([state.membership.pool.points[fitted], *lines])


def _over(state: AtlasState, row: int, points) -> np.ndarray:
    """(n, 24) how far points (n, 3) are along the directions of the tangent plane, length."""
    table = state.table
    reach: np.ndarray = (points - table.origin[row]) @ table.axes[row, :2].T @ _ALONG
    return reach
