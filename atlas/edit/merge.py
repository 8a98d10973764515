"""Merging: one patch in the place of several, where one polynomial holds all that they know."""

import numpy as np

from touchatlas.atlas.edit.refresh import inherit_creases, smooth_neighbours, update_creases
from touchatlas.atlas.edit.replace import (
    DISC,
    LEAST_COSINE,
    enter_fit,
    give_samples,
    is_upright,
    points_over,
    remove_hidden,
)
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.graph.visibility import is_behind
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

# The core of a merged patch is wider by this factor than what holds both: its origin moves in the
# fit. Doubling the excess makes merged patches 2 % larger than they need be.
_SLACK = 1.02
# Outlines are looked at so far out, as a fraction: on the crease itself either answer is right.
_INNER = 0.95


def merge(state: AtlasState, first: int, second: int) -> AtlasChange:
    """One patch in the place of two that meet, and of all that it covers, when one polynomial
    holds their samples within the noise; refused otherwise."""
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
    # Where one ball holds the other it is the larger of them.
    larger = np.maximum(first_radius, second_radius)
    radius = np.maximum(0.5 * (distance + first_radius + second_radius), larger)
    share = (radius - first_radius) / np.maximum(distance, np.finfo(float).tiny)
    return first + np.minimum(share, 1.0)[:, None] * offset, radius


