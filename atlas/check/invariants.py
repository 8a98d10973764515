"""Invariants: what must hold of every atlas, checked from its parts."""

from collections.abc import Iterator

import numpy as np

from touchatlas.atlas.check.graph_invariants import graph_violations
from touchatlas.atlas.check.sample_invariants import ROUNDING, sample_violations
from touchatlas.atlas.graph.frontier import Frontier
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
from touchatlas.atlas.state import AtlasState

# Relative error of the ball index and of the sums of lengths, no unit: rounding over many updates.
# Doubled, a radius that is off by two millionths passes.
_UPDATED = 1e-6


def violations(state: AtlasState) -> list[str]:
    """A sentence for each invariant that does not hold; empty for a sound atlas."""
    found = [s for check in (_neighbours_are_mutual, _numbers) for s in check(state)]
    # Each group of checks needs the one before: it may raise where that does not hold.
    if not found:
        found = [*sample_violations(state), *graph_violations(state)]
    return found or [s for check in (_index, _kept) for s in check(state)]


def _neighbours_are_mutual(state: AtlasState) -> Iterator[str]:
    """The neighbour relation is symmetric, of patches in use, and its lines hold the same."""
    neighbours, alive = state.neighbours, set(state.table.rows.tolist())
    if len(neighbours) != state.table.size:
        yield "there are more, or fewer, sets of neighbours than patches"
        return
    for row in range(len(neighbours)):
        beside = neighbours[row]
        if not beside <= alive or (beside and row not in alive):
            yield f"patch {row} is a neighbour of a removed one, or is one"
        elif row in beside or any(row not in neighbours[i] for i in beside):
            yield f"the neighbours of patch {row} are not mutual"
    for row, line in enumerate(neighbours.lines().tolist()):
        if set(line) - {row} != neighbours[row]:
            yield f"the line of patch {row} does not hold its neighbours"


def _numbers(state: AtlasState) -> Iterator[str]:
    """The columns of the table are finite and within their ranges, and axes are orthonormal."""
    table, rows = state.table, state.table.rows
    for name in table.names:
        if not np.isfinite(getattr(table, name)[rows]).all():
            yield f"{name} is not finite"
    axes = table.axes[rows]
    if not np.allclose(axes @ axes.transpose(0, 2, 1), np.eye(3), atol=ROUNDING):
        yield "axes are not orthonormal"
    for name in ("radius", "weight", "noise"):
        if (getattr(table, name)[rows] <= 0).any():
            yield f"a {name} is not positive"
    if (table.measurement_std[rows] < 0).any() or (table.condition[rows] < 1.0).any():
        yield "a measurement's noise is negative, or a condition is less than one"
    if ((table.learned[rows] < 0) | (table.learned[rows] > table.count[rows])).any():
        yield "a patch was framed with more samples learned than it knows"
    gone = np.setdiff1d(np.arange(table.size), rows)
    if table.radius[gone].any() or (table.weight[gone] > 0).any():
        yield "a removed patch has a radius or a weight"


def _index(state: AtlasState) -> Iterator[str]:
    """The index holds the balls of the patches, and the running sums are those of their lengths."""
    table, rows = state.table, state.table.rows
    if not np.array_equal(table.index.rows(), rows):
        yield "the index holds other balls than the patches'"
        return
    for factor in (1.0 - _UPDATED, 1.0 + _UPDATED):
        rim = table.origin[rows] + factor * table.radius[rows, None] * table.axes[rows, 0]
        found, which = table.index.near(rim)
        inside = np.zeros(len(rows), bool)
        inside[which[found == rows[which]]] = True
        for row in rows[inside != (factor < 1.0)].tolist():
            yield f"the ball of patch {row} in the index is another"
    lengths = np.log(table.radius[rows] / table.length_ratio[rows])
    sums = np.array([len(rows), lengths.sum(), (lengths * lengths).sum()])
    if not np.allclose(table.lengths, sums, rtol=_UPDATED, atol=_UPDATED):
        yield "the sums of the lengths are not those of the patches"


def _kept(state: AtlasState) -> Iterator[str]:
    """Kept outlines, corners, boundaries and frontier equal the same computed again."""
    table, kept, rows = state.table, state.surface_graph, state.table.rows
    fresh = SurfaceGraph(table, kept.neighbours)
    fresh.mark_stale(rows.tolist())
    near = ROUNDING * np.sqrt(table.weight[rows].max(initial=0.0))
    if not np.allclose(kept.outlines.points(rows), fresh.outlines.points(rows), 0.0, near):
        yield "an outline is not where its patch has it"
    if not np.array_equal(kept.outlines.open(rows), fresh.outlines.open(rows)):
        yield "an outline is open where it is covered, or closed where nothing covers it"
    for name in ("corners", "gaps"):
        mine, others = getattr(kept, name), getattr(fresh, name)
        if mine.keys() != others.keys() or not all(
            np.allclose(mine[triple], others[triple], rtol=0.0, atol=near) for triple in mine
        ):
            yield f"the {name} are not those of the patches"
    if kept.cells.boundaries.keys() != fresh.cells.boundaries.keys():
        yield "the boundaries are not those of the cells"
    frontier = Frontier(table, state.neighbours, state.membership)
    frontier.mark_stale(rows.tolist())
    if not np.array_equal(frontier.samples, state.frontier.samples):
        yield "the frontier is not that of the samples"
