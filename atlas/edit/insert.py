"""Insert: a patch is fitted to a touch and entered among its sheet neighbours.

The neighbours learn the samples of the touch, and the new patch learns theirs.
"""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.edit.enter_samples import enter_samples
from touchatlas.atlas.edit.fit_scale import settle_scale
from touchatlas.atlas.edit.fit_touch import LEAST_CONTOURS, few_contours, fit_or_reason
from touchatlas.atlas.edit.innovations import innovations
from touchatlas.atlas.edit.plausible_touch import check_unit_of_length
from touchatlas.atlas.edit.renew import learn_along, remove_filled, renewed
from touchatlas.atlas.edit.repeated_contours import learned_before
from touchatlas.atlas.edit.replace import in_ball, remove_hidden, root_mean_square
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch, TouchStatus
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit

# Radius about a touch that gave no patch within which samples need no touch, in patch radii.
# Doubled, places that another patch could cover are given up.
_VISITED = 0.5


def learn(state: AtlasState, touch: Touch) -> AtlasChange:
    """Learn one touch, and renew the patches between touches about it; or say why it is refused."""
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe returns it")
    if touch.status is not TouchStatus.TOUCHED:
        return AtlasChange(refused=f"the probe reported: {touch.status.value}")
    contours = tuple(c for c in touch.contours if len(c.points) >= LEAST_POINTS)
    if len(contours) < (1 if state.fills else LEAST_CONTOURS):
        return AtlasChange(refused=few_contours(len(contours)))
    check_unit_of_length(state, touch, contours)
    if learned_before(state, touch.contact, contours):
        return AtlasChange(
            refused=f"a contour of touch {touch.number} was learned before, point for point; give "
            "each once, because a repeated contour holds no new measurement"
        )
    settle_scale(state, [contour.noise_std for contour in contours])
    fit, reason = fit_or_reason(state, touch, contours)
    owner = _owner_at(state, touch) if fit is None and state.fills else None
    change = AtlasChange(refused=reason)
    if fit is None and owner is None:
        return change
    if fit is not None and not state.fills:
        return insert(state, fit, contours)
    before = set(state.table.rows.tolist())
    points = np.concatenate([contour.points for contour in contours])
    news = innovations(state, points)
    around, samples = remove_filled(state, points, owner)
    first = len(state.membership.pool)
    if owner is not None:
        change = add_contours(state, owner, contours)
    elif fit is not None:
        change = insert(state, fit, contours)
    index = np.arange(first, len(state.membership.pool), dtype=np.int32)
    changed = around.union(change.added, change.changed)
    changed |= learn_along(state, index, {*change.added, *change.changed})
    change = renewed(state, before, changed, np.union1d(samples, index), change)
    return replace(change, innovations=news)


def _owner_at(state: AtlasState, touch: Touch) -> int | None:
    """The patch in whose cell a contact lies, if it faces the approach; None elsewhere."""
    found = blend_of_patches(state, touch.contact[None])
    faces = found.known[0] and found.normal[0] @ touch.approach > 0.0
    return int(found.patch[0]) if faces else None


def insert(state: AtlasState, fit: PatchFit, contours) -> AtlasChange:
    """Enter a fitted patch with the samples of its contours.

    Where the origin of the patch lies in the cell of another patch, only the samples are entered.
    """
    trial, row = state.table.with_candidate(fit)
    trial.measurement_std[row] = root_mean_square([contour.noise_std for contour in contours])
    index = enter_samples(state, trial, row, contours)
    neighbours = sheet_neighbours(trial, row)
    owner = _owner(trial, row, neighbours)
    if len(neighbours):
        state.membership.learn(neighbours, index)
    if owner == row:
        _enter_patch(state, fit, contours, index, neighbours)
        change = AtlasChange(added=(row,), changed=tuple(neighbours.tolist()))
    else:
        _give_to_owner(state, owner, fit, contours, index, neighbours)
        change = AtlasChange(changed=tuple(neighbours.tolist()))
    return _without_hidden(state, change)


def _enter_patch(state: AtlasState, fit: PatchFit, contours, index, neighbours) -> None:
    """Make a fitted patch a node with its samples ``index``."""
    table, membership = state.table, state.membership
    row, beside = table.append(fit), neighbours.tolist()
    table.measurement_std[row] = root_mean_square([contour.noise_std for contour in contours])
    state.enter(row, beside)
    membership.owned[row] = index
    membership.learn(np.array([row]), membership.owned_by([row, *beside]))
    table.learned[row] = table.count[row]
    state.learned(np.append(neighbours, row))
    state.edge_ends.extend(table, row, contours)
    state.edge_ends.drop_passed(table)


def add_contours(state: AtlasState, owner: int, contours) -> AtlasChange:
    """Enter the samples of contours that give no patch of their own: ``owner`` owns them, and its
    sheet neighbours learn them too."""
    index = enter_samples(state, state.table, owner, contours)
    neighbours = np.array(sorted(state.neighbours.around([owner])), int)
    state.membership.learn(neighbours, index)
    state.membership.owned[owner] = np.concatenate([state.membership.owned[owner], index])
    state.edge_ends.extend(state.table, owner, contours)
    state.learned(neighbours)
    state.mark_stale([owner])
    return _without_hidden(state, AtlasChange(changed=tuple(neighbours.tolist())))


def _give_to_owner(
    state: AtlasState, owner: int, fit: PatchFit, contours, index, neighbours
) -> None:
    """Give the samples ``index`` of a touch to the patch in whose cell its origin lies."""
    membership, pool = state.membership, state.membership.pool
    membership.owned[owner] = np.concatenate([membership.owned[owner], index])
    state.edge_ends.extend(state.table, owner, contours)
    pool.visited[index] = True
    frame, samples = fit.patch.frame, state.frontier.samples
    visited = in_ball(pool.points[samples], frame.origin, _VISITED * fit.patch.radius)
    visited &= pool.normals[samples] @ frame.normal >= SHEET_COSINE
    pool.visited[samples[visited]] = True
    _link(state, owner, neighbours)
    state.learned(neighbours)


def _without_hidden(state: AtlasState, change: AtlasChange) -> AtlasChange:
    """Remove the patches that a change left without a cell; returns the change with them."""
    gone = remove_hidden(state, {*change.added, *change.changed})
    return replace(
        change,
        added=tuple(i for i in change.added if i not in gone),
        changed=tuple(i for i in change.changed if i not in gone),
        removed=tuple(gone),
    )


def _owner(table: PatchTable, row: int, neighbours: np.ndarray) -> int:
    """The patch in whose cell the site of ``row`` lies: the row itself, unless it is hidden."""
    if not len(neighbours):
        return row
    power = power_at(table, neighbours, table.site[row])
    return row if -table.weight[row] < power.min() else int(neighbours[power.argmin()])


def _link(state: AtlasState, owner: int, neighbours: np.ndarray) -> None:
    """Link a hidden touch's owner to every patch that accepted its samples, where the two overlap:
    all of them are of the touch's sheet."""
    table = state.table
    others = neighbours[neighbours != owner]
    reach = table.radius[others] + table.radius[owner]
    near = others[in_ball(table.origin[others], table.origin[owner], reach)].tolist()
    for i in near:
        state.neighbours.join(owner, i)
    state.mark_stale([owner])
