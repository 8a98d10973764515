"""Graph invariants: boundaries and corners lie where patches meet."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import SHEET_GAP
from touchatlas.atlas.state import AtlasState

# Largest error of corners, of power over the weight. Newton's method stops below it. Doubled, wrong
# corners pass only if they are as near.
_CORNER_ERROR = 1e-3
# Largest distance of patches at a corner in the largest deviation that they predict there, because
# one of them may have few samples. Doubled, a patch of another sheet would pass.
_DEVIATIONS = 5.0


def graph_violations(state: AtlasState) -> list[str]:
    """A sentence for each invariant that does not hold."""
    checks = (_corners_of_cells, _graph, _corners_end, _closure)
    return [sentence for check in checks for sentence in check(state)]


def _corners_of_cells(state: AtlasState) -> Iterator[str]:
    """Corners and gaps of cells are of equal power, and on their patches."""
    table, cells = state.table, state.surface_graph.cells
    for triple, point in (*cells.corners.items(), *cells.gaps.items()):
        rows = list(triple)
        if not all(j in state.neighbours[i] for i, j in combinations(triple, 2)):
            yield f"corner or gap {triple} is not of sheet neighbours"
            continue
        off, allowed = _distances(state, triple, point)
        if np.ptp(power_at(table, rows, point)) > _CORNER_ERROR * table.weight[rows].max():
            yield f"corner or gap {triple} is not of equal power"
        elif (off > SHEET_GAP * table.radius[rows] + allowed).any():
            yield f"corner or gap {triple} is not on its patches"


def _distances(state: AtlasState, triple: tuple[int, ...], point) -> tuple[np.ndarray, float]:
    """(3,) distances of a corner from its patches, and how large they may be: the tolerance and
    five of the largest deviation that the patches predict there; length."""
    found = state.field.of_patches(np.array(triple), np.tile(point, (3, 1)))
    allowed = state.tolerance + _DEVIATIONS * np.sqrt(found.numbers[:, 1].max())
    return np.abs(found.distance), float(allowed)


def _graph(state: AtlasState) -> Iterator[str]:
    """The nodes are the patches, and the edges join neighbours."""
    graph = state.graph
    if set(graph) != set(state.table.rows.tolist()):
        yield "the graph's nodes are not the patches"
    for first, second, data in graph.edges(data=True):
        boundary = data["boundary"]
        if second not in state.neighbours[first]:
            yield f"patches {first} and {second} meet but are no sheet neighbours"
        if boundary.patches != (min(first, second), max(first, second)):
            yield f"the boundary of {first} and {second} names others"


def _corners_end(state: AtlasState) -> Iterator[str]:
    """All corners end boundaries."""
    graph = state.graph
    for triple in state.corners:
        if not all(graph.has_edge(*pair) for pair in combinations(triple, 2)):
            yield f"corner {triple} lacks one of its boundaries"


def _closure(state: AtlasState) -> Iterator[str]:
    """On a closed surface every boundary ends in corners, and every patch has a boundary.

    Where a patch interrupts the boundary of two others, the two corners count as one, and so do the
    two pieces of the boundary. So V - E + F is the same.
    """
    if not (state.closed and len(state) > 3):
        return
    graph = state.graph
    ended = {pair for triple in state.corners for pair in combinations(triple, 2)}
    for pair in map(sorted, graph.edges):
        if tuple(pair) not in ended:
            yield f"the boundary of {pair} ends nowhere"
    yield from (f"patch {i} has no boundary" for i, degree in graph.degree if degree == 0)
