"""Validation: what must hold of every atlas, checked from its parts."""

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.boundary import power_at
from touchatlas.atlas.meeting import look
from touchatlas.atlas.moments import sums_of

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# Of sums over the same samples in another order.
_ROUNDING = 1e-9
# Of the power at corners, over the squared core radius: they are found by three Newton steps.
_CORNER = 1e-3


def violations(atlas: "Atlas") -> list[str]:
    """What does not hold, a sentence each; empty for a sound atlas."""
    checks = (_numbers, _samples, _equations, _kinship, _creasing, _graph, _corners, _closure)
    return [sentence for check in checks for sentence in check(atlas)]


def _numbers(atlas: "Atlas") -> Iterator[str]:
    table, rows = atlas.table, atlas.table.rows
    for name in table.names:
        if name != "ring" and not np.isfinite(getattr(table, name)[rows]).all():
            yield f"{name} is not finite"
    axes = table.axes[rows]
    if not np.allclose(axes @ axes.transpose(0, 2, 1), np.eye(3), atol=1e-9):
        yield "axes are not orthonormal"
    if (table.radius[rows] <= 0).any() or (table.power[rows] <= 0).any():
        yield "a radius is not positive"


def _samples(atlas: "Atlas") -> Iterator[str]:
    learning, alive = atlas.learning, set(atlas.table.rows.tolist())
    brought = np.concatenate([np.zeros(0, int), *learning.brought])
    if not np.array_equal(np.sort(brought), np.arange(len(learning.pool))):
        yield "a sample is brought by none, or by two"
    for row, (members, own) in enumerate(zip(learning.members, learning.brought, strict=True)):
        if len(members) != len(np.unique(members)):
            yield f"patch {row} learned a sample twice"
        if row not in alive and len(members) + len(own):
            yield f"patch {row} is removed but has samples"
    if not set(atlas.frontier.home.tolist()) <= alive or (atlas.frontier.depth <= 1.0).any():
        yield "the frontier has a covered sample, or one of a removed patch"


def _equations(atlas: "Atlas") -> Iterator[str]:
    table, learning = atlas.table, atlas.learning
    for row in table.rows.tolist():
        index = learning.members[row]
        every = np.ones((1, len(index)), bool)
        moments, right, _ = sums_of(table, np.array([row]), learning.pool, index, every)
        scale = _ROUNDING * np.abs(moments).max()
        if np.abs(moments[0] - table.moments[row]).max() > scale or table.count[row] != len(index):
            yield f"the equations of patch {row} are not those of its samples"
        elif np.abs(right[0] - table.right[row]).max() > scale:
            yield f"the right side of patch {row} is not that of its samples"


def _kinship(atlas: "Atlas") -> Iterator[str]:
    alive = set(atlas.table.rows.tolist())
    for row, kin in enumerate(atlas.kin):
        if row in kin or any(row not in atlas.kin[i] for i in kin):
            yield f"kinship of patch {row} is not mutual"
        if not kin <= alive or (kin and row not in alive):
            yield f"patch {row} is kin to a removed one, or is one"


def _creasing(atlas: "Atlas") -> Iterator[str]:
    """Creased patches are in use, of two sheets, and meet at their anchor at an angle."""
    table, creases = atlas.table, atlas.creases
    alive = set(table.rows.tolist())
    for (i, j), crease in creases.pairs.items():
        if not i < j or not {i, j} <= alive or j in atlas.kin[i]:
            yield f"patches {i} and {j} are creased, but one is removed or they are kin"
            continue
        if i not in creases.of(j) or j not in creases.of(i) or abs(crease.sign) != 1:
            yield f"the crease of {i} and {j} is not mutual"
        seen = look(table, np.array([[i, j]]), crease.anchor[None])
        if np.abs(seen.distance).max() > _CORNER * table.radius[[i, j]].min():
            yield f"patches {i} and {j} do not meet at the anchor of their crease"
    homes = set(atlas.edge_ends.home.tolist())
    if not homes <= alive:
        yield "an end at an edge is at home at a removed patch"


def _graph(atlas: "Atlas") -> Iterator[str]:
    graph = atlas.graph
    if set(graph) != set(atlas.table.rows.tolist()):
        yield "the graph's nodes are not the patches"
    for first, second, data in graph.edges(data=True):
        boundary = data["boundary"]
        if second not in atlas.kin[first] and not atlas.creases.sign(first, second):
            yield f"patches {first} and {second} meet but are neither kin nor creased"
        if atlas.creases.sign(first, second) and not boundary.crease:
            yield f"the boundary of {first} and {second} is a crease and does not say so"
        if boundary.patches != (min(first, second), max(first, second)):
            yield f"the boundary of {first} and {second} names others"


def _corners(atlas: "Atlas") -> Iterator[str]:
    table, graph = atlas.table, atlas.graph
    for triple, point in atlas.corners.items():
        pairs = list(combinations(triple, 2))
        if not all(graph.has_edge(*pair) for pair in pairs):
            yield f"corner {triple} lacks one of its boundaries"
        for pair in pairs:
            scale = table.power[list(triple)].max()
            if atlas.creases.sign(*pair):
                off = look(table, np.array([pair]), point[None]).distance
                # Kin agree within the tolerance, and the point is on one of them.
                if np.abs(off).max() > _CORNER * np.sqrt(scale) + atlas.tolerance:
                    yield f"corner {triple} is not on the crease of {pair}"
            elif np.ptp(power_at(table, list(pair), point)) > _CORNER * scale:
                yield f"corner {triple} is not of equal power"


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
