"""Graph invariants: boundaries, corners and creases lie where patches meet."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from touchatlas.atlas.check.sample_invariants import ROUNDING
from touchatlas.atlas.graph.crease_curves import crease_curves, sources_of
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.normal_equations import SHEET_GAP
from touchatlas.atlas.state import AtlasState

# Largest distance of a crease curve from the same curve computed again, in tolerances: a thousand
# times the rounding. Doubled, nothing else passes.
_CURVE_ERROR = 1e-6
# Largest error of corners and anchors: of power over the weight, of distance over the radius.
# Newton's method stops below it. Doubled, wrong corners pass only if they are as near.
_CORNER_ERROR = 1e-3
# Largest distance of patches at a corner in the largest deviation that they predict there, because
# one of them may have few samples. Doubled, a patch of another sheet would pass.
_DEVIATIONS = 5.0
# Samples next to the anchor of a crease of which one at least is on the inner side, and how far, in
# deviations of the noise. All are, except at a notch. Doubled, a wrong sign may pass at a notch,
# and a right one may fail on thin patches.
_NEAREST, _NOISES = 9, 4.0


def graph_violations(state: AtlasState) -> list[str]:
    """A sentence for each invariant that does not hold."""
    checks = (_creases, _curves, _corners_of_cells, _graph, _corners_on_creases, _closure)
    return [sentence for check in checks for sentence in check(state)]


def _creases(state: AtlasState) -> Iterator[str]:
    """Creased patches are in use, of two sheets, and meet at the anchor of their crease."""
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
        if np.abs(seen.distance).max() > _CORNER_ERROR * table.radius[[i, j]].min():
            yield f"patches {i} and {j} do not meet at the anchor of their crease"
        for k, normal in zip((j, i), seen.normals[0], strict=True):
            offset = pool.points[state.membership.fitted[k]] - crease.anchor
            near = np.argsort((offset * offset).sum(axis=1))[:_NEAREST]
            slack = _NOISES * table.measurement_std[k] + state.bias
            if not (crease.sign * (offset[near] @ normal)).min(initial=0.0) < -slack:
                yield f"the crease of {i} and {j} has the wrong sign"


def _curves(state: AtlasState) -> Iterator[str]:
    """Kept crease curves equal the same curves computed again."""
    table, creases, pairs = state.table, state.creases, sorted(state.creases.pairs)
    lines = crease_curves(table, sources_of(table, creases, pairs))
    near = _CURVE_ERROR * state.tolerance
    for pair, line in zip(pairs, lines, strict=True):
        kept = state.surface_graph.curves.curve(*pair)
        if kept.shape != line.shape or not np.allclose(kept, line, rtol=ROUNDING, atol=near):
            yield f"the curve of the crease of {pair} is not where its patches meet"


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
    """The nodes are the patches, and the edges join neighbours or creased patches."""
    graph = state.graph
    if set(graph) != set(state.table.rows.tolist()):
        yield "the graph's nodes are not the patches"
    for first, second, data in graph.edges(data=True):
        boundary = data["boundary"]
        if second not in state.neighbours[first] and not state.creases.sign(first, second):
            yield f"patches {first} and {second} meet but are neither sheet neighbours nor creased"
        if state.creases.sign(first, second) and not boundary.crease:
            yield f"the boundary of {first} and {second} is a crease but is not marked as one"
        if boundary.patches != (min(first, second), max(first, second)):
            yield f"the boundary of {first} and {second} names others"


def _corners_on_creases(state: AtlasState) -> Iterator[str]:
    """All corners end boundaries, and corners on creases lie on them."""
    table, graph = state.table, state.graph
    for triple, point in state.corners.items():
        pairs = list(combinations(triple, 2))
        if not all(graph.has_edge(*pair) for pair in pairs):
            yield f"corner {triple} lacks one of its boundaries"
        scale = np.sqrt(table.weight[list(triple)].max())
        distances, allowed = _distances(state, triple, point)
        off = dict(zip(triple, distances, strict=True))
        for pair in filter(lambda pair: state.creases.sign(*pair), pairs):
            if max(off[i] for i in pair) > _CORNER_ERROR * scale + allowed:
                yield f"corner {triple} is not on the crease of {pair}"


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
