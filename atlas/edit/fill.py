"""Fill: patches where no core covers samples, and in gaps between cells, many in one call."""

import networkx as nx
import numpy as np

from touchatlas.atlas.edit.filling_fits import Filling, Sites, fits_at
from touchatlas.atlas.edit.replace import remove_hidden, root_mean_square
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.atlas.graph.sheets import sheet_neighbours
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState

# Least distance of two sites that are filled in one call, in core radii of the patches that own
# them: each new patch covers the samples about it. Doubled, samples are filled in more calls.
_APART = 0.9
# Rounds in which samples, and then gaps, are filled: what patches of one round leave open is filled
# in the next. Doubled, places that no patch fits are tried more often.
_ROUNDS, _GAP_ROUNDS = 6, 2

# Distances from the middle of a hole within this factor are equal, and the first point is taken: of
# two points both are as far, and rounding would choose. Doubling the excess changes nothing.
_TIED = 1.0 + 1e-9

# Patches that were not entered, by the bytes of point and normal of the site; None where no
# polynomial follows the samples.
Refused = dict[bytes, Filling | None]


def fill(state: AtlasState) -> AtlasChange:
    """Fill about all samples, all gaps, and all holes that one patch can cover."""
    before, changed = set(state.table.rows.tolist()), set[int]()
    _fill_about(state, np.arange(len(state.membership.pool)), changed)
    refused: Refused = {}
    for _ in range(_GAP_ROUNDS):
        if not _enter_all(state, _holes(state), changed, refused):
            break
    return _change(state, before, changed)


def fill_about(state: AtlasState, samples) -> AtlasChange:
    """Fit a patch about each sample that no core covers, those with the most samples near first,
    and then about each gap between three cells.

    A patch is fitted to all samples near it. Where these are of one contour they hardly tell how
    the surface bends across it, and the patch predicts a large deviation.

    Parameters
    ----------
    state : AtlasState
    samples : (n,) int
        These samples, and the gaps of patches that are fitted to any of them, are filled.
    """
    before, changed = set(state.table.rows.tolist()), set[int]()
    _fill_about(state, samples, changed)
    return _change(state, before, changed)


def _fill_about(state: AtlasState, samples, changed: set[int]) -> None:
    """Fill samples, and then gaps. Rows that the new patches meet are added to ``changed``."""
    refused: Refused = {}
    for _ in range(_ROUNDS):
        if not _enter_all(state, _open_samples(state, samples), changed, refused):
            break
    for _ in range(_GAP_ROUNDS):
        if not _enter_all(state, _gaps(state, samples), changed, refused):
            break


def _change(state: AtlasState, before: set[int], changed: set[int]) -> AtlasChange:
    """What differs from the rows ``before``, of which some ``changed``."""
    after = set(state.table.rows.tolist())
    return AtlasChange(
        added=tuple(sorted(after - before)),
        changed=tuple(sorted(changed & after & before)),
        removed=tuple(sorted(before - after)),
    )


def _open_samples(state: AtlasState, samples) -> Sites:
    """The samples that no core covers, those with the most samples near first."""
    frontier, membership = state.frontier, state.membership
    candidates = np.intersect1d(frontier.candidates(), samples)
    left = candidates[frontier.is_open(candidates)]
    points, owners = membership.pool.points[left], frontier.owners(left)
    count = membership.count_near(points, CANDIDATE_REACH * state.table.radius[owners])
    order = np.argsort(-count, kind="stable")
    return Sites(points, membership.pool.normals[left], owners).only(order)


def _gaps(state: AtlasState, samples) -> Sites:
    """The gaps between three cells, on the patch with the highest id."""
    table, membership = state.table, state.membership
    near = np.unique(table.index.near(membership.pool.points[samples])[0]).tolist()
    chosen = np.zeros(len(membership.pool), bool)
    chosen[samples] = True
    beside = [row for row in near if chosen[membership.fitted[row]].any()]
    found = sorted(state.surface_graph.cells.gaps_of(beside).items())
    points = np.array([point for _, point in found]).reshape(-1, 3)
    return _sites_on(table, np.array([triple[2] for triple, _ in found], int), points)


