"""Simplify: merge pairs of patches until one polynomial fits no further pair."""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.edit.merge import enclosing_balls, merge, middles, noise_of
from touchatlas.atlas.edit.replace import LEAST_COSINE
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.smoothness import leftover

# Largest height that the degree may leave out at the rim of a merged patch, in standard deviations
# of the noise. It only saves fits: the samples decide. Doubled, more pairs are fitted in vain.
_LARGEST_LEFTOVER = 5.0
# Largest sine of the angle between normals at the origin and at the core radius, no unit.
_LARGEST_SINE = np.sqrt(1.0 - LEAST_COSINE**2)


def simplify(state: AtlasState) -> AtlasChange:
    """Merge pairs of neighbours until one polynomial fits no further pair."""
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
    return AtlasChange(added=tuple(sorted(added - removed)), merged=gone, removed=gone)


def mergeable(state: AtlasState, pairs: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Those pairs of patches whose merged patch would be flat enough, and smooth enough for its
    degree, by the curvatures and feature lengths of the two."""
    table, rows = state.table, np.array(list(pairs), int).reshape(-1, 2)
    if not len(rows):
        return []
    curvature = 2.0 * np.abs(table.mean[rows, 3:6]).max(axis=2) / table.radius[rows]
    curvature = curvature.min(axis=1)
    inverse_length = (table.length_ratio[rows] / table.radius[rows]).min(axis=1)
    noise = np.maximum(noise_of(state, rows), state.bias)

    def fits(core):
        radius = core / table.core
        left_out = leftover(table.basis, inverse_length * radius) * radius
        return (core * curvature <= _LARGEST_SINE) & (left_out <= _LARGEST_LEFTOVER * noise)

    (a, b), (c, d) = table.site[rows].transpose(1, 0, 2), np.sqrt(table.weight[rows]).T
    # No ball that holds both cores is smaller than this, wherever on the surface its centre is.
    least = enclosing_balls(a, c, b, d)[1]
    good = fits(least) & fits(middles(table, rows, table.axes[rows[:, 0], 2])[1])
    return [(i, j) for i, j in rows[good].tolist()]
