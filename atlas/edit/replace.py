"""Replace: enter fitted patches and remove hidden ones, with their samples.

Insert, renew and fill share these steps.
"""

import numpy as np

from touchatlas.atlas.graph.outlines import core_points
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CandidateSamples
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.geometry.patch import outlines
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    evaluate_batch,
    monomials,
    scaled_height,
)

# Least cosine between the normal at a patch's origin and the normals up to its core radius: 45
# degrees. On steeper patches corners are not found, and a first-order distance is off by a
# seventh. Doubling the angle allows patches that stand upright at the rim.
_LEAST_COSINE = np.sqrt(0.5)
# The same for a patch that learned more samples than it was fitted to: 60 degrees. Doubled, only
# planes are left; without it, some patches are as steep as a wall where they have no samples.
_LEAST_LEARNED = 0.5
# Height above and below the rim of a core, in patch radii, up to which F = z - phi must rise in z.
# Where it falls it has a second zero that is at most as far again. Doubled, an eighth of the
# patches beside fillets are replaced instead of a thirtieth.
_CLEAR_OF_FOLDS = 0.1
# Points of the unit disc, no unit: the centre and six circles of 24 points. A cell that holds none
# of them is narrower than a sixth of the core. Twice as many take twice the time.
_RADII, _ANGLES = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_DISC = np.stack([np.outer(_RADII, np.cos(_ANGLES)), np.outer(_RADII, np.sin(_ANGLES))], -1)
_DISC = _DISC.reshape(-1, 2)[23:]


def in_ball(points, centre, radius) -> np.ndarray:
    """(...) whether points (..., 3) lie within a radius of a centre (3,), or each of its own."""
    offset = points - centre
    return np.asarray((offset * offset).sum(axis=-1) <= radius**2)


def root_mean_square(values) -> float:
    """Of values (n,), in their unit."""
    return float(np.sqrt((np.asarray(values) ** 2).mean()))


def upright_fits(fits: list[PatchFit]) -> np.ndarray:
    """(m,) whether the normals of m fits of one basis are within 45 degrees of their own up to the
    core radius."""
    if not fits:
        return np.zeros(0, bool)
    basis, core = fits[0].patch.polynomial.basis, fits[0].patch.core
    means = np.array([fit.patch.polynomial.coefficients for fit in fits])
    terms = monomials(basis, *np.moveaxis(outlines(basis, means, core), -1, 0))
    _, px, py, pz = evaluate_batch(basis, means, terms, GRADIENT)
    length = np.sqrt(px * px + py * py + (1.0 - pz) ** 2)
    return np.asarray((1.0 - pz >= _LEAST_COSINE * length).all(axis=1))


def are_upright(table: PatchTable, rows) -> np.ndarray:
    """(m,) whether the normals of rows (m,) of a table, as their polynomials are now, are within 60
    degrees of their own up to the core radius, and the polynomials do not fold near there."""
    points = table.scaled_local(rows, core_points(table, rows))
    upward = table.surface(rows, points)[1]
    length = np.sqrt((upward * upward).sum(axis=-1))
    upright = upward[..., 2] >= _LEAST_LEARNED * length
    for height in (-_CLEAR_OF_FOLDS, _CLEAR_OF_FOLDS):
        beside = points + np.array([0.0, 0.0, height])
        upright &= table.surface(rows, beside)[1][..., 2] > 0.0
    return np.asarray(upright.all(axis=-1))


def _enter_fit(
    state: AtlasState, fit: PatchFit, neighbours: np.ndarray, candidates, measurement_std: float
) -> int:
    """Enter a fitted patch with its neighbours (m,) and the noise of its measurements, length.

    It learns those of the samples ``candidates`` (n,) that are of its sheet. Returns its row.
    """
    row = state.table.append(fit)
    state.enter(row, neighbours.tolist())
    state.membership.enter_fits(np.array([row]), [fit], CandidateSamples([candidates]))
    state.table.measurement_std[row] = measurement_std
    state.mark_stale([row])
    return row


def replace_by(state: AtlasState, row: int, fit: PatchFit) -> None:
    """Replace a row by a patch that was fitted about its site. The patch owns its samples, and
    learns those that it and its neighbours know; whatever has no cell then is removed."""
    table, membership = state.table, state.membership
    owned, known = membership.owned[row], membership.fitted[row]
    std, around = float(table.measurement_std[row]), set(state.neighbours[row])
    state.remove([row])
    trial, candidate = table.with_candidate(fit)
    neighbours = sheet_neighbours(trial, candidate)
    samples = np.union1d(known, membership.owned_by(neighbours.tolist()))
    new = _enter_fit(state, fit, neighbours, samples, std)
    membership.owned[new] = owned
    state.edge_ends.move_home([row], new)
    state.mark_stale([new])
    remove_hidden(state, around.union([new], state.neighbours[new]))


def remove_hidden(state: AtlasState, rows: set[int]) -> list[int]:
    """Remove those of the rows that have no cell left; returns them.

    The samples of each go to the neighbour in whose cell its site lies.
    """
    table, hidden = state.table, []
    for i in _uncovered(state, rows):
        neighbours = np.array(sorted(state.neighbours[i]), int)
        if len(neighbours) and _is_hidden(state, i, neighbours):
            owner = int(neighbours[power_at(table, neighbours, table.site[i]).argmin()])
            _give_samples(state, [i], owner)
            state.remove([i])
            hidden.append(i)
    return hidden


def _uncovered(state: AtlasState, rows: set[int]) -> list[int]:
    """Those of the rows, ascending, whose sites lie in the cell of a neighbour: the others have a
    cell, whatever neighbours are removed."""
    table, every = state.table, np.array(sorted(rows), int)
    if not len(every):
        return []
    sites = table.site[every][:, None]
    power = power_at(table, state.neighbours.lines_of(every)[:, None], sites)[:, 0]
    covered = power.min(axis=1) >= -table.weight[every]
    found: list[int] = every[~covered].tolist()
    return found


def _give_samples(state: AtlasState, rows: list[int], owner: int) -> None:
    """Make ``owner`` the owner of the samples and edge ends of some rows."""
    owned = state.membership.owned
    owned[owner] = np.concatenate([owned[owner], *(owned[i] for i in rows)])
    for i in rows:
        owned[i] = owned[i][:0]
    state.edge_ends.move_home(rows, owner)
    state.mark_stale([owner])


def _is_hidden(state: AtlasState, row: int, neighbours) -> bool:
    """Whether the neighbours (m,) of a row leave it no cell."""
    table = state.table
    if power_at(table, neighbours, table.site[row]).min() >= -table.weight[row]:
        return False
    points = _points_over(table, row, _DISC * table.core)
    own = power_at(table, neighbours, points).min(axis=1) >= power_at(table, [row], points)[:, 0]
    return not own.any()


def _points_over(table: PatchTable, row: int, xy) -> np.ndarray:
    """(n, 3) world points of a patch over scaled points (m, 2) of its tangent plane, without those
    over which it has no height."""
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    scaled = np.column_stack([xy, z])[np.isfinite(z)]
    return scaled * table.radius[row] @ table.axes[row] + table.origin[row]
