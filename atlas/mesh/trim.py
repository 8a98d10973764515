"""Where samples support the surface: among them it is interpolated, beyond them a guess.

How sure a polynomial is beyond its last samples, its deviation says, as far as the surface is as
smooth there as among them. Past a rim that no contour crossed it is not, and no sample tells.
"""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# In so many directions it is asked how far samples reach: what lies among these half planes is
# within the hull of the samples, but for 0.9 % of the radius.
_DIRECTIONS = 24
# Amid others a patch may be so many times as unsure as at a rim: no other surface can be there.
_WITHIN = 3.0
_ANGLES = 2.0 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS)
_ALONG = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def supported(atlas: "Atlas", patch, points, deviation) -> np.ndarray:
    """(n,) whether the surface is to be drawn at points (n, 3) of patches (n,), with deviations
    (n,): at a rim within the convex hull of the samples in the patch's equations, over its tangent
    plane, and as sure as is trusted; within, as far as three times that.

    Patches whose outlines others cover, and those of their kin too, lie within what was touched:
    there the surface goes on, how well it is known or not. Creases end patches where their samples
    end.
    """
    trusted = atlas.options.trust * atlas.tolerance
    out = deviation <= _WITHIN * trusted
    if not np.isfinite(trusted):
        return out
    at_rim = np.isin(np.arange(atlas.table.size), rim(atlas))[patch]
    out &= ~at_rim | (deviation <= trusted)
    doubt = np.flatnonzero(out & at_rim)
    for row in np.unique(patch[doubt]).tolist():
        here = doubt[patch[doubt] == row]
        reach = _over(atlas, row, _samples(atlas, row)).max(axis=0, initial=-np.inf)
        out[here] = (_over(atlas, row, points[here]) <= reach).all(axis=1)
    return out


def rim(atlas: "Atlas") -> list[int]:
    """Rows whose outlines, or those of kin of theirs, no patch covers everywhere."""
    table, rows = atlas.table, atlas.table.rows
    bare = rows[table.outline_open[rows].any(axis=1)].tolist()
    return sorted(set(bare).union(*(atlas.neighbours[i] for i in bare)))


def _samples(atlas: "Atlas", row: int) -> np.ndarray:
    """(n, 3) what a row learned from, and the creases of its sheet: the surface reaches them."""
    creases, members = atlas.creases, atlas.membership.fitted[row]
    lines = [creases.curve(row, j) for j in sorted(creases.of(row))]
    return np.concatenate([atlas.membership.pool.points[members], *lines])


def _over(atlas: "Atlas", row: int, points) -> np.ndarray:
    """(n, 24) how far points (n, 3) are along the directions of the tangent plane, length."""
    table = atlas.table
    reach: np.ndarray = (points - table.origin[row]) @ table.axes[row, :2].T @ _ALONG
    return reach
