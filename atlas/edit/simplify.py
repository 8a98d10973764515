"""Simplifying: pairs that one patch may explain are merged until none is left."""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.edit.merge import enclosing_balls, merge, middles, noise_of
from touchatlas.atlas.edit.replace import LEAST_COSINE
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.smoothness import leftover

# What the degree leaves out at the rim of a merged patch, in deviations of the noise.
_NOTICEABLE = 5.0
# Sine of how far it may turn up to its core.
_MOST_RISE = np.sqrt(1.0 - LEAST_COSINE**2)


def simplify(state: AtlasState) -> AtlasChange:
    """Merge whatever one patch explains, pair by pair, until nothing more can be."""
    added: set[int] = set()
    removed: set[int] = set()
    todo = mergeable(state, state.surface_graph.cells.boundaries)
    while todo:
        first, second = todo.pop(0)
        if second in state.neighbours[first]:
            change = merge(state, first, second)
            added.update(change.added)
            removed.update(change.removed)
            beside = [(row, other) for row in change.added for other in state.neighbours[row]]
            todo += mergeable(state, beside)
    gone = tuple(sorted(removed))
    return AtlasChange(tuple(sorted(added - removed)), (), gone, (), gone)


def mergeable(state: AtlasState, pairs: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Those pairs of patches whose merged patch would leave out little enough for the noise, and
    turn little enough, as far as the two know their surface."""
    table, rows = state.table, np.array(list(pairs), int).reshape(-1, 2)
    if not len(rows):
        return []
    bend = (2.0 * np.abs(table.mean[rows, 3:6]).max(axis=2) / table.radius[rows]).min(axis=1)
    turn = (table.length_ratio[rows] / table.radius[rows]).min(axis=1)
    borne = np.maximum(noise_of(state, rows), state.bias)

    def bears(core):
        radius = core / table.core
        left = leftover(table.basis, turn * radius) * radius
        return (core * bend <= _MOST_RISE) & (left <= _NOTICEABLE * borne)

    (a, b), (c, d) = table.site[rows].transpose(1, 0, 2), np.sqrt(table.weight[rows]).T
    # No ball that holds both cores is smaller than this, wherever on the surface its centre is.
    least = enclosing_balls(a, c, b, d)[1]
    good = bears(least) & bears(middles(table, rows, table.axes[rows[:, 0], 2])[1])
    return [(i, j) for i, j in rows[good].tolist()]