def _holes(state: AtlasState) -> Sites:
    """The open point of an outline in the middle of each hole between four cells or more.

    At a hole boundaries lack one of their ends. What is left open farther apart than a core is
    wide is the rim of what was touched, and no hole.
    """
    table, outlines = state.table, state.surface_graph.outlines
    points, owners = [], []
    for around in nx.connected_components(nx.Graph(state.surface_graph.odd_pairs())):
        rows = np.array(sorted(around))
        is_open = outlines.open(rows)
        places = outlines.points(rows)[is_open]
        off = (
            np.linalg.norm(places - places.mean(axis=0), axis=1)
            if len(places)
            else np.array([np.inf])
        )
        if np.max(off) <= np.sqrt(table.weight[rows].max()):
            middle = int(np.argmax(off <= _TIED * off.min()))
            points.append(places[middle])
            owners.append(rows[np.nonzero(is_open)[0][middle]])
    return _sites_on(table, np.array(owners, int), np.array(points).reshape(-1, 3))


def _sites_on(table: PatchTable, owners, points) -> Sites:
    """Sites at points (n, 3) of the polynomials of rows ``owners`` (n,)."""
    upward = table.surface(owners, table.scaled_local(owners, points[:, None]))[1]
    normals = (upward @ table.axes[owners])[:, 0]
    normals /= np.sqrt((normals * normals).sum(axis=1))[:, None]
    return Sites(points, normals, owners)


def _enter_all(state: AtlasState, sites: Sites, changed: set[int], refused: Refused) -> int:
    """Fit and enter patches about those of the sites that are far apart; returns how many were
    entered. Rows that they meet are added to ``changed``, and patches that were not entered to
    ``refused``: they are entered later if neighbours allow it then, and no site is fitted twice.
    """
    sites = sites.only(_far_apart(sites, _APART * np.sqrt(state.table.weight[sites.owners])))
    places = [place.tobytes() for place in np.hstack([sites.points, sites.normals])]
    new = [i for i, place in enumerate(places) if place not in refused]
    refused.update(zip([places[i] for i in new], fits_at(state, sites.only(new)), strict=True))
    entered = 0
    for place in places:
        filling = refused[place]
        if filling is not None and _enter(state, filling, changed):
            del refused[place]
            entered += 1
    return entered


def _far_apart(sites: Sites, apart) -> list[int]:
    """Indices of sites, the first ones first, that are farther than ``apart`` (n,) from those
    before that face alike."""
    kept: list[int] = []
    for i in range(len(sites)):
        offset = sites.points[kept] - sites.points[i]
        near = (offset * offset).sum(axis=1) < apart[i] ** 2
        if not (near & (sites.normals[kept] @ sites.normals[i] > 0.0)).any():
            kept.append(i)
    return kept


def _enter(state: AtlasState, filling: Filling, changed: set[int]) -> bool:
    """Enter a patch among its neighbours, if it has any and their cells do not hold its site; these
    are added to ``changed``."""
    trial, candidate = state.table.with_candidate(filling.fit)
    neighbours = sheet_neighbours(trial, candidate)
    least = power_at(trial, neighbours, trial.site[candidate]).min(initial=np.inf)
    if not -trial.weight[candidate] < least < np.inf:
        return False
    row = _append(state, filling, neighbours)
    changed.update(neighbours.tolist())
    remove_hidden(state, {row, *neighbours.tolist()})
    return True


def _append(state: AtlasState, filling: Filling, neighbours: np.ndarray) -> int:
    """Append a patch with its neighbours (m,), whose noise it has; returns its row."""
    row = state.table.append_copy(filling.columns)
    state.table.measurement_std[row] = root_mean_square(state.table.measurement_std[neighbours])
    state.enter(row, neighbours.tolist())
    state.membership.fitted[row] = filling.samples
    return row
