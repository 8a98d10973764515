"""Renew: the patches between touches are made again where a touch brought samples."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.edit.fill import fill_about
from touchatlas.atlas.edit.filling_fits import Sites, fits_at, follows
from touchatlas.atlas.edit.replace import are_upright, replace_by
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.state import AtlasState

# A patch is refitted from all samples near it, and judged, when its sample count has grown by this
# factor since its last fit. Doubled, the frames and priors of patches lag behind their samples.
_GROWN = 1.2
# A filled patch is removed, and others are fitted in its place, where new samples are this fraction
# of its own: it was hardly more than a guess. Doubled, more guesses stay.
_MUCH = 0.3


def remove_filled(state: AtlasState, points, kept: int | None) -> tuple[set[int], np.ndarray]:
    """Remove the filled patches, but ``kept``, that would learn much from samples at points (n, 3).

    Returns the sheet neighbours that they had, and the samples (m,) that they were fitted to.
    """
    near, count = np.unique(state.table.index.near(points)[0], return_counts=True)
    much = near[count > _MUCH * state.table.count[near]].tolist()
    rows = [row for row in much if state.membership.is_filled(row) and row != kept]
    samples = state.membership.fitted_by(rows)
    around = state.neighbours.around(rows) - set(rows)
    state.remove(rows)
    return around, samples


def learn_along(state: AtlasState, index, learned: set[int]) -> set[int]:
    """Let the patches near new samples ``index`` (n,) learn those of their sheets, but the rows
    that have ``learned`` them; returns the rows that did."""
    points = state.membership.pool.points[index]
    near = np.unique(state.table.index.near(points)[0])
    rows = np.array([row for row in near.tolist() if row not in learned], int)
    if not len(rows):
        return set()
    before = state.table.count[rows].copy()
    state.membership.learn(rows, index)
    rows = rows[state.table.count[rows] > before]
    state.learned(rows)
    return set(rows.tolist())


def replace_misfits(state: AtlasState, rows: set[int], refitted) -> np.ndarray:
    """Replace those of the rows that no longer follow their samples: a patch of a touch by a
    smaller one that does, and a filled one by those that are filled next.

    Unless it is steep, a patch is judged when it was ``refitted`` (m,): where samples contradict
    each other it would be replaced at each touch. Returns the samples (n,) that they were fitted
    to.
    """
    table, is_filled = state.table, state.membership.is_filled
    misfits = np.array(sorted(row for row in rows if table.alive[row]), int)
    good = ~np.isin(misfits, refitted)
    good[~good] = follows(state, table, misfits[~good])
    good &= are_upright(table, misfits)
    misfits = misfits[~good]
    samples = state.membership.fitted_by(misfits.tolist())
    filled = [row for row in misfits.tolist() if is_filled(row)]
    state.remove(filled)
    touched = np.setdiff1d(misfits, filled)
    fits = fits_at(state, Sites(table.origin[touched], table.axes[touched, 2], touched))
    for row, filling in zip(touched.tolist(), fits, strict=True):
        if filling is not None and table.alive[row]:
            replace_by(state, row, filling.fit)
    return samples


def renewed(
    state: AtlasState, before: set[int], changed: set[int], samples, change: AtlasChange
) -> AtlasChange:
    """Refit the rows ``changed`` that have many new samples, fill about samples (n,), and return
    the change since the rows were ``before``. Where faces describe the whole body, no patch between
    touches is needed."""
    alive = state.table.alive
    rows = np.array(sorted(row for row in changed if alive[row]), int)
    due = rows[state.table.count[rows] >= _GROWN * state.table.learned[rows]]
    state.refit(due)
    samples = np.union1d(samples, replace_misfits(state, changed, due))
    filled = fill_about(state, samples) if state.body is None else AtlasChange()
    after = set(state.table.rows.tolist())
    changed = changed.union(filled.changed) & after & before
    return replace(
        change,
        added=tuple(sorted(after - before)),
        changed=tuple(sorted(changed)),
        removed=tuple(sorted(before - after)),
    )
