"""Folding: creases of patches that changed, and what of their outlines lies beyond them."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.boundary import CREASE_ANGLE, power_at
from touchatlas.atlas.crease_search import find_creases
from touchatlas.atlas.kin import kin_of
from touchatlas.atlas.meeting import look

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas


def fold(atlas: "Atlas", rows) -> None:
    """Find the creases of rows that came or changed; their outlines beyond are not open."""
    table, creases, pairs = atlas.table, atlas.creases, set[tuple[int, int]]()
    creases.renew(rows)
    members, edges = atlas.learning.members, atlas.learning.pool.edges
    for i in rows:
        if not edges[members[i]].any():
            continue
        near = set(table.index.rows_near(table.origin[i], table.radius[i]).tolist())
        near -= atlas.kin[i] | creases.of(i) | {i}
        pairs.update((min(i, j), max(i, j)) for j in near)
    for pair, crease in find_creases(table, atlas.learning, sorted(pairs), atlas.bias).items():
        creases.enter(*pair, crease)
        part(atlas, *pair)
    if len(creases):
        around = set(rows).union(*(creases.of(i) for i in rows))
        trim(atlas, around.union(*(atlas.kin[i] for i in around)))


def trim(atlas: "Atlas", rows) -> None:
    """Close the outlines of rows where they lie beyond a crease."""
    table, open_ring = atlas.table, atlas.table.ring_open
    rows = np.array(sorted(rows), int)
    which, places = np.nonzero(open_ring[rows])
    which = rows[which]
    beyond = atlas.creases.beyond(which, table.ring[which, places])
    open_ring[which[beyond], places[beyond]] = 0.0


def reopen(atlas: "Atlas", rows) -> None:
    """Which parts of the rows' outlines no kin covers, anew."""
    table = atlas.table
    table.renew_rings(rows)
    for row in rows:
        power = power_at(table, sorted(atlas.kin[row]), table.ring[row])
        table.ring_open[row] = power.min(axis=1, initial=np.inf) > 0
    trim(atlas, rows)


def kin_beside(atlas: "Atlas", row: int, partners: set[int]) -> np.ndarray:
    """The kin of a row that is creased with others: none of these, and none of a sheet behind an
    edge of its own sheet, from which it turns away as much."""
    kin = kin_of(atlas.table, row)
    if not (partners or len(atlas.creases)):
        return kin
    alike = np.setdiff1d(kin_of(atlas.table, row, np.cos(CREASE_ANGLE)), list(partners))
    edge = partners.union(*(atlas.creases.of(i) for i in alike.tolist()))
    behind = edge.union(*(atlas.kin[i] for i in edge))
    across = partners | (behind - set(alike.tolist()))
    return np.setdiff1d(kin, list(across))


def inherit(atlas: "Atlas", row: int, pairs) -> None:
    """Crease a merged row with those that the creases ``pairs``, a dict of row to Crease, of the
    rows in its place were with."""
    for other, crease in pairs.items():
        if atlas.table.alive[other] and other not in atlas.kin[row]:
            atlas.creases.enter(row, other, crease)
    atlas.creases.renew([row])


def part(atlas: "Atlas", first: int, second: int) -> None:
    """Kin of both of two creased rows are kin of the one only that they face as, at the crease:
    they were taken for kin of the other before the edge was known."""
    crease = atlas.creases.between(first, second)
    both = sorted(atlas.kin[first] & atlas.kin[second])
    if crease is None or not both:
        return
    rows = np.array([[first, second, i] for i in both])
    normals = look(atlas.table, rows, np.tile(crease.anchor, (len(rows), 1))).normals
    alike = np.einsum("mki,mi->mk", normals[:, :2], normals[:, 2])
    for i, other in zip(both, np.where(alike[:, 0] > alike[:, 1], second, first), strict=True):
        atlas.kin[i].discard(int(other))
        atlas.kin[int(other)].discard(i)
        atlas.tiling.part(i, int(other))
