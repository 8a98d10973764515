"""Merge: one patch replaces several, where one polynomial fits all their samples."""

import numpy as np

from touchatlas.atlas.edit.replace import (
    DISC,
    LEAST_COSINE,
    enter_fit,
    give_samples,
    in_ball,
    points_over,
    remove_hidden,
    root_mean_square,
    upright_fits,
)
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.intersect import lift
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import BIAS_NOISE_FRACTION, PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal

# Core radius of a merged patch over that of the ball that holds both cores, no unit: the origin
# moves in the fit. With twice the excess merged patches are 2 % larger than they need be.
_SLACK = 1.02


def merge(state: AtlasState, first: int, second: int) -> AtlasChange:
    """Replace two neighbours, and all that the merged patch covers, by one patch; refused where no
    one polynomial fits their samples within the noise."""
    state.check(first, second)
    if first == second:
        raise ValueError(f"both patches are {first}; give two that meet")
    if second not in state.neighbours[first]:
        return AtlasChange(refused=f"patches {first} and {second} are not of one sheet")
    fit = merged_fit(state, first, second)
    merged = None if fit is None else _put_in_place(state, fit)
    if merged is None:
        return AtlasChange(refused=f"no one polynomial holds patches {first} and {second}")
    row, gone = merged
    added = () if row in gone else (row,)
    return AtlasChange(added, tuple(sorted(state.neighbours[row])), gone, (), gone)


def enclosing_balls(first, first_radius, second, second_radius):
    """Centres (m, 3) and radii (m,) of the smallest balls that hold two balls each.

    >>> enclosing_balls(np.zeros((1, 3)), np.ones(1), np.array([[4.0, 0.0, 0.0]]), np.array([2.0]))
    (array([[2.5, 0. , 0. ]]), array([3.5]))
    """
    offset = second - first
    distance = np.sqrt((offset * offset).sum(axis=1))
    # Where one ball holds the other, the result is the larger of them.
    larger = np.maximum(first_radius, second_radius)
    radius = np.maximum(0.5 * (distance + first_radius + second_radius), larger)
    parameter = (radius - first_radius) / np.maximum(distance, np.finfo(float).tiny)
    return first + np.minimum(parameter, 1.0)[:, None] * offset, radius


def merged_fit(state: AtlasState, first: int, second: int) -> PatchFit | None:
    """One patch for the samples of two sheet neighbours and of the patches between; None when no
    polynomial fits them within the noise."""
    table = state.table
    normal = table.axes[first, 2] + table.axes[second, 2]
    normal /= np.sqrt(normal @ normal)
    centres, cores = middles(table, np.array([[first, second]]), normal[None])
    centre, core = centres[0], float(cores[0])
    radius = _SLACK * core / table.core
    rows = _connected_in_ball(state, first, centre, radius, normal)
    if _are_steep(state, rows, centre, core, normal):
        return None
    pool, index = state.membership.pool, state.membership.fitted_by(rows)
    index = index[in_ball(pool.points[index], centre, CANDIDATE_REACH * radius)]
    try:
        fit = refit_patch(
            DarbouxFrame(centre, axes_from_normal(normal, table.axes[first, 0])),
            pool.points[index],
            pool.across[index],
            noise_of(state, rows),
            radius,
            0.0,
            None,
            state.prior,
            state.options.fit,
            float(table.condition[[first, second]].min()),
        )
    except UnfitError:
        return None
    stays = in_ball(fit.patch.frame.origin, centre, (_SLACK - 1.0) * core)
    return fit if stays and upright_fits([fit])[0] else None


def noise_of(state: AtlasState, rows):
    """(...) standard deviation of measurements and of the allowed lack of fit, over rows (..., k),
    length.

    Detail is no part of it: otherwise merging would smooth detail away.
    """
    measurement = np.sqrt((state.table.measurement_std[rows] ** 2).mean(axis=-1))
    return np.hypot(measurement, BIAS_NOISE_FRACTION * state.bias)


