"""Filling: patches where samples lie between patches, though no touch had its place there."""

import numpy as np

from touchatlas.atlas.edit.refresh import smooth_neighbours, update_creases
from touchatlas.atlas.edit.replace import enter_fit, is_upright, remove_hidden
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, of_patch
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.patch import Patch

# Radii that are tried one after the other, as fractions of that of the patch beside: a patch that
# would turn too far, or hold too little of its samples, is tried smaller. Below a half its samples
# would be of one contour.
_FRACTIONS = 1.0, 0.7, 0.5
# Fraction of the samples within a patch that are to be of its sheet: else most are of another.
_HELD = 0.5


def fill(state: AtlasState) -> AtlasChange:
    """Patches about the samples that no core covers, those with most others near first, each of
    all samples there.

    How sure they are, their deviation says: along one contour alone they hardly know how the
    surface bends across it.
    """
    frontier, table, pool = state.frontier, state.table, state.membership.pool
    before, samples = set(table.rows.tolist()), frontier.samples.tolist()
    around = {
        k: _around(state, pool.points[k], pool.normals[k], float(table.radius[i]))
        for k, i in zip(samples, frontier.owners(samples).tolist(), strict=True)
    }
    for k in sorted(samples, key=lambda k: -len(around[k])):
        if k not in frontier.samples:
            continue
        beside = int(frontier.owners(k))
        if state.creases.of(beside):
            # How far a face goes on its touches say.
            continue
        fit = _fit(state, beside, pool.points[k], pool.normals[k], around[k])
        if fit is not None:
            _enter(state, fit, _about(state, fit.patch))
    after = set(table.rows.tolist())
    return AtlasChange(added=tuple(sorted(after - before)), removed=tuple(sorted(before - after)))


def _around(state: AtlasState, point, normal, radius: float) -> np.ndarray:
    """Indices of the samples, ascending, that a patch about a point may learn from: touches from
    beyond its neighbours may have brought them."""
    pool = state.membership.pool
    offset = pool.points - point
    near = np.flatnonzero((offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2)
    return near[pool.normals[near] @ normal >= SHEET_COSINE]


def _about(state: AtlasState, patch: Patch) -> np.ndarray:
    """Indices of the samples, ascending, that a patch may learn from where it came to lie."""
    return _around(state, patch.frame.origin, patch.frame.normal, patch.radius)


def _fit(state: AtlasState, beside: int, point, normal, index) -> PatchFit | None:
    """A patch about a point that holds the samples there, as large as the one beside it if it need
    not turn too far for that."""
    table, pool = state.table, state.membership.pool
    frame = DarbouxFrame(point, axes_from_normal(normal, table.axes[beside, 0]))
    for fraction in _FRACTIONS:
        radius = fraction * float(table.radius[beside])
        try:
            fit = refit_patch(
                frame,
                pool.points[index],
                pool.across[index],
                float(table.noise[beside]),
                radius,
                state.bias,
                radius,
                state.prior,
                state.options.fit,
            )
        except UnfitError:
            continue
        held = (_holds(state, fit, some) for some in (index, _about(state, fit.patch)))
        if is_upright(fit.patch) and all(held):
            return fit
    return None


def _enter(state: AtlasState, fit: PatchFit, index) -> None:
    """Enter a patch among its neighbours, if it has any and is not hidden by them."""
    trial, candidate = state.table.with_candidate(fit)
    neighbours = smooth_neighbours(state, trial, candidate, set())
    least = power_at(trial, neighbours, trial.site[candidate]).min(initial=np.inf)
    if not -trial.weight[candidate] < least < np.inf:
        return
    row = enter_fit(state, fit, neighbours, index)
    std = np.sqrt((state.table.measurement_std[neighbours] ** 2).mean())
    state.table.measurement_std[row] = std
    update_creases(state, [row])
    remove_hidden(state, {row, *neighbours.tolist()})


def _holds(state: AtlasState, fit: PatchFit, index) -> bool:
    """Whether samples ``index`` (n,) within a patch are mostly of its sheet."""
    pool = state.membership.pool
    offset = pool.points[index] - fit.patch.frame.origin
    within = index[(offset * offset).sum(axis=1) <= fit.patch.radius**2]
    trial, row = state.table.with_candidate(fit)
    mine = of_patch(trial, np.array([row]), pool.points[within], pool.normals[within])
    return bool(mine.sum() >= max(1.0, _HELD * len(within)))
