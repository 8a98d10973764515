"""Validation: what must hold of every atlas, checked from its parts.

Whatever is kept beside what it follows from is made again and compared.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.check.graph_invariants import graph_violations
from touchatlas.atlas.check.sample_invariants import learning_violations
from touchatlas.atlas.edit.refresh import OUTLINE_MOVED
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN, power_at

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas

# Of unit vectors, and of sums over the same numbers in another order.
_ROUNDING = 1e-9
# So far beside a crease, in core radii, an outline is closed: creases move as patches learn.
_BESIDE = 0.05


def violations(atlas: "Atlas") -> list[str]:
    """What does not hold, a sentence each; empty for a sound atlas."""
    found = [s for check in (_neighbours_are_mutual, _numbers) for s in check(atlas)]
    # What follows would stumble over these.
    if not found:
        found = [*learning_violations(atlas), *graph_violations(atlas)]
    return found or [s for check in (_index, _outlines) for s in check(atlas)]


def _neighbours_are_mutual(atlas: "Atlas") -> Iterator[str]:
    """Kin are mutual and in use; their lines are looked at first, since asking renews them."""
    lines = [set(line) - {row} for row, line in enumerate(atlas.neighbours.lines().tolist())]
    if lines != list(atlas.neighbours):
        yield "the lines of the kin are not the kin"
    alive = set(atlas.table.rows.tolist())
    for row, neighbours in enumerate(atlas.neighbours):
        if not neighbours <= alive or (neighbours and row not in alive):
            yield f"patch {row} is kin to a removed one, or is one"
        elif row in neighbours or any(row not in atlas.neighbours[i] for i in neighbours):
            yield f"kinship of patch {row} is not mutual"


def _numbers(atlas: "Atlas") -> Iterator[str]:
    table, rows = atlas.table, atlas.table.rows
    for name in table.names:
        if name != "outline" and not np.isfinite(getattr(table, name)[rows]).all():
            yield f"{name} is not finite"
    axes = table.axes[rows]
    if not np.allclose(axes @ axes.transpose(0, 2, 1), np.eye(3), atol=_ROUNDING):
        yield "axes are not orthonormal"
    for name in ("radius", "weight", "noise"):
        if (getattr(table, name)[rows] <= 0).any():
            yield f"a {name} is not positive"
    if (table.measurement_std[rows] < 0).any() or (table.condition[rows] < 1.0).any():
        yield "a sensor's noise is negative, or a condition is less than one"
    if ((table.learned[rows] < 0) | (table.learned[rows] > table.count[rows])).any():
        yield "a patch was framed with more samples learned than it knows"
    if (
        not np.isin(table.outline_open, (0.0, 1.0)).all()
        or not np.isin(table.alive, (0.0, 1.0)).all()
    ):
        yield "ring_open or alive is neither 0 nor 1"
    gone = np.setdiff1d(np.arange(table.size), rows)
    if table.radius[gone].any() or table.outline_open[gone].any() or (table.weight[gone] > 0).any():
        yield "a removed patch has a radius, a power or an open outline"


def _index(atlas: "Atlas") -> Iterator[str]:
    """The index holds the balls of the patches, and the running sums are those of their lengths."""
    table, rows = atlas.table, atlas.table.rows
    if not np.array_equal(table.index.rows(), rows):
        yield "the index holds other balls than the patches'"
        return
    for share in (1.0 - 1e-6, 1.0 + 1e-6):
        rim = table.origin[rows] + share * table.radius[rows, None] * table.axes[rows, 0]
        found, which = table.index.near(rim)
        inside = np.zeros(len(rows), bool)
        inside[which[found == rows[which]]] = True
        for row in rows[inside != (share < 1.0)].tolist():
            yield f"the ball of patch {row} in the index is another"
    lengths = np.log(table.radius[rows] / table.length_ratio[rows])
    sums = np.array([len(rows), lengths.sum(), (lengths * lengths).sum()])
    if not np.allclose(table.lengths, sums, rtol=1e-6, atol=1e-6):
        yield "the sums of the lengths are not those of the patches"


def _outlines(atlas: "Atlas") -> Iterator[str]:
    """Outlines lie about their cores, and are open where no kin covers them and no crease is."""
    table, rows = atlas.table, atlas.table.rows
    moved = table.ring_shifts(rows) > OUTLINE_MOVED * (1.0 + _ROUNDING)
    for row in rows[moved & table.ring_fits(rows)].tolist():
        yield f"the outline (ring) of patch {row} is not at its core"
    for row in rows.tolist():
        neighbours = sorted(atlas.neighbours[row])
        power = power_at(table, neighbours, table.outline[row])
        # Touches close what a core covers; what is laid anew is closed by cells, which are wider.
        free = power.min(axis=1, initial=np.inf) > -_ROUNDING * table.weight[row]
        wide = (power > (CELL_MARGIN + _ROUNDING) * table.weight[neighbours]).all(axis=1)
        is_open = table.outline_open[row] > 0
        rows_of, site = np.full(len(free), row), table.site[row]
        beyond, beside = (
            atlas.creases.beyond(rows_of, site + share * (table.outline[row] - site))
            for share in (1.0, 1.0 + _BESIDE)
        )
        if (is_open & (~free | beyond)).any():
            yield f"the outline of patch {row} is open (ring_open) where it is covered"
        if (~is_open & wide & ~beyond & ~beside).any():
            yield f"the outline of patch {row} is closed (ring_open) where nothing covers it"
