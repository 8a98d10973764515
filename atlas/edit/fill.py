"""Fill: fit patches to the samples that no core covers."""

import numpy as np

from touchatlas.atlas.edit.refresh import smooth_neighbours, update_creases
from touchatlas.atlas.edit.replace import (
    enter_fit,
    in_ball,
    is_upright,
    remove_hidden,
    root_mean_square,
)
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

# Radii that are tried in turn, as fractions of the owner's radius. The next one is tried where a
# patch would be steep, or where most samples in it are of another sheet. The samples of a patch
# of less than half the radius would be of one contour. Doubled, the patches would be larger than
# the owner, whose samples they are fitted to.
_FRACTIONS = 1.0, 0.7, 0.5
# Least fraction of the samples in the ball of a patch that are of its sheet: the majority.
# Doubled, a single sample of another sheet would refuse a patch.
_LEAST_ON_SHEET = 0.5


def fill(state: AtlasState) -> AtlasChange:
    """Fit a patch about each sample that no core covers, those with the most samples near first.

    A patch is fitted to all samples near it. Where these are of one contour they hardly tell how
    the surface bends across it, and the patch predicts a large deviation.
    """
    frontier, table, pool = state.frontier, state.table, state.membership.pool
    before, samples = set(table.rows.tolist()), frontier.samples.tolist()
    around = {
        k: _samples_about(state, pool.points[k], pool.normals[k], float(table.radius[i]))
        for k, i in zip(samples, frontier.owners(samples).tolist(), strict=True)
    }
    for k in sorted(samples, key=lambda k: -len(around[k])):
        if k not in frontier.samples:
            continue
        owner = int(frontier.owners(k))
        if state.creases.of(owner):
            # A face with an edge ends where its own touches show it, so it is not extended.
            continue
        fit = _fit(state, owner, pool.points[k], pool.normals[k], around[k])
        if fit is not None:
            _enter(state, fit, _samples_of(state, fit.patch))
    after = set(table.rows.tolist())
    return AtlasChange(added=tuple(sorted(after - before)), removed=tuple(sorted(before - after)))


def _samples_about(state: AtlasState, point, normal, radius: float) -> np.ndarray:
    """Ascending indices of the samples that a patch at a point may be fitted to, whoever owns
    them."""
    pool = state.membership.pool
    near = np.flatnonzero(in_ball(pool.points, point, CANDIDATE_REACH * radius))
    return near[pool.normals[near] @ normal >= SHEET_COSINE]


def _samples_of(state: AtlasState, patch: Patch) -> np.ndarray:
    """Ascending indices of the samples that a fitted patch may learn from."""
    return _samples_about(state, patch.frame.origin, patch.frame.normal, patch.radius)


def _fit(state: AtlasState, owner: int, point, normal, index) -> PatchFit | None:
    """A patch about a point, of the largest of the radii with which it fits the samples ``index``;
    None where it fits with none of them."""
    table, pool = state.table, state.membership.pool
    frame = DarbouxFrame(point, axes_from_normal(normal, table.axes[owner, 0]))
    for fraction in _FRACTIONS:
        radius = fraction * float(table.radius[owner])
        try:
            fit = refit_patch(
                frame,
                pool.points[index],
                pool.across[index],
                float(table.noise[owner]),
                radius,
                state.bias,
                radius,
                state.prior,
                state.options.fit,
            )
        except UnfitError:
            continue
        near = (_is_of_sheet(state, fit, some) for some in (index, _samples_of(state, fit.patch)))
        if is_upright(fit.patch) and all(near):
            return fit
    return None


def _enter(state: AtlasState, fit: PatchFit, index) -> None:
    """Enter a patch among its neighbours, if it has any and their cells do not hold its site."""
    trial, candidate = state.table.with_candidate(fit)
    neighbours = smooth_neighbours(state, trial, candidate)
    least = power_at(trial, neighbours, trial.site[candidate]).min(initial=np.inf)
    if not -trial.weight[candidate] < least < np.inf:
        return
    std = root_mean_square(state.table.measurement_std[neighbours])
    row = enter_fit(state, fit, neighbours, index, std)
    update_creases(state, [row])
    remove_hidden(state, {row, *neighbours.tolist()})


def _is_of_sheet(state: AtlasState, fit: PatchFit, index) -> bool:
    """Whether most of the samples ``index`` (n,) in the ball of a patch are of its sheet."""
    pool = state.membership.pool
    within = index[in_ball(pool.points[index], fit.patch.frame.origin, fit.patch.radius)]
    trial, row = state.table.with_candidate(fit)
    mine = of_patch(trial, np.array([row]), pool.points[within], pool.normals[within])
    return bool(mine.sum() >= max(1.0, _LEAST_ON_SHEET * len(within)))
