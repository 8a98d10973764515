"""Refresh: the creases of new and changed patches, and the sheets that they separate."""

from collections.abc import Iterator

import numpy as np

from touchatlas.atlas.edit.replace import in_ball
from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.graph.find_creases import find_creases, move_anchors
from touchatlas.atlas.graph.power_diagram import CREASE_ANGLE, MEETS, power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.state import AtlasState

# Largest distance of a crease from the known crease that it continues, in radii of the smaller
# patch: a few predicted deviations of both. Doubled, creases go on around corners.
_LARGEST_OFFSET = 0.05


def update_creases(state: AtlasState, rows) -> None:
    """Find the creases of new and changed rows, and move the anchors of the creases they had."""
    table, creases, pairs = state.table, state.creases, set[tuple[int, int]]()
    move_anchors(table, creases, rows)
    fitted, edges = state.membership.fitted, state.membership.pool.edges
    for i in rows:
        if edges[fitted[i]].any():
            near = set(table.index.rows_near(table.origin[i], table.radius[i]).tolist())
            near -= state.neighbours[i] | creases.of(i) | {i}
            pairs.update((min(i, j), max(i, j)) for j in near)
    state.surface_graph.mark_stale(rows)
    found = find_creases(table, state.membership, sorted(pairs), state.bias)
    _enter_creases(state, found)
    _enter_creases(state, continued_creases(state, set(rows)))


def _enter_creases(state: AtlasState, found: dict[tuple[int, int], Crease]) -> None:
    for pair, crease in found.items():
        state.creases.enter(*pair, crease)
        separate_sheets(state, *pair)
    state.mark_stale({i for pair in found for i in pair})


def continued_creases(state: AtlasState, rows: set[int]) -> dict[tuple[int, int], Crease]:
    """Creases that continue those of rows, by ascending pairs of patches.

    Where a crease curve runs from the cells of its two patches into the cells of their neighbours,
    those neighbours are creased too, although no contour of theirs may have ended at the edge.
    """
    table, creases, neighbours = state.table, state.creases, state.neighbours
    curve = state.surface_graph.curves.curve
    starts: dict[tuple[int, int], tuple[int, np.ndarray]] = {}
    for i, j in sorted(pair for pair in creases.pairs if not rows.isdisjoint(pair)):
        line = curve(i, j)
        sheets = [np.array([k, *sorted(neighbours[k])]) for k in (i, j)]
        for a, b, point in _facing_along(table, sheets, line):
            if a != b and b not in neighbours[a] and not creases.between(a, b):
                starts.setdefault((min(a, b), max(a, b)), (creases.sign(i, j), point))
    if not starts:
        return {}
    both, start = np.array(list(starts)), np.array([point for _, point in starts.values()])
    seen = intersect(table, both, start)
    good = (np.abs(seen.distance) <= MEETS * table.radius[both]).all(axis=1)
    cosine = np.abs((seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1))
    good &= (seen.across <= 1.0).all(axis=1) & (cosine <= np.cos(CREASE_ANGLE))
    good &= in_ball(seen.points, start, _LARGEST_OFFSET * table.radius[both].min(axis=1))
    return {
        pair: Crease(sign, point)
        for (pair, (sign, _)), point, keep in zip(starts.items(), seen.points, good, strict=True)
        if keep
    }


def _facing_along(table: PatchTable, sheets, line) -> Iterator[tuple[int, int, np.ndarray]]:
    """Pairs of patches with the least power of two sheets, at points (n, 3) of a line and between
    them: where both owners change between two points, the one changes before the other."""
    first, second = (sheet[power_at(table, sheet, line).argmin(axis=1)] for sheet in sheets)
    yield from zip(first.tolist(), second.tolist(), line, strict=True)
    changes = (first[1:] != first[:-1]) & (second[1:] != second[:-1])
    for k in np.flatnonzero(changes).tolist():
        ends = line[k : k + 2]
        where = []
        for before, after in (first[k : k + 2], second[k : k + 2]):
            # The difference of two powers is linear along a segment.
            low, high = power_at(table, [before], ends)[:, 0] - power_at(table, [after], ends)[:, 0]
            where.append(low / (low - high) if low < high else 0.5)
        pair = (first[k + 1], second[k]) if where[0] < where[1] else (first[k], second[k + 1])
        yield int(pair[0]), int(pair[1]), ends[0] + 0.5 * sum(where) * (ends[1] - ends[0])


def smooth_neighbours(
    state: AtlasState, table: PatchTable, row: int, partners: frozenset[int] = frozenset()
) -> np.ndarray:
    """The sheet neighbours of a row of the table, or of a candidate, without those across edges.

    Across an edge are the rows ``partners`` with which it makes a crease, and the patches behind
    the creases of its own sheet whose normals differ from its own by a crease angle.
    """
    neighbours = sheet_neighbours(table, row)
    if not (partners or len(state.creases)):
        return neighbours
    alike = sheet_neighbours(table, row, np.cos(CREASE_ANGLE))
    alike = np.setdiff1d(alike, list(partners))
    edge = partners.union(*(state.creases.of(i) for i in alike.tolist()))
    across = partners | (state.neighbours.around(edge) - set(alike.tolist()))
    return np.setdiff1d(neighbours, list(across))


def inherit_creases(state: AtlasState, row: int, creases: dict[int, Crease]) -> None:
    """Give a row the creases of the rows that it replaces, by the patch behind each."""
    for other, crease in creases.items():
        if state.table.alive[other] and other not in state.neighbours[row]:
            state.creases.enter(row, other, crease)
    move_anchors(state.table, state.creases, [row])
    state.mark_stale([row, *creases])


def separate_sheets(state: AtlasState, first: int, second: int) -> None:
    """Keep a neighbour of both sides of a crease on the side whose normal it matches better.

    Before the edge was known the two sides were taken for one sheet.
    """
    crease = state.creases.between(first, second)
    both = sorted(state.neighbours[first] & state.neighbours[second])
    if crease is None or not both:
        return
    rows = np.array([[first, second, i] for i in both])
    normals = patches_at(state.table, rows, np.tile(crease.anchor, (len(rows), 1))).normals
    alike = np.einsum("mki,mi->mk", normals[:, :2], normals[:, 2])
    state.mark_stale([first, second])
    for i, other in zip(both, np.where(alike[:, 0] > alike[:, 1], second, first), strict=True):
        state.neighbours.separate(i, int(other))
    state.mark_stale([first, second, *both])