def middles(table: PatchTable, pairs, normals):
    """Points (m, 3) of the surface midway between pairs of patches (m, 2), along normals (m, 3),
    and the radii (m,) of the balls about them that hold both cores."""
    cores, sites = np.sqrt(table.weight[pairs]), table.site[pairs]
    centre, _ = enclosing_balls(sites[:, 0], cores[:, 0], sites[:, 1], cores[:, 1])
    offset = sites - centre[:, None]
    nearer = ((offset * offset).sum(axis=2) - table.weight[pairs]).argmin(axis=1)
    rows = pairs[np.arange(len(pairs)), nearer]
    centre = centre + lift(table, rows, centre[:, None], normals) * normals
    offset = sites - centre[:, None]
    return centre, (np.sqrt((offset * offset).sum(axis=2)) + cores).max(axis=1)


def _connected_in_ball(state: AtlasState, start: int, centre, radius: float, normal) -> list[int]:
    """Rows that reach into a ball, have about the normal ``normal``, and are connected to ``start``
    by such rows."""
    table, found, todo = state.table, {start}, [start]
    while todo:
        near = np.array(sorted(set().union(*(state.neighbours[i] for i in todo)) - found), int)
        reach = in_ball(table.origin[near], centre, radius + table.radius[near])
        todo = near[reach & (table.axes[near, 2] @ normal >= SHEET_COSINE)].tolist()
        found.update(todo)
    return sorted(found)


def _are_steep(state: AtlasState, rows, centre, core: float, normal) -> bool:
    """Whether outlines of rows within a ball are more than 45 degrees off ``normal``: a patch with
    their samples would be as steep within its core."""
    table, rows = state.table, np.array(rows)
    points = state.surface_graph.outlines.points(rows)
    upward = table.surface(rows, table.scaled_local(rows, points))[1]
    rise = (upward * (table.axes[rows] @ normal)[:, None]).sum(axis=-1)
    steep = rise < LEAST_COSINE * np.sqrt((upward * upward).sum(axis=-1))
    return bool((steep & in_ball(points, centre, core)).any())


def _put_in_place(state: AtlasState, fit: PatchFit) -> tuple[int, tuple[int, ...]] | None:
    """Enter a merged patch and remove those whose cores it holds; returns its row and theirs.

    Returns None, with nothing changed, in two cases: a patch that shares a corner with the removed
    ones would be no neighbour of the merged one; or it would reach where no patch did.
    """
    trial, row = state.table.with_candidate(fit)
    neighbours = sheet_neighbours(trial, row)
    offset = trial.site[neighbours] - trial.site[row]
    core = np.sqrt(trial.weight[neighbours])
    distance = np.sqrt((offset * offset).sum(axis=1))
    held = distance + core <= np.sqrt(trial.weight[row]) * (1.0 + 1e-9)
    gone, stay = neighbours[held].tolist(), neighbours[~held]
    cells = state.surface_graph.cells
    # Rounding may leave out both patches that are merged.
    if (
        not gone
        or not cells.sharing_corners(gone) <= set(neighbours.tolist())
        or _spreads(state, trial, row, neighbours)
    ):
        return None
    std = root_mean_square(state.table.measurement_std[gone])
    enter_fit(state, fit, stay, state.membership.fitted_by(neighbours.tolist()), std)
    give_samples(state, gone, row)
    around = {row, *stay.tolist()} | state.neighbours.around(gone) - set(gone)
    state.remove(gone)
    gone += remove_hidden(state, around)
    return row, tuple(gone)


def _spreads(state: AtlasState, table: PatchTable, row: int, neighbours: np.ndarray) -> bool:
    """Whether a candidate ``row`` would cover points that no patch covered before: at the rim of
    the touched surface it would claim what was not touched.

    The patches before are its neighbours (m,) and theirs.
    """
    points = points_over(table, row, DISC * table.core * np.sqrt(1.0 + COVER_MARGIN))
    before = sorted(state.neighbours.around(neighbours.tolist()))
    offset = points[:, None] - table.site[before]
    beyond = (offset * offset).sum(axis=-1) > (1.0 + COVER_MARGIN) * table.weight[before]
    return bool(beyond.all(axis=1).any())
