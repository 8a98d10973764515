"""Splitting: seven smaller patches in the place of one that does not hold its samples."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edit.merge import (
    DISC,
    points_over,
    remove_hidden,
    remove_patches,
    take_place,
)
from touchatlas.atlas.edit.refresh import inherit, reopen, smooth_neighbours, update_creases
from touchatlas.atlas.graph.creases import Crease
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import of_patch
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.polynomial import scaled_height

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# Seven discs of half its radius cover a disc: one in the middle, six about it this far out.
# Kershner, The number of circles covering a set, 1939. The slack is for curved discs.
_SHARE, _OUT, _SLACK = 0.5, np.sqrt(0.75), 1.08
_LEAST_SAMPLES = 2


def parts_of(atlas: "Atlas", row: int) -> list[PatchFit] | None:
    """Seven patches that cover the core of a row, from the samples that it knows, without those
    that lie beyond its creases; None when the samples do not determine all of them."""
    table, pool, membership = atlas.table, atlas.membership.pool, atlas.membership
    index = membership.fitted_by([row, *atlas.neighbours[row]])
    samples = pool.points[index], pool.normals[index]
    near = of_patch(table, np.array([row]), *samples, CANDIDATE_REACH)[0]
    index, radius = index[near], _SLACK * _SHARE * table.radius[row]
    parts = []
    for frame in _frames(atlas, row):
        offset = pool.points[index] - frame.origin
        inside = index[(offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2]
        if len(inside) < _LEAST_SAMPLES * table.basis.size:
            return None
        given = (pool.points[inside], pool.across[inside], float(table.noise[row]))
        bias = atlas.options.bias * atlas.tolerance
        try:
            parts.append(
                refit_patch(frame, *given, radius, bias, None, atlas.prior, atlas.options.fit)
            )
        except UnfitError:
            return None
    return parts or None


def _frames(atlas: "Atlas", row: int) -> list[DarbouxFrame]:
    """Where the patches are to be, on the polynomial of a row; nowhere if it folds."""
    table = atlas.table
    angles = np.pi / 3.0 * np.arange(6)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    xy = table.core * _OUT * np.concatenate([np.zeros((1, 2)), ring])
    xy = xy[[_is_seen(atlas, row, centre) for centre in xy]]
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    if not np.isfinite(z).all():
        return []
    scaled = np.column_stack([xy, z])
    upward = table.surface(np.array([row]), scaled[None])[1][0]
    normals = upward / np.sqrt((upward * upward).sum(axis=1))[:, None] @ table.axes[row]
    origins = scaled * table.radius[row] @ table.axes[row] + table.origin[row]
    e1 = table.axes[row, 0]
    return [DarbouxFrame(p, axes_from_normal(n, e1)) for p, n in zip(origins, normals, strict=True)]


def _is_seen(atlas: "Atlas", row: int, centre) -> bool:
    """Whether any of the smaller disc about a place (2,), scaled, lies on this side of creases."""
    table = atlas.table
    points = points_over(table, row, centre + _SLACK * _SHARE * table.core * DISC)
    return not atlas.creases.beyond(np.full(len(points), row), points).all() or not len(points)


def _within(atlas: "Atlas", part: int, creases, lines) -> dict[int, Crease]:
    """Those of creases that a part reaches, by the rows behind them; ``lines`` are their curves."""
    table, found = atlas.table, {}
    for other, crease in creases.items():
        points = np.concatenate([lines[other], crease.anchor[None]])
        offset = points - table.origin[part]
        square = (offset * offset).sum(axis=1)
        if square.min() <= table.radius[part] ** 2:
            found[other] = Crease(crease.sign, points[square.argmin()])
    return found


def divide(atlas: "Atlas", row: int, parts: list[PatchFit]) -> tuple[int, ...]:
    """Put patches in the place of a row, and share its samples out among them; their rows."""
    table, membership = atlas.table, atlas.membership
    brought, known = membership.owned[row], membership.fitted[row]
    sensor = float(table.measurement_std[row])
    around, creases = set(atlas.neighbours[row]), atlas.creases.of_all([row])
    lines = {other: atlas.creases.curve(row, other) for other in creases}
    remove_patches(atlas, [row])
    atlas.cells.remove([row], around)
    rows = []
    for fit in parts:
        part = table.append(fit)
        table.measurement_std[part] = sensor
        neighbours = np.setdiff1d(smooth_neighbours(atlas, part, set()), list(creases))
        take_place(
            atlas,
            part,
            fit,
            neighbours,
            np.union1d(known, membership.owned_by(neighbours.tolist())),
        )
        rows.append(part)
    owner = np.array(rows)[power_at(table, rows, membership.pool.points[brought]).argmin(axis=1)]
    for part in rows:
        membership.owned[part] = brought[owner == part]
    atlas.frontier.move_home(table, [row], rows[0])
    atlas.edge_ends.move_home([row], rows[0])
    for part in rows:
        inherit(atlas, part, _within(atlas, part, creases, lines))
    update_creases(atlas, rows)
    # A neighbour may cover more of the row than its parts do, or they more than a neighbour, which
    # may be new to them.
    around = around.union(rows, *(atlas.neighbours[i] for i in rows))
    around -= set(remove_hidden(atlas, around))
    # The edges have moved, for those across them too.
    reopen(atlas, sorted(around.union(*(atlas.creases.of(i) for i in around))))
    return tuple(sorted(set(rows) & around))
