"""Splitting: seven smaller patches in the place of one that does not hold its samples."""

import numpy as np

from touchatlas.atlas.edit.refresh import inherit_creases, smooth_neighbours, update_creases
from touchatlas.atlas.edit.replace import DISC, enter_fit, points_over, remove_hidden
from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import of_patch
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.polynomial import scaled_height

# Seven discs of half its radius cover a disc: one in the middle, six about it this far out.
# Kershner, The number of circles covering a set, 1939. The slack is a factor for curved discs.
_HALF, _OUT, _SLACK = 0.5, np.sqrt(0.75), 1.08
# Samples for each coefficient of a smaller patch, at least: fewer, and it would follow their noise.
_LEAST_SAMPLES = 2


def split(state: AtlasState, patch_id: int) -> AtlasChange:
    """Patches of half the radius in the place of one: seven, but for those that lie beyond edges
    or have no cell; refused where the samples do not determine all of them."""
    state.check(patch_id)
    parts = parts_of(state, patch_id)
    if parts is None:
        return AtlasChange(refused=f"too few samples about patch {patch_id} for smaller ones")
    rows = _divide(state, patch_id, parts)
    return AtlasChange(rows, (), (), (patch_id,), (patch_id,))


def parts_of(state: AtlasState, row: int) -> list[PatchFit] | None:
    """Seven patches that cover the core of a row, from the samples that it knows, without those
    that lie beyond its creases; None when the samples do not determine all of them."""
    table, pool, membership = state.table, state.membership.pool, state.membership
    index = membership.fitted_by([row, *state.neighbours[row]])
    samples = pool.points[index], pool.normals[index]
    near = of_patch(table, np.array([row]), *samples, CANDIDATE_REACH)[0]
    index, radius = index[near], _SLACK * _HALF * table.radius[row]
    parts = []
    for frame in _frames(state, row):
        offset = pool.points[index] - frame.origin
        inside = index[(offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2]
        if len(inside) < _LEAST_SAMPLES * table.basis.size:
            return None
        given = (pool.points[inside], pool.across[inside], float(table.noise[row]))
        try:
            parts.append(
                refit_patch(frame, *given, radius, state.bias, None, state.prior, state.options.fit)
            )
        except UnfitError:
            return None
    return parts or None


def _frames(state: AtlasState, row: int) -> list[DarbouxFrame]:
    """Where the patches are to be, on the polynomial of a row; nowhere if it folds."""
    table = state.table
    angles = np.pi / 3.0 * np.arange(6)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    xy = table.core * _OUT * np.concatenate([np.zeros((1, 2)), ring])
    xy = xy[[_is_seen(state, row, centre) for centre in xy]]
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    if not np.isfinite(z).all():
        return []
    scaled = np.column_stack([xy, z])
    upward = table.surface(np.array([row]), scaled[None])[1][0]
    normals = upward / np.sqrt((upward * upward).sum(axis=1))[:, None] @ table.axes[row]
    origins = scaled * table.radius[row] @ table.axes[row] + table.origin[row]
    e1 = table.axes[row, 0]
    return [DarbouxFrame(p, axes_from_normal(n, e1)) for p, n in zip(origins, normals, strict=True)]


def _is_seen(state: AtlasState, row: int, centre) -> bool:
    """Whether any of the smaller disc about a place (2,), scaled, lies on this side of creases."""
    table = state.table
    points = points_over(table, row, centre + _SLACK * _HALF * table.core * DISC)
    beyond = state.surface_graph.visibility.beyond(np.full(len(points), row), points)
    return not len(points) or not beyond.all()


def _within(state: AtlasState, part: int, creases, lines) -> dict[int, Crease]:
    """Those of creases that a part reaches, by the rows behind them; ``lines`` are their curves."""
    table, found = state.table, {}
    for other, crease in creases.items():
        points = np.concatenate([lines[other], crease.anchor[None]])
        offset = points - table.origin[part]
        square = (offset * offset).sum(axis=1)
        if square.min() <= table.radius[part] ** 2:
            found[other] = Crease(crease.sign, points[square.argmin()])
    return found


def _divide(state: AtlasState, row: int, parts: list[PatchFit]) -> tuple[int, ...]:
    """Put patches in the place of a row, and distribute its samples among them; their rows."""
    table, membership = state.table, state.membership
    owned, known = membership.owned[row], membership.fitted[row]
    std, ends = float(table.measurement_std[row]), state.edge_ends
    around, creases = set(state.neighbours[row]), state.creases.of_all([row])
    lines = {other: state.surface_graph.curves.curve(row, other) for other in creases}
    state.remove([row])
    rows = []
    for fit in parts:
        trial, candidate = table.with_candidate(fit)
        neighbours = smooth_neighbours(state, trial, candidate, set())
        neighbours = np.setdiff1d(neighbours, list(creases))
        samples = np.union1d(known, membership.owned_by(neighbours.tolist()))
        rows.append(enter_fit(state, fit, neighbours, samples))
        table.measurement_std[rows[-1]] = std
    owner = np.array(rows)[power_at(table, rows, membership.pool.points[owned]).argmin(axis=1)]
    for part in rows:
        membership.owned[part] = owned[owner == part]
    ends.move_home([row], rows[0])
    state.mark_stale(rows)
    for part in rows:
        inherit_creases(state, part, _within(state, part, creases, lines))
    update_creases(state, rows)
    # A neighbour may cover more of the row than its parts do, or they more than a neighbour.
    around = around.union(rows, *(state.neighbours[i] for i in rows))
    around -= set(remove_hidden(state, around))
    return tuple(sorted(set(rows) & around))
