"""What merging, splitting and filling share: patches that come and go with their samples."""

import numpy as np

from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CandidateSamples
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import scaled_height

# Up to its core a patch turns by no more than 45 degrees: steeper, corners are not found on it and
# distances of first order are off by a seventh.
LEAST_COSINE = np.sqrt(0.5)
# Places over a disc of radius one: its middle and six rings of 24 points. A cell that holds none of
# them is narrower than a sixth of the core. Twice as many take twice the time.
_RINGS, _TURNS = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
DISC = np.stack([np.outer(_RINGS, np.cos(_TURNS)), np.outer(_RINGS, np.sin(_TURNS))], -1)
DISC = DISC.reshape(-1, 2)[23:]


def is_upright(patch: Patch) -> bool:
    """Whether a patch turns by less than 45 degrees up to its core radius."""
    normals = patch.normal(patch.outline)
    return bool(((normals @ patch.frame.normal) >= LEAST_COSINE).all())


def enter_fit(state: AtlasState, fit: PatchFit, neighbours: np.ndarray, candidates) -> int:
    """Make a fitted patch a node among its neighbours (m,), fitted to those of the samples
    ``candidates`` (n,) that are of its sheet; returns its row."""
    row = state.table.append(fit)
    state.enter(row, neighbours.tolist())
    state.membership.enter_fits(np.array([row]), [fit], CandidateSamples([candidates]))
    state.mark_stale([row])
    return row


def remove_hidden(state: AtlasState, rows: set[int]) -> list[int]:
    """Remove those of the rows that have no cell left; their samples go to the owners of the cells
    that their sites are in."""
    table, hidden = state.table, []
    for i in sorted(rows):
        neighbours = np.array(sorted(state.neighbours[i]), int)
        if len(neighbours) and _is_hidden(state, i, neighbours):
            owner = int(neighbours[power_at(table, neighbours, table.site[i]).argmin()])
            give_samples(state, [i], owner)
            state.remove([i])
            hidden.append(i)
    return hidden


def give_samples(state: AtlasState, rows: list[int], owner: int) -> None:
    """Make a row the owner of what the touches of rows brought."""
    owned = state.membership.owned
    owned[owner] = np.concatenate([owned[owner], *(owned[i] for i in rows)])
    for i in rows:
        owned[i] = owned[i][:0]
    state.edge_ends.move_home(rows, owner)
    state.mark_stale([owner])


def _is_hidden(state: AtlasState, row: int, neighbours) -> bool:
    """Whether the neighbours (m,) of a row, and the creases of its sheet, leave it no cell."""
    table, rows = state.table, np.array([row])
    behind_edges = bool(state.creases.behind(row))
    covers_site = power_at(table, neighbours, table.site[row]).min() >= -table.weight[row]
    if covers_site and not behind_edges:
        return False
    points = points_over(table, row, DISC * table.core)
    own = power_at(table, neighbours, points).min(axis=1) >= power_at(table, rows, points)[:, 0]
    points = points[own]
    if behind_edges:
        beyond = state.surface_graph.visibility.beyond(np.tile(rows, len(points)), points)
        points = points[~beyond]
    return not len(points)


def points_over(table: PatchTable, row: int, xy) -> np.ndarray:
    """(n, 3) points of a patch over places (m, 2) of its tangent plane, scaled; without those
    where it folds."""
    z = scaled_height(table.basis, table.mean[row], *xy.T)
    scaled = np.column_stack([xy, z])[np.isfinite(z)]
    return scaled * table.radius[row] @ table.axes[row] + table.origin[row]
