"""What must hold of an atlas's graph: boundaries, corners, creases are where patches meet."""

from collections.abc import Iterator
from copy import deepcopy
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edit.refresh import OUTLINE_MOVED
from touchatlas.atlas.field.patch_values import patch_values
from touchatlas.atlas.graph.cells import Cells
from touchatlas.atlas.graph.crease_curves import crease_curves, sources_of
from touchatlas.atlas.graph.power_diagram import corners_on, power_at
from touchatlas.atlas.patches.intersect import patches_at
from touchatlas.atlas.patches.normal_equations import SHEET_GAP
from touchatlas.atlas.patches.patch_table import PatchTable

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# Of what is drawn anew by the same steps, in tolerances.
_AGAIN = 1e-6
# Of the power at corners, over the squared core radius: they are found by three Newton steps.
_CORNER = 1e-3
# Of patches at a corner, in radii: kin are as far apart, and what they learned since may have moved
# them. And in the largest deviation that they predict there: one of them may know little.
_MOVED, _UNSURE = SHEET_GAP + OUTLINE_MOVED, 5.0
# Of so many samples next to the anchor of a crease some are clearly on its inner side: all, but
# next to a notch.
_NEAREST, _NOISES = 9, 4.0


def graph_violations(atlas: "Atlas") -> list[str]:
    """What does not hold, a sentence each."""
    checks = (_creasing, _curves, _places, _tiling, _graph, _corners, _closure)
    return [sentence for check in checks for sentence in check(atlas)]


def _creasing(atlas: "Atlas") -> Iterator[str]:
    """Creased patches are in use, of two sheets, and meet at their anchor at an angle."""
    table, creases, pool = atlas.table, atlas.creases, atlas.membership.pool
    alive = set(table.rows.tolist())
    for row in range(table.size):
        if any(not creases.between(row, j) for j in creases.of(row)):
            yield f"patch {row} is creased with one that is not creased with it"
    for (i, j), crease in creases.pairs.items():
        if not i < j or not {i, j} <= alive or j in atlas.neighbours[i]:
            yield f"patches {i} and {j} are creased, but one is removed or they are kin"
            continue
        if i not in creases.of(j) or j not in creases.of(i) or abs(crease.sign) != 1:
            yield f"the crease of {i} and {j} is not mutual"
        seen = patches_at(table, np.array([[i, j]]), crease.anchor[None])
        if np.abs(seen.distance).max() > _CORNER * table.radius[[i, j]].min():
            yield f"patches {i} and {j} do not meet at the anchor of their crease"
        for k, normal in zip((j, i), seen.normals[0], strict=True):
            offset = pool.points[atlas.membership.fitted[k]] - crease.anchor
            near = np.argsort((offset * offset).sum(axis=1))[:_NEAREST]
            slack = _NOISES * table.measurement_std[k] + atlas.bias
            if not (crease.sign * (offset[near] @ normal)).min(initial=0.0) < -slack:
                yield f"the crease of {i} and {j} has the wrong sign"


def _curves(atlas: "Atlas") -> Iterator[str]:
    """Curves of creases are as they would be drawn now."""
    table, creases, pairs = atlas.table, atlas.creases, sorted(atlas.creases.pairs)
    lines = crease_curves(table, sources_of(table, creases, pairs))
    for pair, line in zip(pairs, lines, strict=True):
        kept = creases.curve(*pair)
        if kept.shape != line.shape or not _alike(atlas, kept, line):
            yield f"the curve of the crease of {pair} is not where its patches meet"


def _alike(atlas: "Atlas", points, others) -> bool:
    return bool(np.allclose(points, others, rtol=1e-9, atol=_AGAIN * atlas.tolerance))


def _places(atlas: "Atlas") -> Iterator[str]:
    """Corners and gaps of kin are of equal power, on their patches, and known to each of them."""
    table, cells = atlas.table, atlas.cells
    known = {t for row in range(table.size) for t in cells.corners_of(row)}
    if known != set(cells.corners) or any(
        t not in cells.corners_of(i) for t in cells.corners for i in t
    ):
        yield "the patches know other corners than there are"
    for triple, point in (*cells.corners.items(), *cells.gaps.items()):
        rows = list(triple)
        if not all(j in atlas.neighbours[i] for i, j in combinations(triple, 2)):
            yield f"corner or gap {triple} is not of kin"
            continue
        found = patch_values(
            table, atlas.neighbours, np.array(rows), np.tile(point, (3, 1)), np.inf
        )
        borne = atlas.tolerance + _UNSURE * np.sqrt(found.numbers[:, 1].max())
        if np.ptp(power_at(table, rows, point)) > _CORNER * table.weight[rows].max():
            yield f"corner or gap {triple} is not of equal power"
        elif (np.abs(found.distance) > _MOVED * table.radius[rows] + borne).any():
            yield f"corner or gap {triple} is not on its patches"


