"""Split: up to seven smaller patches replace one whose polynomial leaves out too much."""

import numpy as np

from touchatlas.atlas.edit.replace import enter_fit, in_ball, remove_hidden
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.normal_equations import of_patch
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.polynomial import scaled_height

# Seven discs of half the radius cover a disc: one at the centre and six about it, whose centres lie
# this far out in radii (Kershner, The number of circles covering a set, 1939). The last number is a
# factor on the radius because patches are curved; with twice the excess the parts are 7 % larger.
_HALF, _OUT, _SLACK = 0.5, np.sqrt(0.75), 1.08
# Fewest samples per coefficient of a part. With fewer it would follow their noise. Doubled, patches
# of sparse contours are not split.
_LEAST_SAMPLES = 2


def split(state: AtlasState, patch_id: int) -> AtlasChange:
    """Replace one patch by up to seven of half its radius; refused where the samples do not
    determine all of them.

    Parts that have no cell are left out.
    """
    state.check(patch_id)
    parts = parts_of(state, patch_id)
    if parts is None:
        return AtlasChange(refused=f"too few samples about patch {patch_id} for smaller ones")
    rows = divide(state, patch_id, parts)
    return AtlasChange(added=rows, split=(patch_id,), removed=(patch_id,))


def parts_of(state: AtlasState, row: int) -> list[PatchFit] | None:
    """Seven patches that cover the core of a row; None when the samples of the row and its
    neighbours do not determine all of them."""
    table, pool, membership = state.table, state.membership.pool, state.membership
    index = membership.fitted_by([row, *state.neighbours[row]])
    samples = pool.points[index], pool.normals[index]
    near = of_patch(table, np.array([row]), *samples, CANDIDATE_REACH)[0]
    index, radius = index[near], _SLACK * _HALF * table.radius[row]
    parts, frames = [], _frames(state, row)
    near_parts = [
        index[in_ball(pool.points[index], frame.origin, CANDIDATE_REACH * radius)]
        for frame in frames
    ]
    if any(len(inside) < _LEAST_SAMPLES * table.basis.size for inside in near_parts):
        return None
    for frame, inside in zip(frames, near_parts, strict=True):
        given = (pool.points[inside], pool.across[inside], float(table.noise[row]))
        try:
            fit = refit_patch(
                frame, *given, radius, state.bias, None, state.prior, state.options.fit
            )
        except UnfitError:
            return None
        trial, candidate = table.with_candidate(fit)
        if not of_patch(trial, np.array([candidate]), *samples).any():
            return None
        parts.append(fit)
    return parts or None


def _frames(state: AtlasState, row: int) -> list[DarbouxFrame]:
    """Frames of the parts, on the polynomial of a row; none where it has no height at one of
    them."""
    table = state.table
    angles = np.pi / 3.0 * np.arange(6)
    hexagon = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    xy = table.core * _OUT * np.concatenate([np.zeros((1, 2)), hexagon])
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    if not np.isfinite(z).all():
        return []
    scaled = np.column_stack([xy, z])
    upward = table.surface(np.array([row]), scaled[None])[1][0]
    normals = upward / np.sqrt((upward * upward).sum(axis=1))[:, None] @ table.axes[row]
    origins = scaled * table.radius[row] @ table.axes[row] + table.origin[row]
    e1 = table.axes[row, 0]
    return [DarbouxFrame(p, axes_from_normal(n, e1)) for p, n in zip(origins, normals, strict=True)]


def divide(state: AtlasState, row: int, parts: list[PatchFit]) -> tuple[int, ...]:
    """Replace a row by its parts and distribute its samples among them; returns their rows."""
    table, membership = state.table, state.membership
    owned, known = membership.owned[row], membership.fitted[row]
    std, ends = float(table.measurement_std[row]), state.edge_ends
    around = set(state.neighbours[row])
    state.remove([row])
    rows = []
    for fit in parts:
        trial, candidate = table.with_candidate(fit)
        neighbours = sheet_neighbours(trial, candidate)
        samples = np.union1d(known, membership.owned_by(neighbours.tolist()))
        rows.append(enter_fit(state, fit, neighbours, samples, std))
    owner = np.array(rows)[power_at(table, rows, membership.pool.points[owned]).argmin(axis=1)]
    for part in rows:
        membership.owned[part] = owned[owner == part]
    ends.move_home([row], rows[0])
    state.mark_stale(rows)
    # Parts may hide their neighbours, and neighbours may hide parts.
    around = around.union(rows, *(state.neighbours[i] for i in rows))
    around -= set(remove_hidden(state, around))
    return tuple(sorted(set(rows) & around))
