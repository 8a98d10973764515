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
from touchatlas.atlas.patches.normal_equations import of_patch
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
# Rounds in which gaps are filled: a patch in one gap may leave smaller ones beside it. Doubled,
# gaps that no patch fits are tried more often.
_GAP_ROUNDS = 2


def fill(state: AtlasState, samples=None) -> AtlasChange:
    """Fit a patch about each sample that no core covers, those with the most samples near first,
    and then about each gap between three cells.

    A patch is fitted to all samples near it. Where these are of one contour they hardly tell how
    the surface bends across it, and the patch predicts a large deviation.

    Parameters
    ----------
    state : AtlasState
    samples : (n,) int, optional
        Only these samples, and the gaps of patches that are fitted to any of them, are filled; all
        without.
    """
    before, changed = set(state.table.rows.tolist()), set[int]()
    _fill_samples(state, samples, changed)
    for _ in range(_GAP_ROUNDS):
        if not _fill_gaps(state, samples, changed):
            break
    after = set(state.table.rows.tolist())
    return AtlasChange(
        added=tuple(sorted(after - before)),
        changed=tuple(sorted(changed & after & before)),
        removed=tuple(sorted(before - after)),
    )


def _fill_samples(state: AtlasState, samples, changed: set[int]) -> None:
    """Fit a patch about each sample that no core covers; rows that the new ones meet are added to
    ``changed``."""
    frontier, pool = state.frontier, state.membership.pool
    candidates = frontier.candidates()
    if samples is not None:
        candidates = np.intersect1d(candidates, samples)
    left = candidates[frontier.is_open(candidates)]
    left = left[np.argsort(-_counts_about(state, left), kind="stable")]
    while len(left):
        k, left = int(left[0]), left[1:]
        if _fill_at(state, int(frontier.owners(k)), pool.points[k], pool.normals[k], changed):
            left = left[frontier.is_open(left)]


def _fill_gaps(state: AtlasState, samples, changed: set[int]) -> int:
    """Fit a patch about each gap between three cells; returns how many were entered."""
    table, entered = state.table, 0
    for triple, point in sorted(state.gaps.items()):
        if not table.alive[list(triple)].all():
            continue
        if samples is not None and not _any_fitted(state, triple, samples):
            continue
        owner = triple[2]
        upward = table.surface([owner], table.scaled_local([owner], point[None]))[1]
        normal = upward[0, 0] @ table.axes[owner]
        entered += _fill_at(state, owner, point, normal / np.sqrt(normal @ normal), changed)
    return entered


def _any_fitted(state: AtlasState, rows, samples) -> bool:
    """Whether any of the rows is fitted to any of the samples (n,)."""
    fitted = state.membership.fitted
    return any(np.isin(fitted[row], samples).any() for row in rows)


def _fill_at(state: AtlasState, owner: int, point, normal, changed: set[int]) -> bool:
    """Fit and enter a patch about a point beside the patch ``owner``; whether one was entered."""
    edges, fitted = state.membership.pool.edges, state.membership.fitted[owner]
    if state.creases.of(owner) or edges[fitted].any():
        # A face with an edge ends where its own touches show it, so it is not extended.
        return False
    fit = _fit(state, owner, point, normal)
    return fit is not None and _enter(state, fit, _samples_of(state, fit.patch), changed)


def _counts_about(state: AtlasState, samples) -> np.ndarray:
    """(n,) number of samples that a patch about each of some samples (n,) would be fitted to."""
    pool, radius = state.membership.pool, state.table.radius[state.frontier.owners(samples)]
    return np.array(
        [
            len(_samples_about(state, pool.points[k], pool.normals[k], float(r)))
            for k, r in zip(samples.tolist(), radius.tolist(), strict=True)
        ],
        int,
    )


def _samples_about(state: AtlasState, point, normal, radius: float) -> np.ndarray:
    """Ascending indices of the samples that a patch at a point may be fitted to, whoever owns
    them."""
    return state.membership.near(point, normal, CANDIDATE_REACH * radius)


def _samples_of(state: AtlasState, patch: Patch) -> np.ndarray:
    """Ascending indices of the samples that a fitted patch may learn from."""
    return _samples_about(state, patch.frame.origin, patch.frame.normal, patch.radius)


def _fit(state: AtlasState, owner: int, point, normal) -> PatchFit | None:
    """A patch about a point, of the largest of the radii with which it fits the samples near;
    None where it fits with none of them."""
    table, pool = state.table, state.membership.pool
    index = _samples_about(state, point, normal, float(table.radius[owner]))
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


def _enter(state: AtlasState, fit: PatchFit, index, changed: set[int]) -> bool:
    """Enter a patch among its neighbours, if it has any and their cells do not hold its site; these
    are added to ``changed``."""
    trial, candidate = state.table.with_candidate(fit)
    neighbours = smooth_neighbours(state, trial, candidate)
    least = power_at(trial, neighbours, trial.site[candidate]).min(initial=np.inf)
    if not -trial.weight[candidate] < least < np.inf:
        return False
    std = root_mean_square(state.table.measurement_std[neighbours])
    row = enter_fit(state, fit, neighbours, index, std)
    update_creases(state, [row])
    changed.update(neighbours.tolist())
    remove_hidden(state, {row, *neighbours.tolist()})
    return True


def _is_of_sheet(state: AtlasState, fit: PatchFit, index) -> bool:
    """Whether most of the samples ``index`` (n,) in the ball of a patch are of its sheet."""
    pool = state.membership.pool
    within = index[in_ball(pool.points[index], fit.patch.frame.origin, fit.patch.radius)]
    trial, row = state.table.with_candidate(fit)
    mine = of_patch(trial, np.array([row]), pool.points[within], pool.normals[within])
    return bool(mine.sum() >= max(1.0, _LEAST_ON_SHEET * len(within)))
