"""Folding: creases of patches that changed, and what of their outlines lies beyond them."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.graph.find_creases import MEETS, find_creases
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, CREASE_ANGLE, power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# So far, in smaller patch radii, a crease may be from that of the next patches of its sheets.
_MOVED = 0.05
# An outline is laid anew when that would move it by so much, in radii.
OUTLINE_MOVED = 0.05


def update_creases(atlas: "Atlas", rows) -> None:
    """Find the creases of rows that came or changed; their outlines beyond are not open, and are
    laid anew where the rows have moved away from them."""
    table, creases, pairs = atlas.table, atlas.creases, set[tuple[int, int]]()
    creases.renew(rows)
    members, edges = atlas.membership.fitted, atlas.membership.pool.edges
    for i in rows:
        if not edges[members[i]].any():
            continue
        near = set(table.index.rows_near(table.origin[i], table.radius[i]).tolist())
        near -= atlas.neighbours[i] | creases.of(i) | {i}
        pairs.update((min(i, j), max(i, j)) for j in near)
    for pair, crease in find_creases(table, atlas.membership, sorted(pairs), atlas.bias).items():
        creases.enter(*pair, crease)
        separate_sheets(atlas, *pair)
    for pair, crease in continued(atlas, set(rows)).items():
        creases.enter(*pair, crease)
        separate_sheets(atlas, *pair)
    if len(creases):
        around = set(rows).union(*(creases.of(i) for i in rows))
        around = around.union(*(atlas.neighbours[i] for i in around))
        # A crease that moved may have left what was beyond it.
        creased = {i for i in around if creases.of(i)}
        reopen(atlas, sorted(creased))
        trim(atlas, around - creased)
    update_outlines(atlas, rows)


def continued(atlas: "Atlas", rows: set[int]) -> dict[tuple[int, int], Crease]:
    """Creases of the sheets of rows that no contours of the two patches themselves told of: along
    a crease those are creased that have the least power of their sheets."""
    table, creases, neighbours = atlas.table, atlas.creases, atlas.neighbours
    places: dict[tuple[int, int], tuple[int, np.ndarray]] = {}
    for i, j in sorted(pair for pair in creases.pairs if not rows.isdisjoint(pair)):
        line = creases.curve(i, j)
        sheets = [np.array([k, *sorted(neighbours[k])]) for k in (i, j)]
        leaders = [sheet[power_at(table, sheet, line).argmin(axis=1)] for sheet in sheets]
        for a, b, point in zip(*(leader.tolist() for leader in leaders), line, strict=True):
            if a != b and b not in neighbours[a] and not creases.between(a, b):
                places.setdefault((min(a, b), max(a, b)), (creases.sign(i, j), point))
    if not places:
        return {}
    both, start = np.array(list(places)), np.array([point for _, point in places.values()])
    seen = intersect(table, both, start)
    good = (np.abs(seen.distance) <= MEETS * table.radius[both]).all(axis=1)
    cosine = np.abs((seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1))
    good &= (seen.across <= 1.0).all(axis=1) & (cosine <= np.cos(CREASE_ANGLE))
    offset = seen.points - start
    good &= (offset * offset).sum(axis=1) <= (_MOVED * table.radius[both].min(axis=1)) ** 2
    return {
        pair: Crease(sign, point)
        for (pair, (sign, _)), point, keep in zip(places.items(), seen.points, good, strict=True)
        if keep
    }


def trim(atlas: "Atlas", rows) -> None:
    """Close the outlines of rows where they lie beyond a crease."""
    table, open_ring = atlas.table, atlas.table.outline_open
    rows = np.array(sorted(rows), int)
    which, places = np.nonzero(open_ring[rows])
    which = rows[which]
    beyond = atlas.creases.beyond(which, table.outline[which, places])
    open_ring[which[beyond], places[beyond]] = 0.0


def update_outlines(atlas: "Atlas", rows) -> None:
    """Lay outlines of rows, and find their corners, anew where they have moved away from them."""
    shifts = atlas.table.ring_shifts(rows)
    moved = [i for i, shift in zip(rows, shifts, strict=True) if shift > OUTLINE_MOVED]
    if moved:
        reopen(
            atlas, [i for i, fits in zip(moved, atlas.table.ring_fits(moved), strict=True) if fits]
        )
        atlas.cells.renew(set(moved))


def reopen(atlas: "Atlas", rows) -> None:
    """Which parts of the rows' outlines no cell of their kin covers, anew."""
    table = atlas.table
    table.renew_rings(rows)
    for row in rows:
        table.outline_open[row] = uncovered(
            table, sorted(atlas.neighbours[row]), table.outline[row]
        )
    trim(atlas, rows)


def uncovered(table: PatchTable, neighbours: list[int], points) -> np.ndarray:
    """(n,) whether no cell of a patch's kin covers points (n, 3) of its outline."""
    beyond: np.ndarray = (
        power_at(table, neighbours, points) > CELL_MARGIN * table.weight[neighbours]
    )
    return np.asarray(beyond.all(axis=1))


def smooth_neighbours(atlas: "Atlas", row: int, partners: set[int]) -> np.ndarray:
    """The kin of a row that is creased with others: none of these, and none of a sheet behind an
    edge of its own sheet, from which it turns away as much."""
    neighbours = sheet_neighbours(atlas.table, row)
    if not (partners or len(atlas.creases)):
        return neighbours
    alike = np.setdiff1d(sheet_neighbours(atlas.table, row, np.cos(CREASE_ANGLE)), list(partners))
    edge = partners.union(*(atlas.creases.of(i) for i in alike.tolist()))
    behind = edge.union(*(atlas.neighbours[i] for i in edge))
    across = partners | (behind - set(alike.tolist()))
    return np.setdiff1d(neighbours, list(across))


def inherit(atlas: "Atlas", row: int, pairs) -> None:
    """Crease a merged row with those that the creases ``pairs``, a dict of row to Crease, of the
    rows in its place were with."""
    for other, crease in pairs.items():
        if atlas.table.alive[other] and other not in atlas.neighbours[row]:
            atlas.creases.enter(row, other, crease)
    atlas.creases.renew([row])


def separate_sheets(atlas: "Atlas", first: int, second: int) -> None:
    """Kin of both of two creased rows are kin of the one only that they face as, at the crease:
    they were taken for kin of the other before the edge was known."""
    crease = atlas.creases.between(first, second)
    both = sorted(atlas.neighbours[first] & atlas.neighbours[second])
    if crease is None or not both:
        return
    rows = np.array([[first, second, i] for i in both])
    normals = patches_at(atlas.table, rows, np.tile(crease.anchor, (len(rows), 1))).normals
    alike = np.einsum("mki,mi->mk", normals[:, :2], normals[:, 2])
    for i, other in zip(both, np.where(alike[:, 0] > alike[:, 1], second, first), strict=True):
        atlas.neighbours[i].discard(int(other))
        atlas.neighbours[int(other)].discard(i)
        atlas.cells.separate_sheets(i, int(other))
