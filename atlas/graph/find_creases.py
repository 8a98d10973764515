"""Which patches are creased: their sheets meet within both, and were touched up to there."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.graph.creases import Crease, Creases
from touchatlas.atlas.graph.power_diagram import CREASE_ANGLE, MEETS
from touchatlas.atlas.graph.sheets import radical_parameter
from touchatlas.atlas.patches.intersect import intersect
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership
from touchatlas.atlas.patches.sample_pool import SamplePool

# A sheet was touched up to its edge when a contour ended at one no farther away than this many
# sampling steps: its last sample is up to one short of it.
_STEPS = 1.5
# Of the samples of a sheet this share must lie on the one side of the other, noise apart.
_ON_ONE_SIDE, _NOISES = 0.98, 4.0
# In smaller patch radii: how far apart the last samples of the two sheets may be, and how far
# about these the two are compared.
_APART, _ABOUT = 0.75, 0.25

# Patches that were once creased stay so down to this fraction of the angle, and this far out in
# patch radii: else they would come and go as patches learn. Closer to one, they do.
_HOLDS, _REACH = 0.6, 1.1


def find_creases(
    table: PatchTable,
    membership: SampleMembership,
    pairs,
    bias: float,
    new: np.ndarray | None = None,
) -> dict[tuple[int, int], Crease]:
    """Which of some pairs of patches are creased, and how.

    Parameters
    ----------
    table : Table
    membership : Learning
    pairs : (m, 2) int
    bias : float, length
        Lack of fit that patches may have.
    new : (n,) int, optional
        Samples of the last row, if it has learned none yet.

    Notes
    -----
    Two sheets that run side by side, the far side of a thin wall or the next finger, meet
    nowhere within both patches, or at no angle that is clearly neither 0 nor 180 degrees; and
    two faces with a fillet between them have no contour that ends at an edge where they would meet.
    """
    if not len(pairs):
        return {}
    both = np.array(pairs)
    first, second = both.T
    offset, _, parameter = radical_parameter(table, first, second)
    start = table.site[first] + np.clip(parameter, 0.0, 1.0)[:, None] * offset
    seen = intersect(table, both, start)
    good = (np.abs(seen.distance) <= MEETS * table.radius[both]).all(axis=1)
    good &= (seen.across <= 1.0).all(axis=1)
    cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
    good &= np.abs(cosine) <= np.cos(CREASE_ANGLE)
    out = {}
    for at in np.flatnonzero(good).tolist():
        i, j = both[at].tolist()
        samples = [
            new if new is not None and k == table.size - 1 else membership.fitted[k] for k in (i, j)
        ]
        sine = float(np.sqrt(1.0 - cosine[at] ** 2))
        crease = _crease(table, membership.pool, (i, j), samples, sine, bias)
        if crease is not None:
            out[min(i, j), max(i, j)] = crease
    return out


def move_anchors(table: PatchTable, creases: Creases, rows) -> None:
    """Move the anchors of the creases of rows that changed onto their patches; drop the creases
    where these no longer meet at an angle."""
    pairs = sorted({(min(i, j), max(i, j)) for i in rows for j in creases.of(i)})
    if not pairs:
        return
    both = np.array(pairs)
    seen = intersect(table, both, np.array([creases.pairs[pair].anchor for pair in pairs]))
    cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
    holds = np.abs(cosine) <= np.cos(_HOLDS * CREASE_ANGLE)
    holds &= (seen.across <= _REACH).all(axis=1)
    holds &= np.abs(seen.distance).max(axis=1) <= MEETS * table.radius[both].min(axis=1)
    for pair, good, point in zip(pairs, holds, seen.points, strict=True):
        if good:
            creases.enter(*pair, Crease(creases.pairs[pair].sign, point))
        else:
            creases.drop(*pair)


def _crease(table: PatchTable, pool: SamplePool, pair, samples, sine, bias) -> Crease | None:
    """How two patches, which cross at an angle, are creased, as far as their samples tell."""
    slack = _NOISES * float(table.measurement_std[list(pair)].max()) + bias
    off = [_heights(table, k, pool.points[n]) for k, n in zip(pair[::-1], samples, strict=True)]
    last = []
    for height, index in zip(off, samples, strict=True):
        near = np.abs(height) / sine <= _STEPS * _steps(pool, index) + slack
        last.append(pool.points[index[near & pool.edges[index]]])
        if not len(last[-1]):
            return None
    apart, nearest = cKDTree(last[1]).query(last[0])
    radius = float(table.radius[list(pair)].min())
    # Next to where a face is notched both sides of the other sheet are touched: so elsewhere.
    for best in np.argsort(apart, kind="stable").tolist():
        if apart[best] > _APART * radius:
            break
        start = 0.5 * (last[0][best] + last[1][nearest[best]])
        anchor = intersect(table, np.array([pair]), start[None])
        sides = set()
        for height, index in zip(off, samples, strict=True):
            offset = pool.points[index] - anchor.points[0]
            near = (offset * offset).sum(axis=1) <= (apart[best] + _ABOUT * radius) ** 2
            sides.add(_side(height[near], slack))
        if (anchor.across <= 1.0).all() and len(sides) == 1 and 0 not in sides:
            return Crease(sides.pop(), anchor.points[0])
    return None


def _side(height, slack: float) -> int:
    """1 where points are below a sheet, by their heights (n,) over it, -1 where they are above,
    0 where they are neither."""
    finite = height[np.isfinite(height)]
    if not len(finite):
        return 0
    low, high = np.quantile(finite, [1.0 - _ON_ONE_SIDE, _ON_ONE_SIDE])
    if high <= slack and low < -slack:
        return 1
    return -1 if low >= -slack and high > slack else 0


def _heights(table: PatchTable, row: int, points) -> np.ndarray:
    """(n,) first-order distances of points (n, 3) from a patch; infinite out of its reach."""
    rows = np.array([row])
    scaled = table.scaled_local(rows, points)
    height, upward = table.surface(rows, scaled)
    off = table.radius[row] * (height / np.sqrt((upward * upward).sum(axis=-1)))[0]
    inside = ((scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0) & (np.abs(off) <= 0.5 * table.radius[row])
    return np.where(inside, off, np.inf)


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
