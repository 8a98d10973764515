"""Simplifying: pairs that one patch may explain are merged until none is left."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.change import AtlasChange
from touchatlas.atlas.merging import LEAST_COSINE, middle, noise_of
from touchatlas.patch.smoothness import leftover

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# What the degree leaves out at the rim of a merged patch, in deviations of the noise.
_NOTICEABLE = 5.0


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
    _, core = middle(table, first, second, table.axes[first, 2])
    bend = 2.0 * np.abs(table.mean[rows, 3:6]).max(axis=1) / table.radius[rows]
    if core * bend.min() > np.sqrt(1.0 - LEAST_COSINE**2):
        return False
    radius = core / table.core
    turn = float((table.turn[rows] / table.radius[rows]).min()) * radius
    borne = max(noise_of(atlas, rows), atlas.bias)
    return leftover(table.basis, turn) * radius <= _NOTICEABLE * borne
