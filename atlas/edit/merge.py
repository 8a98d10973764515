"""Merging: one patch in the place of several, where one polynomial holds all that they know."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edit.refresh import inherit, reopen, smooth_neighbours, update_creases
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH, CandidateSamples
from touchatlas.patch.fit.fit_patch import BIAS_NOISE_FRACTION, PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import scaled_height

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# The core of a merged patch is wider by this than what holds both: its origin moves in the fit.
_SLACK = 1.02
# Corners are found on patches as steep as this, and distances are of first order.
LEAST_COSINE = np.sqrt(0.5)
# Where a disc is looked at: its middle and six rings of 24 points.
_RINGS, _TURNS = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
DISC = np.stack([np.outer(_RINGS, np.cos(_TURNS)), np.outer(_RINGS, np.sin(_TURNS))], -1)
DISC = DISC.reshape(-1, 2)[23:]


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


def merged_fit(atlas: "Atlas", first: int, second: int) -> PatchFit | None:
    """The patch that holds the samples of two kin patches and of all between; None when no one
    polynomial does, within the noise."""
    table = atlas.table
    normal = table.axes[first, 2] + table.axes[second, 2]
    normal /= np.sqrt(normal @ normal)
    centres, cores = middles(table, np.array([[first, second]]), normal[None])
    centre, core = centres[0], float(cores[0])
    radius = _SLACK * core / table.core
    rows = _within(atlas, first, centre, radius, normal)
    if _turn_away(table, rows, centre, core, normal):
        return None
    pool, index = atlas.membership.pool, atlas.membership.fitted_by(rows)
    offset = pool.points[index] - centre
    index = index[(offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2]
    try:
        fit = refit_patch(
            DarbouxFrame(centre, axes_from_normal(normal, table.axes[first, 0])),
            pool.points[index],
            pool.across[index],
            noise_of(atlas, rows),
            radius,
            0.0,
            None,
            atlas.prior,
            atlas.options.fit,
            float(table.condition[[first, second]].min()),
        )
    except UnfitError:
        return None
    moved = fit.patch.frame.origin - centre
    stays = moved @ moved <= ((_SLACK - 1.0) * core) ** 2
    return fit if stays and is_upright(fit.patch) else None


def noise_of(atlas: "Atlas", rows):
    """(...) of the probe, and of what lack of fit is borne, over rows (..., k): detail is none, it
    would be smoothed away."""
    sensor = np.sqrt((atlas.table.measurement_std[rows] ** 2).mean(axis=-1))
    return np.hypot(sensor, BIAS_NOISE_FRACTION * atlas.bias)


def is_upright(patch: Patch) -> bool:
    """Whether a patch turns by less than 45 degrees up to its core radius."""
    normals = patch.normal(patch.outline)
    return bool(((normals @ patch.frame.normal) >= LEAST_COSINE).all())


def middles(table: PatchTable, pairs, normals):
    """Points (m, 3) of the surface midway between pairs of patches (m, 2), along normals (m, 3),
    and the radii (m,) of the balls about them that hold the cores of both."""
    cores, sites = np.sqrt(table.weight[pairs]), table.site[pairs]
    centre, _ = enclosing_balls(sites[:, 0], cores[:, 0], sites[:, 1], cores[:, 1])
    offset = sites - centre[:, None]
    nearer = ((offset * offset).sum(axis=2) - table.weight[pairs]).argmin(axis=1)
    rows = pairs[np.arange(len(pairs)), nearer]
    for _ in range(3):
        height, upward = table.surface(rows, table.scaled_local(rows, centre[:, None]))
        slope = ((upward @ table.axes[rows])[:, 0] * normals).sum(axis=1)
        step = height[:, 0] * table.radius[rows] / np.maximum(slope, 0.2)
        centre = centre - step[:, None] * normals
    offset = sites - centre[:, None]
    return centre, (np.sqrt((offset * offset).sum(axis=2)) + cores).max(axis=1)


def _within(atlas: "Atlas", start: int, centre, radius: float, normal) -> list[int]:
    """Rows that reach into a ball and face about as ``normal``, from kin to kin."""
    table, found, todo = atlas.table, {start}, [start]
    while todo:
        near = np.array(sorted(set().union(*(atlas.neighbours[i] for i in todo)) - found), int)
        offset = table.origin[near] - centre
        reach = (offset * offset).sum(axis=1) < (radius + table.radius[near]) ** 2
        todo = near[reach & (table.axes[near, 2] @ normal >= SHEET_COSINE)].tolist()
        found.update(todo)
    return sorted(found)


def _turn_away(table: PatchTable, rows, centre, core: float, normal) -> bool:
    """Whether outlines of rows turn away from ``normal`` by more than 45 degrees within a ball:
    a patch that held their samples would do so up to its core."""
    rows = np.array(rows)
    ring = table.outline[rows]
    upward = table.surface(rows, table.scaled_local(rows, ring))[1]
    rise = (upward * (table.axes[rows] @ normal)[:, None]).sum(axis=-1)
    steep = rise < LEAST_COSINE * np.sqrt((upward * upward).sum(axis=-1))
    offset = ring - centre
    return bool((steep & ((offset * offset).sum(axis=-1) <= core * core)).any())


def replace_by(atlas: "Atlas", fit: PatchFit) -> tuple[int, tuple[int, ...]] | None:
    """Enter a merged patch and remove those whose cores it holds; its row, and theirs.

    None, and nothing changed, when a neighbour of these would not be kin to it: it turns too far;
    when a crease would hide a part of them from its centre; or when it would reach where no patch
    did.
    """
    table, membership = atlas.table, atlas.membership
    row = table.append(fit)
    neighbours = smooth_neighbours(atlas, row, set())
    offset = table.site[neighbours] - table.site[row]
    core = np.sqrt(table.weight[neighbours])
    distance = np.sqrt((offset * offset).sum(axis=1))
    held = distance + core <= np.sqrt(table.weight[row]) * (1.0 + 1e-9)
    gone, stay = neighbours[held].tolist(), neighbours[~held].tolist()
    lost = atlas.creases.hides(row, gone)
    lost = lost or not atlas.cells.sharing_corners(gone) <= set(neighbours.tolist())
    if lost or _spreads(atlas, row, neighbours, gone):
        table.drop_last()
        return None
    table.measurement_std[row] = np.sqrt((table.measurement_std[gone] ** 2).mean())
    creases = atlas.creases.of_all(gone)
    take_place(atlas, row, fit, np.array(stay, int), membership.fitted_by(neighbours.tolist()))
    membership.owned[row] = membership.owned_by(gone)
    atlas.frontier.move_home(table, gone, row)
    atlas.edge_ends.move_home(gone, row)
    around = {row, *stay} | set().union(*(atlas.neighbours[i] for i in gone)) - set(gone)
    remove_patches(atlas, gone)
    inherit(atlas, row, creases)
    atlas.cells.remove(gone, around)
    gone += remove_hidden(atlas, around)
    if row not in gone:
        update_creases(atlas, [row])
    reopen(atlas, sorted(around - set(gone)))
    return row, tuple(gone)


def _spreads(atlas: "Atlas", row: int, neighbours, gone: list[int]) -> bool:
    """Whether a new row would be asked where none was of its kin (m,), of theirs, and of the rows
    ``gone`` in its place: at the rim of what was touched it would claim what nobody touched."""
    table, reach = atlas.table, np.sqrt(1.0 + COVER_MARGIN)
    points = points_over(table, row, DISC * table.core * reach)
    points = points[atlas.creases.seen_instead(row, gone, points)]
    before = sorted(
        set(neighbours.tolist()).union(*(atlas.neighbours[i] for i in neighbours.tolist()))
    )
    offset = points[:, None] - table.site[before]
    beyond = (offset * offset).sum(axis=-1) > (1.0 + COVER_MARGIN) * table.weight[before]
    return bool(beyond.all(axis=1).any())


def take_place(atlas: "Atlas", row: int, fit: PatchFit, neighbours: np.ndarray, candidates) -> None:
    """A row that was appended becomes a node among its kin (m,), and learns samples (n,)."""
    atlas.enter(row, neighbours.tolist())
    atlas.membership.enter_fits(np.array([row]), [fit], CandidateSamples([candidates]))
    atlas.table.renew_rings([row])
    atlas.cells.meet(row, neighbours)
    atlas.frontier.cover(atlas.table, row)


def remove_hidden(atlas: "Atlas", rows: set[int]) -> list[int]:
    """Remove those of the rows that have no cell left; their samples go to the cells' owners, and
    what they alone covered of others' outlines is open again."""
    table, membership, hidden = atlas.table, atlas.membership, []
    beside: set[int] = set()
    for i in sorted(rows):
        neighbours = np.array(sorted(atlas.neighbours[i]), int)
        if len(neighbours) and _is_hidden(atlas, i, neighbours):
            owner = int(neighbours[power_at(table, neighbours, table.site[i]).argmin()])
            membership.owned[owner] = np.append(membership.owned[owner], membership.owned[i])
            atlas.frontier.move_home(table, [i], owner)
            atlas.edge_ends.move_home([i], owner)
            across = atlas.creases.of(i)
            beside = beside.union(
                atlas.neighbours[i], across, *(atlas.neighbours[j] for j in across)
            )
            remove_patches(atlas, [i])
            hidden.append(i)
    if hidden:
        atlas.cells.remove(hidden, rows - set(hidden))
        reopen(atlas, sorted(beside - set(hidden)))
    return hidden


