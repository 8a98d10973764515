"""Bridging: patches where samples lie between patches, though no touch had its place there."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.edit.merge import is_upright, remove_hidden, take_place
from touchatlas.atlas.edit.refresh import reopen, smooth_neighbours, update_creases
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, of_patch
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.frame import DarbouxFrame, axes_from_normal
from touchatlas.patch.geometry.patch import Patch

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# A patch that would turn too far is tried smaller; and one that would learn less than so much of
# the samples within it, which are of another sheet then.
_SHARES = 1.0, 0.7, 0.5
_HELD = 0.5


def fill(atlas: "Atlas") -> AtlasChange:
    """Patches about the samples that no core covers, those with most others near first, each of
    all samples there.

    How sure they are, their deviation says: along one contour alone they hardly know how the
    surface bends across it.
    """
    frontier, table, before = atlas.frontier, atlas.table, set(atlas.table.rows.tolist())
    points, normals, home = frontier.points, frontier.normals, frontier.home
    around = [
        _around(atlas, point, normal, float(table.radius[i]))
        for point, normal, i in zip(points, normals, home, strict=True)
    ]
    for k in sorted(range(len(points)), key=lambda k: -len(around[k])):
        left = (frontier.points == points[k]).all(axis=1)
        if not left.any():
            continue
        beside = int(frontier.home[left.argmax()])
        if atlas.creases.of(beside):
            # How far a face goes on its touches say.
            continue
        fit = _fit(atlas, beside, points[k], normals[k], around[k])
        if fit is not None:
            _enter(atlas, fit, _about(atlas, fit.patch))
    if set(table.rows.tolist()) != before:
        atlas.cells.retile()
        atlas.cells.mend()
    after = set(table.rows.tolist())
    return AtlasChange(added=tuple(sorted(after - before)), removed=tuple(sorted(before - after)))


def _around(atlas: "Atlas", point, normal, radius: float) -> np.ndarray:
    """Indices of the samples, ascending, that a patch about a point may learn from: touches from
    beyond its kin may have brought them."""
    pool = atlas.membership.pool
    offset = pool.points - point
    near = np.flatnonzero((offset * offset).sum(axis=1) <= (CANDIDATE_REACH * radius) ** 2)
    return near[pool.normals[near] @ normal >= SHEET_COSINE]


def _about(atlas: "Atlas", patch: Patch) -> np.ndarray:
    """Indices of the samples, ascending, that a patch may learn from where it came to lie."""
    return _around(atlas, patch.frame.origin, patch.frame.normal, patch.radius)


def _fit(atlas: "Atlas", beside: int, point, normal, index) -> PatchFit | None:
    """A patch about a point that holds the samples there, as large as the one beside it if it need
    not turn too far for that."""
    table, pool = atlas.table, atlas.membership.pool
    frame = DarbouxFrame(point, axes_from_normal(normal, table.axes[beside, 0]))
    for share in _SHARES:
        radius = share * float(table.radius[beside])
        try:
            fit = refit_patch(
                frame,
                pool.points[index],
                pool.across[index],
                float(table.noise[beside]),
                radius,
                atlas.bias,
                radius,
                atlas.prior,
                atlas.options.fit,
            )
        except UnfitError:
            continue
        held = (_holds(atlas, fit, some) for some in (index, _about(atlas, fit.patch)))
        if is_upright(fit.patch) and all(held):
            return fit
    return None


def _enter(atlas: "Atlas", fit: PatchFit, index) -> None:
    """Enter a patch among its kin, if it has any and is not hidden by them."""
    table = atlas.table
    row = table.append(fit)
    neighbours = smooth_neighbours(atlas, row, set())
    least = power_at(table, neighbours, table.site[row]).min(initial=np.inf)
    if not -table.weight[row] < least < np.inf:
        table.drop_last()
        return
    table.measurement_std[row] = np.sqrt((table.measurement_std[neighbours] ** 2).mean())
    take_place(atlas, row, fit, neighbours, index)
    update_creases(atlas, [row])
    changed = {row, *neighbours.tolist()}
    reopen(atlas, sorted(changed - set(remove_hidden(atlas, changed))))


def _holds(atlas: "Atlas", fit: PatchFit, index) -> bool:
    """Whether samples ``index`` (n,) within a patch are mostly of its sheet."""
    table, pool = atlas.table, atlas.membership.pool
    offset = pool.points[index] - fit.patch.frame.origin
    within = index[(offset * offset).sum(axis=1) <= fit.patch.radius**2]
    row = np.array([table.append(fit)])
    mine = of_patch(table, row, pool.points[within], pool.normals[within])
    table.drop_last()
    return bool(mine.sum() >= max(1.0, _HELD * len(within)))
