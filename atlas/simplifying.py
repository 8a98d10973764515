"""Simplifying: pairs that one patch may explain are merged until none is left."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.change import AtlasChange
from touchatlas.atlas.merging import LEAST_COSINE, enclosing_ball, middle, noise_of
from touchatlas.patch.smoothness import leftover

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# What the degree leaves out at the rim of a merged patch, in deviations of the noise.
_NOTICEABLE = 5.0
# Sine of how far it may turn up to its core.
_MOST_RISE = np.sqrt(1.0 - LEAST_COSINE**2)


def simplify(atlas: "Atlas") -> AtlasChange:
    """Merge whatever one patch explains, pair by pair, until nothing more can be."""
    added: set[int] = set()
    removed: set[int] = set()
    todo = [tuple(edge) for edge in atlas.tiling.graph.edges]
    while todo:
        first, second = todo.pop(0)
        if second in atlas.kin[first] and may_merge(atlas, first, second):
            change = atlas.merge(first, second)
            added.update(change.added)
            removed.update(change.removed)
            todo += [(row, other) for row in change.added for other in atlas.kin[row]]
    atlas.tiling.mend()
    gone = tuple(sorted(removed))
    return AtlasChange(tuple(sorted(added - removed)), (), gone, (), gone)


def may_merge(atlas: "Atlas", first: int, second: int) -> bool:
    """Whether a merged patch would leave out little enough for the noise, and turn little enough,
    as far as the two know their surface."""
    table, rows = atlas.table, np.array([first, second])
    bend = (2.0 * np.abs(table.mean[rows, 3:6]).max(axis=1) / table.radius[rows]).min()
    turn = (table.turn[rows] / table.radius[rows]).min()
    borne = max(noise_of(atlas, rows), atlas.bias)

    def bears(core: float) -> bool:
        radius = core / table.core
        left = leftover(table.basis, turn * radius) * radius
        return bool(core * bend <= _MOST_RISE and left <= _NOTICEABLE * borne)

    (a, b), (c, d) = table.site[rows], np.sqrt(table.power[rows])
    # No ball that holds both cores is smaller than this, wherever on the surface its centre is.
    least = enclosing_ball(a, c, b, d)[1]
    return bears(least) and bears(middle(table, first, second, table.axes[first, 2])[1])