def _is_hidden(atlas: "Atlas", row: int, neighbours) -> bool:
    """Whether the kin (m,) of a row, and the creases of its sheet, leave it no cell."""
    table, rows = atlas.table, np.array([row])
    if not atlas.cells.corners_of(row):
        return bool(power_at(table, neighbours, table.site[row]).min() < -table.weight[row])
    if not atlas.creases.behind(row):
        return False
    points = points_over(table, row, DISC * table.core)
    own = power_at(table, neighbours, points).min(axis=1) >= power_at(table, rows, points)[:, 0]
    points = points[own]
    return bool(atlas.creases.beyond(np.tile(rows, len(points)), points).all())


def points_over(table: PatchTable, row: int, xy) -> np.ndarray:
    """(n, 3) points of a patch over places (m, 2) of its tangent plane, scaled; without those
    where it folds."""
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    scaled = np.column_stack([xy, z])[np.isfinite(z)]
    return scaled * table.radius[row] @ table.axes[row] + table.origin[row]


def remove_patches(atlas: "Atlas", rows: list[int]) -> None:
    """Take patches out of use; their samples are others' by now."""
    for i in rows:
        for j in atlas.neighbours[i]:
            atlas.neighbours[j].discard(i)
        atlas.neighbours[i] = set()
        atlas.membership.forget(i)
    atlas.creases.forget(rows)
    atlas.table.remove(rows)