def merged_fit(state: AtlasState, first: int, second: int) -> PatchFit | None:
    """The patch that holds the samples of two kin patches and of all between; None when no one
    polynomial does, within the noise."""
    table = state.table
    normal = table.axes[first, 2] + table.axes[second, 2]
    normal /= np.sqrt(normal @ normal)
    centres, cores = middles(table, np.array([[first, second]]), normal[None])
    centre, core = centres[0], float(cores[0])
    radius = _SLACK * core / table.core
    rows = _within(state, first, centre, radius, normal)
    if _turn_away(state, rows, centre, core, normal):
        return None
    pool, index = state.membership.pool, state.membership.fitted_by(rows)
    offset = pool.points[index] - centre
    index = index[(offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2]
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
    moved = fit.patch.frame.origin - centre
    stays = moved @ moved <= ((_SLACK - 1.0) * core) ** 2
    return fit if stays and is_upright(fit.patch) else None


def noise_of(state: AtlasState, rows):
    """(...) of the probe, and of what lack of fit is borne, over rows (..., k): detail is none, it
    would be smoothed away."""
    sensor = np.sqrt((state.table.measurement_std[rows] ** 2).mean(axis=-1))
    return np.hypot(sensor, BIAS_NOISE_FRACTION * state.bias)


def middles(table: PatchTable, pairs, normals):
    """Points (m, 3) of the surface midway between pairs of patches (m, 2), along normals (m, 3),
    and the radii (m,) of the balls about them that hold the cores of both."""
    cores, sites = np.sqrt(table.weight[pairs]), table.site[pairs]
    centre, _ = enclosing_balls(sites[:, 0], cores[:, 0], sites[:, 1], cores[:, 1])
    offset = sites - centre[:, None]
    nearer = ((offset * offset).sum(axis=2) - table.weight[pairs]).argmin(axis=1)
    rows = pairs[np.arange(len(pairs)), nearer]
    centre = centre + lift(table, rows, centre[:, None], normals) * normals
    offset = sites - centre[:, None]
    return centre, (np.sqrt((offset * offset).sum(axis=2)) + cores).max(axis=1)


def _within(state: AtlasState, start: int, centre, radius: float, normal) -> list[int]:
    """Rows that reach into a ball and face about as ``normal``, from neighbour to neighbour."""
    table, found, todo = state.table, {start}, [start]
    while todo:
        near = np.array(sorted(set().union(*(state.neighbours[i] for i in todo)) - found), int)
        offset = table.origin[near] - centre
        reach = (offset * offset).sum(axis=1) < (radius + table.radius[near]) ** 2
        todo = near[reach & (table.axes[near, 2] @ normal >= SHEET_COSINE)].tolist()
        found.update(todo)
    return sorted(found)


def _turn_away(state: AtlasState, rows, centre, core: float, normal) -> bool:
    """Whether outlines of rows turn away from ``normal`` by more than 45 degrees within a ball:
    a patch that held their samples would do so up to its core."""
    table, rows = state.table, np.array(rows)
    points = state.surface_graph.outlines.points(rows)
    upward = table.surface(rows, table.scaled_local(rows, points))[1]
    rise = (upward * (table.axes[rows] @ normal)[:, None]).sum(axis=-1)
    steep = rise < LEAST_COSINE * np.sqrt((upward * upward).sum(axis=-1))
    offset = points - centre
    return bool((steep & ((offset * offset).sum(axis=-1) <= core * core)).any())


def _put_in_place(state: AtlasState, fit: PatchFit) -> tuple[int, tuple[int, ...]] | None:
    """Enter a merged patch and remove those whose cores it holds; its row, and theirs.

    None, and nothing changed, when a patch that shares a corner with these would not be a
    neighbour of it: it turns too far; when a crease would hide a part of them from its centre; or
    when it would reach where no patch did.
    """
    trial, row = state.table.with_candidate(fit)
    neighbours = smooth_neighbours(state, trial, row, set())
    offset = trial.site[neighbours] - trial.site[row]
    core = np.sqrt(trial.weight[neighbours])
    distance = np.sqrt((offset * offset).sum(axis=1))
    held = distance + core <= np.sqrt(trial.weight[row]) * (1.0 + 1e-9)
    gone, stay = neighbours[held].tolist(), neighbours[~held]
    cells = state.surface_graph.cells
    if (
        _hides(state, trial, row, gone)
        or not cells.sharing_corners(gone) <= set(neighbours.tolist())
        or _spreads(state, trial, row, neighbours, gone)
    ):
        return None
    std = np.sqrt((state.table.measurement_std[gone] ** 2).mean())
    creases = state.creases.of_all(gone)
    enter_fit(state, fit, stay, state.membership.fitted_by(neighbours.tolist()))
    state.table.measurement_std[row] = std
    give_samples(state, gone, row)
    around = {row, *stay.tolist()} | state.neighbours.around(gone) - set(gone)
    state.remove(gone)
    inherit_creases(state, row, creases)
    gone += remove_hidden(state, around)
    if row not in gone:
        update_creases(state, [row])
    return row, tuple(gone)


def _hides(state: AtlasState, table: PatchTable, row: int, gone: list[int]) -> bool:
    """Whether a part of the outlines of rows ``gone`` that are creased cannot be seen from the
    centre of a candidate ``row`` that is to take their place."""
    visibility, outlines = state.surface_graph.visibility, state.surface_graph.outlines
    segments = visibility.segments_about(gone)
    if not len(segments):
        return False
    places = []
    for i in gone:
        points, centre = outlines.points([i])[0], visibility.centre(i)
        beyond = is_behind(table, i, centre, points, segments)
        places.append(np.concatenate([points[~beyond], centre[None]]))
    hidden = is_behind(table, row, table.site[row], np.concatenate(places), segments, _INNER)
    return bool(hidden.any())


def _spreads(
    state: AtlasState, table: PatchTable, row: int, neighbours: np.ndarray, gone: list[int]
) -> bool:
    """Whether a candidate ``row`` would be asked where none was of its neighbours (m,), of theirs,
    and of the rows ``gone`` in its place: at the rim of what was touched it would claim what nobody
    touched."""
    points = points_over(table, row, DISC * table.core * np.sqrt(1.0 + COVER_MARGIN))
    segments = state.surface_graph.visibility.segments_about(gone)
    if len(segments):
        points = points[~is_behind(table, row, table.site[row], points, segments)]
    before = sorted(state.neighbours.around(neighbours.tolist()))
    offset = points[:, None] - table.site[before]
    beyond = (offset * offset).sum(axis=-1) > (1.0 + COVER_MARGIN) * table.weight[before]
    return bool(beyond.all(axis=1).any())
