"""Insertion: a fitted patch takes its place among its kin, and all of them learn its samples."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edit.merge import remove_hidden
from touchatlas.atlas.edit.refresh import separate_sheets, smooth_neighbours, update_creases
from touchatlas.atlas.edit.repeated_contours import learned_before
from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.graph.find_creases import find_creases
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch, TouchStatus
from touchatlas.patch.fit.fit_patch import PatchFit, fit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.section import contour_normals

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas


# A contour that stays this near to the contact, in deviations of its noise, has no direction:
# that of five samples would be off by 9 degrees.
_POINT = 10.0
# A core ends this share of the way to where it would take an earlier centre.
_CLEAR = 0.99
LEAST_CONTOURS = 3


def learn(atlas: "Atlas", touch: Touch) -> AtlasChange:
    """Learn one touch, or refuse it in words."""
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe brings back")
    if touch.status is not TouchStatus.TOUCHED:
        return AtlasChange(refused=f"the probe reported: {touch.status.value}")
    contours = tuple(c for c in touch.contours if len(c.points) >= LEAST_POINTS)
    if len(contours) < LEAST_CONTOURS:
        return AtlasChange(
            refused=f"contours of {LEAST_POINTS} points or more: {len(contours)}; a patch needs "
            f"{LEAST_CONTOURS}: track more planes, or sample more finely"
        )
    if learned_before(atlas, touch.contact, contours):
        return AtlasChange(
            refused=f"a contour of touch {touch.number} was learned before, point for point; give "
            "each once: twice it would pass for more than it tells"
        )
    try:
        fit = fit_touch(atlas, touch, contours)
    except UnfitError as error:
        return AtlasChange(refused=str(error))
    return insert(atlas, fit, contours)


def fit_touch(atlas: "Atlas", touch: Touch, contours) -> PatchFit:
    """The patch of one touch alone, from those of its contours that are long enough.

    Raises
    ------
    UnfitError
        Where they make none.
    """
    options, tolerance = atlas.options, atlas.tolerance
    return fit_patch(
        touch.contact,
        tuple(c for c in contours if _has_direction(c, touch.contact)),
        touch.approach,
        bias=options.bias * tolerance,
        detail=options.detail * tolerance,
        radius_floor=options.least_radius * tolerance,
        radius_limit=_radius_limit(atlas, touch),
        prior=atlas.prior,
        options=options.fit,
    )


def _has_direction(contour: Contour, contact) -> bool:
    """Whether a contour leads away from the contact by more than its noise: in the very corner of
    a face it may not."""
    offset = contour.points - contact
    return bool((offset * offset).sum(axis=1).max() > (_POINT * contour.noise_std) ** 2)


def _radius_limit(atlas: "Atlas", touch: Touch) -> float:
    """Largest radius whose core takes no earlier centre out of its own cell.

    Infinite where it is beyond all contours, and so limits nothing.
    """
    table = atlas.table
    ends = np.concatenate([c.points for c in touch.contours]) - touch.contact
    reach = max(atlas.options.least_radius * atlas.tolerance, np.sqrt((ends**2).sum(1).max()))
    rows = table.index.rows_near(touch.contact, table.core * float(reach) / _CLEAR)
    rows = rows[table.axes[rows, 2] @ touch.approach > 0]
    offset = table.site[rows] - touch.contact
    square = (offset * offset).sum(axis=1) + table.weight[rows]
    return float(_CLEAR * np.sqrt(square.min()) / table.core) if len(rows) else np.inf


def insert(atlas: "Atlas", fit: PatchFit, contours) -> AtlasChange:
    """Enter a fitted patch with the samples of its contours.

    One whose centre lies in the cell of another adds its samples alone.
    """
    table, membership = atlas.table, atlas.membership
    row = table.append(fit)
    table.measurement_std[row] = np.sqrt(np.mean([contour.noise_std**2 for contour in contours]))
    index = _enter_samples(atlas, row, contours)
    creases = _new_creases(atlas, row, index)
    neighbours = smooth_neighbours(atlas, row, set(creases))
    if len(neighbours):
        membership.learn(neighbours, index)
    owner = _owner(atlas, row, neighbours)
    if owner != row:
        table.drop_last()
        membership.owned[owner] = np.concatenate([membership.owned[owner], index])
        atlas.frontier.cover(table, owner, atlas.creases.of(owner))
        atlas.edge_ends.extend(table, owner, contours)
        frame = fit.patch.frame
        atlas.frontier.visit(frame.origin, frame.normal, 0.5 * fit.patch.radius)
        _link(atlas, owner, neighbours)
        too_large = atlas.learned(neighbours)
        update_creases(atlas, neighbours.tolist())
        return _tidy(atlas, too_large, AtlasChange(changed=tuple(neighbours.tolist())))
    _join(atlas, row, neighbours, index)
    for other, crease in creases.items():
        atlas.creases.enter(row, other, crease)
    too_large = atlas.learned(np.append(neighbours, row))
    table.renew_rings([row])
    _close_frontier(atlas, row, neighbours, index)
    update_creases(atlas, [row, *neighbours.tolist()])
    atlas.edge_ends.extend(table, row, contours)
    atlas.edge_ends.drop_passed(table)
    atlas.cells.meet(row, neighbours)
    for other in creases:
        separate_sheets(atlas, row, other)
    return _tidy(atlas, too_large, AtlasChange(added=(row,), changed=tuple(neighbours.tolist())))


def _tidy(atlas: "Atlas", rows: tuple[int, ...], change: AtlasChange) -> AtlasChange:
    """Remove whom the change left without a cell; split the rows, where their samples allow it."""
    hidden = remove_hidden(atlas, {*change.added, *change.changed})
    # One that was split may have hidden the next.
    splits = [atlas.split(i) for i in rows if atlas.table.alive[i]]
    gone = tuple(i for one in splits for i in one.removed) + tuple(hidden)
    added = (*change.added, *(i for one in splits for i in one.added))
    return replace(
        change,
        added=tuple(i for i in added if i not in gone),
        changed=tuple(i for i in change.changed if i not in gone),
        split=tuple(i for one in splits for i in one.split),
        removed=gone,
    )


def _enter_samples(atlas: "Atlas", row: int, contours) -> np.ndarray:
    """Samples of the contours into the pool, with the best normals there are for them."""
    table = atlas.table
    frame_normal = table.axes[row, 2]
    points = np.concatenate([c.points_in_plane for c in contours])
    normals = np.concatenate([contour_normals(c, frame_normal) for c in contours])
    across = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c in contours])
    # Within the patch its polynomial knows the normals better than single contours do.
    scaled = table.scaled_local(np.array([row]), points)
    upward = table.surface(np.array([row]), scaled)[1][0]
    upward = upward / np.sqrt((upward**2).sum(axis=1))[:, None] @ table.axes[row]
    inside = (scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0
    edges = np.concatenate([_at_edge(c) for c in contours])
    normals = np.where(inside[:, None], upward, normals)
    return atlas.membership.pool.add(points, normals, across, edges)


def _at_edge(contour: Contour) -> np.ndarray:
    """(n,) whether points of a contour are its last before an edge."""
    out = np.zeros(len(contour.points), bool)
    out[0], out[-1] = (end is ContourEnd.EDGE for end in contour.ends)
    return out


def _new_creases(atlas: "Atlas", row: int, index) -> dict[int, Crease]:
    """The rows that a new one, which learned nothing yet but its own samples, is creased with."""
    table = atlas.table
    if not atlas.membership.pool.edges[index].any():
        return {}
    near = table.index.rows_near(table.origin[row], table.radius[row])
    pairs = [(i, row) for i in near.tolist() if i != row]
    found = find_creases(table, atlas.membership, pairs, atlas.bias, index)
    return {i: crease for (i, _), crease in found.items()}


def _owner(atlas: "Atlas", row: int, neighbours: np.ndarray) -> int:
    """The patch in whose cell the centre of ``row`` lies: itself, unless it is hidden."""
    if not len(neighbours):
        return row
    power = power_at(atlas.table, neighbours, atlas.table.site[row])
    return row if -atlas.table.weight[row] < power.min() else int(neighbours[power.argmin()])


def _link(atlas: "Atlas", owner: int, neighbours: np.ndarray) -> None:
    """One touch was of the sheet of all these: so they are kin to its owner, and what its
    core covers of them, and theirs of it, is closed."""
    table = atlas.table
    others = neighbours[neighbours != owner]
    offset = table.origin[others] - table.origin[owner]
    reach = table.radius[others] + table.radius[owner]
    near = others[(offset * offset).sum(axis=1) < reach**2].tolist()
    for i in set(near) - atlas.creases.of(owner):
        atlas.neighbours[owner].add(i)
        atlas.neighbours[i].add(owner)
    table.outline_open[others] *= power_at(table, [owner], table.outline[others])[..., 0] > 0
    power = power_at(table, sorted(atlas.neighbours[owner]), table.outline[owner])
    table.outline_open[owner] *= power.min(axis=1, initial=np.inf) > 0
    atlas.cells.conquer(owner, others)
    # Its new kin may have less power than it at corners of its own.
    atlas.cells.renew({owner})


def _join(atlas: "Atlas", row: int, neighbours: np.ndarray, index) -> None:
    """Enter ``row`` among its kin, and learn from their samples."""
    members = neighbours.tolist()
    atlas.enter(row, members)
    atlas.membership.owned[row] = index
    atlas.membership.learn(np.array([row]), atlas.membership.owned_by([row, *members]))
    atlas.table.learned[row] = atlas.table.count[row]


def _close_frontier(atlas: "Atlas", row: int, neighbours: np.ndarray, index) -> None:
    table, pool, frontier = atlas.table, atlas.membership.pool, atlas.frontier
    frontier.cover(table, row, atlas.creases.of(row))
    # On an edge itself no patch should have its centre: half of what it claims would be beyond.
    inner = index[~pool.edges[index]]
    frontier.extend(table, row, neighbours, pool.points[inner], pool.normals[inner])
    if len(neighbours):
        table.outline_open[neighbours] *= (
            power_at(table, [row], table.outline[neighbours])[..., 0] > 0
        )
        table.outline_open[row] *= power_at(table, neighbours, table.outline[row]).min(axis=1) > 0
