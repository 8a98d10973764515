"""What must hold of an atlas's graph: boundaries, corners, creases are where patches meet."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from touchatlas.atlas.graph.crease_curves import crease_curves, sources_of
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.normal_equations import SHEET_GAP
from touchatlas.atlas.state import AtlasState

# Of what is drawn again by the same steps, in tolerances: rounding, a thousandfold.
_AGAIN = 1e-6
# Of the power at corners, over the weight: Newton's method stops there.
_CORNER = 1e-3
# Of patches at a corner, in the largest deviation that they predict there: one of them may know
# little. Doubled, a patch of another sheet would pass.
_UNSURE = 5.0
# Of so many samples next to the anchor of a crease some are clearly on its inner side: all, but
# next to a notch.
_NEAREST, _NOISES = 9, 4.0


def graph_violations(state: AtlasState) -> list[str]:
    """What does not hold, a sentence each."""
    checks = (_creasing, _curves, _places, _graph, _corners, _closure)
    return [sentence for check in checks for sentence in check(state)]


def _creasing(state: AtlasState) -> Iterator[str]:
    """Creased patches are in use, of two sheets, and meet at their anchor at an angle."""
    table, creases, pool = state.table, state.creases, state.membership.pool
    alive = set(table.rows.tolist())
    for row in range(table.size):
        if any(not creases.between(row, j) for j in creases.of(row)):
            yield f"patch {row} is creased with one that is not creased with it"
    for (i, j), crease in creases.pairs.items():
        if not i < j or not {i, j} <= alive or j in state.neighbours[i]:
            yield f"patches {i} and {j} are creased, but one is removed or they are of one sheet"
            continue
        if i not in creases.of(j) or j not in creases.of(i) or abs(crease.sign) != 1:
            yield f"the crease of {i} and {j} is not mutual"
        seen = patches_at(table, np.array([[i, j]]), crease.anchor[None])
        if np.abs(seen.distance).max() > _CORNER * table.radius[[i, j]].min():
            yield f"patches {i} and {j} do not meet at the anchor of their crease"
        for k, normal in zip((j, i), seen.normals[0], strict=True):
            offset = pool.points[state.membership.fitted[k]] - crease.anchor
            near = np.argsort((offset * offset).sum(axis=1))[:_NEAREST]
            slack = _NOISES * table.measurement_std[k] + state.bias
            if not (crease.sign * (offset[near] @ normal)).min(initial=0.0) < -slack:
                yield f"the crease of {i} and {j} has the wrong sign"


def _curves(state: AtlasState) -> Iterator[str]:
    """Curves of creases are as they would be drawn now."""
    table, creases, pairs = state.table, state.creases, sorted(state.creases.pairs)
    lines = crease_curves(table, sources_of(table, creases, pairs))
    for pair, line in zip(pairs, lines, strict=True):
        kept = state.surface_graph.curves.curve(*pair)
        if kept.shape != line.shape or not _alike(state, kept, line):
            yield f"the curve of the crease of {pair} is not where its patches meet"


def _alike(state: AtlasState, points, others) -> bool:
    return bool(np.allclose(points, others, rtol=1e-9, atol=_AGAIN * state.tolerance))


def _places(state: AtlasState) -> Iterator[str]:
    """Corners and gaps of cells are of equal power, and on their patches."""
    table, cells = state.table, state.surface_graph.cells
    for triple, point in (*cells.corners.items(), *cells.gaps.items()):
        rows = list(triple)
        if not all(j in state.neighbours[i] for i, j in combinations(triple, 2)):
            yield f"corner or gap {triple} is not of sheet neighbours"
            continue
        found = state.field.of_patches(np.array(rows), np.tile(point, (3, 1)))
        borne = state.tolerance + _UNSURE * np.sqrt(found.numbers[:, 1].max())
        if np.ptp(power_at(table, rows, point)) > _CORNER * table.weight[rows].max():
            yield f"corner or gap {triple} is not of equal power"
        elif (np.abs(found.distance) > SHEET_GAP * table.radius[rows] + borne).any():
            yield f"corner or gap {triple} is not on its patches"


def _graph(state: AtlasState) -> Iterator[str]:
    graph = state.graph
    if set(graph) != set(state.table.rows.tolist()):
        yield "the graph's nodes are not the patches"
    for first, second, data in graph.edges(data=True):
        boundary = data["boundary"]
        if second not in state.neighbours[first] and not state.creases.sign(first, second):
            yield f"patches {first} and {second} meet but are neither sheet neighbours nor creased"
        if state.creases.sign(first, second) and not boundary.crease:
            yield f"the boundary of {first} and {second} is a crease and does not say so"
        if boundary.patches != (min(first, second), max(first, second)):
            yield f"the boundary of {first} and {second} names others"


def _corners(state: AtlasState) -> Iterator[str]:
    """Corners on creases lie on them, and all corners end boundaries."""
    table, graph = state.table, state.graph
    for triple, point in state.corners.items():
        pairs = list(combinations(triple, 2))
        if not all(graph.has_edge(*pair) for pair in pairs):
            yield f"corner {triple} lacks one of its boundaries"
        scale = np.sqrt(table.weight[list(triple)].max())
        found = state.field.of_patches(np.array(triple), np.tile(point, (3, 1)))
        # Neighbours agree within the tolerance, if all know, and the point is on one of them.
        borne = state.tolerance + _UNSURE * np.sqrt(found.numbers[:, 1].max())
        off = dict(zip(triple, np.abs(found.distance), strict=True))
        for pair in filter(lambda pair: state.creases.sign(*pair), pairs):
            if max(off[i] for i in pair) > _CORNER * scale + borne:
                yield f"corner {triple} is not on the crease of {pair}"


def _closure(state: AtlasState) -> Iterator[str]:
    """On a closed surface every boundary ends in corners, and no patch is without boundary.

    A patch that bites into the boundary of two others has two corners with them, which count as
    one, as the two pieces of that boundary count as one: V - E + F is the same.
    """
    if not (state.closed and len(state) > 3):
        return
    graph = state.graph
    ended = {pair for triple in state.corners for pair in combinations(triple, 2)}
    for pair in map(sorted, graph.edges):
        if tuple(pair) not in ended:
            yield f"the boundary of {pair} ends nowhere"
    yield from (f"patch {i} has no boundary" for i, degree in graph.degree if degree == 0)
