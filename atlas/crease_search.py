"""Which patches are creased: their sheets meet within both, and were touched up to there."""

import numpy as np

from touchatlas.atlas.boundary import CREASE_ANGLE
from touchatlas.atlas.creases import Crease
from touchatlas.atlas.kin import radical_share
from touchatlas.atlas.learning import Learning
from touchatlas.atlas.meeting import meet
from touchatlas.atlas.samples import SamplePool
from touchatlas.atlas.table import Table

# A sheet was touched up to its edge when a sample is no farther from it than this many sampling
# steps: the last one before an edge is up to one short of it.
_STEPS = 1.5
# Of the samples of a sheet this share must lie on the one side of the other, noise apart.
_ON_ONE_SIDE, _NOISES = 0.98, 4.0
_MEETS = 1e-6


def find_creases(
    table: Table, learning: Learning, pairs, bias: float, new: np.ndarray | None = None
) -> dict[tuple[int, int], Crease]:
    """Which of some pairs of patches are creased, and how.

    Parameters
    ----------
    table : Table
    learning : Learning
    pairs : (m, 2) int
    bias : float, length
        Lack of fit that patches may have.
    new : (n,) int, optional
        Samples of the last row, if it has learned none yet.

    Notes
    -----
    Two sheets that run side by side, the far side of a thin wall or the next finger, meet
    nowhere within both patches, or at no angle that is clearly neither 0 nor 180 degrees; and
    two faces with a fillet between them were not touched up to where they would meet.
    """
    if not len(pairs):
        return {}
    both = np.array(pairs)
    first, second = both.T
    offset, _, share = radical_share(table, first, second)
    start = table.site[first] + np.clip(share, 0.0, 1.0)[:, None] * offset
    seen = meet(table, both, start)
    good = (np.abs(seen.distance) <= _MEETS * table.radius[both]).all(axis=1)
    good &= (seen.across <= 1.0).all(axis=1)
    cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
    good &= np.abs(cosine) <= np.cos(CREASE_ANGLE)
    # Each centre as seen by the other sheet: both inside it, or both outside.
    home = np.einsum("mki,mki->mk", table.site[both] - seen.points[:, None], seen.normals[:, ::-1])
    good &= home[:, 0] * home[:, 1] > 0.0
    out = {}
    for at in np.flatnonzero(good).tolist():
        i, j = both[at].tolist()
        sign, sine = -int(np.sign(home[at, 0])), float(np.sqrt(1.0 - cosine[at] ** 2))
        slack = _NOISES * float(table.noise[both[at]].max())
        members = [
            new if new is not None and k == table.size - 1 else learning.members[k] for k in (i, j)
        ]
        near = _last_sample(table, learning.pool, members[0], j, sign, sine, slack, bias)
        far = _last_sample(table, learning.pool, members[1], i, sign, sine, slack, bias)
        if near is None or far is None:
            continue
        anchor = meet(table, both[[at]], near[None])
        if (anchor.across <= 1.0).all():
            out[min(i, j), max(i, j)] = Crease(sign, anchor.points[0])
    return out


def _last_sample(table: Table, pool: SamplePool, index, other: int, sign, sine, slack, bias):
    """The sample (3,) of a sheet that is nearest to its crease with another; None when none is
    near, or they are not all on one side of the other."""
    points, rows = pool.points[index], np.array([other])
    scaled = table.scaled_local(rows, points)
    height, upward = table.surface(rows, scaled)
    radius = float(table.radius[other])
    off = radius * (height / np.sqrt((upward * upward).sum(axis=-1)))[0]
    inside = ((scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0) & (np.abs(off) <= 0.5 * radius)
    if not inside.any() or np.quantile(sign * off[inside], _ON_ONE_SIDE) > slack + bias:
        return None
    away = np.where(inside, np.abs(off), np.inf) / sine - _STEPS * _steps(pool, index)
    best = int(away.argmin())
    return points[best] if away[best] <= slack else None


def _steps(pool: SamplePool, index) -> np.ndarray:
    """(n,) distance of samples to the nearer of their neighbours on their contours."""
    points, across, last = pool.points, pool.across, len(pool) - 1
    step = np.full(len(index), np.inf)
    for beside in (np.maximum(index - 1, 0), np.minimum(index + 1, last)):
        offset = points[beside] - points[index]
        length = np.sqrt((offset * offset).sum(axis=1))
        alike = (across[beside] == across[index]).all(axis=1) & (beside != index)
        step = np.where(alike, np.minimum(step, length), step)
    return np.where(np.isfinite(step), step, 0.0)
