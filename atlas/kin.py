"""Which patches are of one sheet: the relation along which samples are shared and blended.

Two patches are kin when their discs overlap and, at a point between them, both put the
surface at the same place with the same orientation. Nearness alone is not enough: a thin
wall and the gap between two fingers have close points that are strangers.
"""

import numpy as np

from touchatlas.atlas.moments import SHEET_COSINE, SHEET_GAP
from touchatlas.atlas.table import Table


def radical_share(table: Table, row: int, others: np.ndarray):
    """Offsets (m, 3) to other centres, squared distances (m,), and the share (m,) of the way
    at which both cores have equal power: the radical plane."""
    offset = table.site[others] - table.site[row]
    square = np.maximum((offset * offset).sum(axis=1), np.finfo(float).tiny)
    share = 0.5 * (1.0 + (table.power[row] - table.power[others]) / square)
    return offset, square, share


def kin_of(table: Table, row: int) -> np.ndarray:
    """Rows of the patches that continue the same sheet as ``row``, ascending."""
    offset = table.origin - table.origin[row]
    near = (offset * offset).sum(axis=1) < (table.radius + table.radius[row]) ** 2
    near &= table.alive > 0.0
    near[row] = False
    others = np.flatnonzero(near)
    if not len(others):
        return others
    offset, _, share = radical_share(table, row, others)
    between = table.site[row] + np.clip(share, 0.0, 1.0)[:, None] * offset
    mine = table.scaled_local(np.array([row]), between)
    height, upward = table.surface(np.array([row]), mine)
    mine[..., 2] -= height / upward[..., 2]
    radius, axes = table.radius[row], table.axes[row]
    meeting = mine[0] * radius @ axes + table.origin[row]
    upward = upward[0] @ axes

    theirs = table.scaled_local(others, meeting[:, None])
    gap, their_upward = table.surface(others, theirs)
    their_upward = (their_upward @ table.axes[others])[:, 0]
    lengths = np.sqrt((upward**2).sum(axis=1)), np.sqrt((their_upward**2).sum(axis=1))
    distance = np.abs(gap[:, 0]) * table.radius[others] / lengths[1]
    agree = (upward * their_upward).sum(axis=1) >= SHEET_COSINE * lengths[0] * lengths[1]
    inside = (theirs[:, 0, :2] ** 2).sum(axis=1) <= 1.0
    inside &= (mine[0, :, :2] ** 2).sum(axis=1) <= 1.0
    return others[
        agree & inside & (distance <= SHEET_GAP * np.minimum(radius, table.radius[others]))
    ]