def _tiling(atlas: "Atlas") -> Iterator[str]:
    """Corners and boundaries are those of the patches, as they are now or before they moved by as
    much as is borne."""
    cells = atlas.cells
    fresh = _fresh_tiling(atlas)
    found = [fresh]
    if any(_apart(cells, found)):
        fresh.mend()
        found += [_fresh_tiling(atlas, share) for share in (-OUTLINE_MOVED, OUTLINE_MOVED)]
    triples, pairs = _apart(cells, found)
    triples = [triple for triple in triples if not _is_tangent(atlas.table, triple)]
    yield from (f"corner {triple} is missing, or is none" for triple in triples)
    if pairs:
        yield "the tiling has other edges than its patches have boundaries"
        return
    for first, second, data in cells.graph.edges(data=True):
        if not fresh.graph.has_edge(first, second):
            continue
        mine, new = data["boundary"], fresh.graph.edges[first, second]["boundary"]
        if mine.points.shape != new.points.shape or not _alike(atlas, mine.points, new.points):
            yield f"the boundary of {first} and {second} is not where they meet"


def _fresh_tiling(atlas: "Atlas", share: float = 0.0) -> Cells:
    """What ``retile`` makes of the patches when all are raised by a share of their radii."""
    table = atlas.table
    if share:
        table = deepcopy(table)
        table.mean[table.rows, 0] += share
    fresh = Cells(table, atlas.neighbours)
    for row in range(table.size):
        fresh.add(row, bool(table.alive[row]))
    fresh.retile()
    return fresh


def _is_tangent(table: PatchTable, triple) -> bool:
    """Whether the radical axis of three patches, one of which has moved since they were drawn, is
    now so near tangent to the surface that no corner can be found on it."""
    first, second, row = (np.array([i]) for i in triple)
    moved = bool(table.ring_shifts(np.array(triple)).max() > _AGAIN)
    return moved and bool(np.isnan(corners_on(table, row, first, second)).any())


def _apart(cells: Cells, found: list[Cells]):
    """Triples with a corner, and pairs with a boundary, in all of the tilings found but not in one,
    or in none of them but in it."""
    corners = [set(one.corners) for one in (cells, *found)]
    # Whether three cores leave a corner or a gap is a matter of a share of their power.
    unsure = set().union(*corners).intersection(set().union(*(one.gaps for one in (cells, *found))))
    edges = [set(map(tuple, map(sorted, one.graph.edges))) for one in (cells, *found)]
    triples, pairs = (
        (set.intersection(*others) - mine) | (mine - set().union(*others))
        for mine, *others in (corners, edges)
    )
    near = {pair for triple in unsure for pair in combinations(triple, 2)}
    return sorted(triples - unsure), sorted(pairs - near)


def _graph(atlas: "Atlas") -> Iterator[str]:
    graph = atlas.graph
    if set(graph) != set(atlas.table.rows.tolist()):
        yield "the graph's nodes are not the patches"
    for first, second, data in graph.edges(data=True):
        boundary = data["boundary"]
        if second not in atlas.neighbours[first] and not atlas.creases.sign(first, second):
            yield f"patches {first} and {second} meet but are neither kin nor creased"
        if atlas.creases.sign(first, second) and not boundary.crease:
            yield f"the boundary of {first} and {second} is a crease and does not say so"
        if boundary.patches != (min(first, second), max(first, second)):
            yield f"the boundary of {first} and {second} names others"


def _corners(atlas: "Atlas") -> Iterator[str]:
    """Corners on creases lie on them, and all corners end boundaries."""
    table, graph = atlas.table, atlas.graph
    for triple, point in atlas.corners.items():
        pairs = list(combinations(triple, 2))
        if not all(graph.has_edge(*pair) for pair in pairs):
            yield f"corner {triple} lacks one of its boundaries"
        scale = np.sqrt(table.weight[list(triple)].max())
        found = patch_values(
            table, atlas.neighbours, np.array(triple), np.tile(point, (3, 1)), np.inf
        )
        # Kin agree within the tolerance, if all know, and the point is on one of them.
        borne = atlas.tolerance + _UNSURE * np.sqrt(found.numbers[:, 1].max())
        off = dict(zip(triple, np.abs(found.distance), strict=True))
        for pair in filter(lambda pair: atlas.creases.sign(*pair), pairs):
            if max(off[i] for i in pair) > _CORNER * scale + borne:
                yield f"corner {triple} is not on the crease of {pair}"


def _closure(atlas: "Atlas") -> Iterator[str]:
    """On a closed surface every boundary ends in corners, and no patch is without boundary.

    A patch that bites into the boundary of two others has two corners with them, which count as
    one, as the two pieces of that boundary count as one: V - E + F is the same.
    """
    if not (atlas.closed and len(atlas) > 3):
        return
    graph = atlas.graph
    ended = {pair for triple in atlas.corners for pair in combinations(triple, 2)}
    for pair in map(sorted, graph.edges):
        if tuple(pair) not in ended:
            yield f"the boundary of {pair} ends nowhere"
    yield from (f"patch {i} has no boundary" for i, degree in graph.degree if degree == 0)
