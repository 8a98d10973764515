"""Finding creases: pairs of patches that intersect where samples of both end at an edge."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.graph.creases import Crease, Creases
from touchatlas.atlas.graph.edge_ends import EDGE_STEPS
from touchatlas.atlas.graph.power_diagram import CREASE_ANGLE, MEETS
from touchatlas.atlas.graph.row_tuples import Pair, pair_of
from touchatlas.atlas.graph.sheets import radical_parameter
from touchatlas.atlas.patches.intersect import HEIGHT_LIMIT, intersect
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership
from touchatlas.atlas.patches.sample_pool import SamplePool

# Fraction of the samples of a sheet that must lie on one side of the other sheet. Closer to one, a
# single bad contact hides a crease.
_ON_ONE_SIDE = 0.98
# Distance within which samples count as lying on a sheet, in standard deviations of a sample.
# Doubled, small steps between faces are no creases.
_NOISES = 4.0
# Largest distance between the last samples of the two sheets, in the smaller patch radius. Doubled,
# it is longer than most overlaps, and rules nothing out.
_APART = 0.75
# Distance by which the compared samples may be farther from the anchor than the last samples are
# apart, in the smaller patch radius. Doubled, notches and other edges come into the comparison.
_ABOUT = 0.25
# Fraction of CREASE_ANGLE, and distance of the anchor from the origins in patch radii, up to which
# a known crease is kept. With 1 and 1, creases would come and go with each touch.
_KEPT_ANGLE, _KEPT_REACH = 0.6, 1.1


def find_creases(
    table: PatchTable,
    membership: SampleMembership,
    pairs,
    bias: float,
    new: np.ndarray | None = None,
) -> dict[Pair, Crease]:
    """The creases of those pairs of patches that have one, by ascending pairs.

    Parameters
    ----------
    table : PatchTable
    membership : SampleMembership
    pairs : (m, 2) int
    bias : float, length
        Lack of fit that patches may have.
    new : (n,) int, optional
        Samples of the last row, if its equations are still empty.

    Notes
    -----
    Sheets side by side, as the two sides of a thin wall or two fingers, intersect nowhere within
    both patches, or at an angle near 0 or 180 degrees. Two faces with a fillet between them have no
    contour that ends at an edge where they intersect.
    """
    if not len(pairs):
        return {}
    out = {}
    both, cosines = _crossing(table, np.array(pairs))
    for (i, j), cosine in zip(both.tolist(), cosines, strict=True):
        samples = [
            new if new is not None and k == table.size - 1 else membership.fitted[k] for k in (i, j)
        ]
        sine = float(np.sqrt(1.0 - cosine**2))
        crease = _crease(table, membership.pool, (i, j), samples, sine, bias)
        if crease is not None:
            out[pair_of(i, j)] = crease
    return out


def _crossing(table: PatchTable, pairs):
    """The pairs (m, 2) of rows that intersect at more than CREASE_ANGLE, and the cosines of the
    angles there (m,)."""
    first, second = pairs.T
    offset, _, parameter = radical_parameter(table, first, second)
    start = table.site[first] + np.clip(parameter, 0.0, 1.0)[:, None] * offset
    seen = intersect(table, pairs, start)
    cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
    good = (np.abs(seen.distance) <= MEETS * table.radius[pairs]).all(axis=1)
    good &= (seen.across <= 1.0).all(axis=1) & (np.abs(cosine) <= np.cos(CREASE_ANGLE))
    return pairs[good], cosine[good]


def move_anchors(table: PatchTable, creases: Creases, rows) -> None:
    """Move the anchors of the creases of changed rows back onto both patches, and drop the creases
    of patches that no longer intersect at an angle."""
    pairs = sorted({pair_of(i, j) for i in rows for j in creases.of(i)})
    if not pairs:
        return
    both = np.array(pairs)
    seen = intersect(table, both, np.array([creases.pairs[pair].anchor for pair in pairs]))
    cosine = (seen.normals[:, 0] * seen.normals[:, 1]).sum(axis=1)
    holds = np.abs(cosine) <= np.cos(_KEPT_ANGLE * CREASE_ANGLE)
    holds &= (seen.across <= _KEPT_REACH).all(axis=1)
    holds &= np.abs(seen.distance).max(axis=1) <= MEETS * table.radius[both].min(axis=1)
    for pair, good, point in zip(pairs, holds, seen.points, strict=True):
        if good:
            creases.enter(*pair, Crease(creases.pairs[pair].sign, point))
        else:
            creases.drop(*pair)


def _crease(table: PatchTable, pool: SamplePool, pair, samples, sine, bias) -> Crease | None:
    """The crease of two patches that intersect, if both have samples at the edge, and the samples
    near it lie on one side of the other patch. ``sine`` is that of the angle between them."""
    slack = _NOISES * float(table.measurement_std[list(pair)].max()) + bias
    off = [_heights(table, k, pool.points[n]) for k, n in zip(pair[::-1], samples, strict=True)]
    last = []
    for height, index in zip(off, samples, strict=True):
        near = np.abs(height) / sine <= EDGE_STEPS * _sampling_steps(pool, index) + slack
        last.append(pool.points[index[near & pool.edges[index]]])
        if not len(last[-1]):
            return None
    apart, nearest = cKDTree(last[1]).query(last[0])
    radius = float(table.radius[list(pair)].min())
    # Near a notch, samples lie on both sides of the other sheet: try the next nearest place.
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
    """1 if points with heights (n,) over a sheet lie below it, -1 if above it, 0 if neither."""
    finite = height[np.isfinite(height)]
    if not len(finite):
        return 0
    low, high = np.quantile(finite, [1.0 - _ON_ONE_SIDE, _ON_ONE_SIDE])
    if high <= slack and low < -slack:
        return 1
    return -1 if low >= -slack and high > slack else 0


def _heights(table: PatchTable, row: int, points) -> np.ndarray:
    """(n,) first-order distances of points (n, 3) from a patch; infinite where it does not hold."""
    rows = np.array([row])
    scaled = table.scaled_local(rows, points)
    height, upward = table.surface(rows, scaled)
    off = table.radius[row] * (height / np.sqrt((upward * upward).sum(axis=-1)))[0]
    inside = (scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0
    inside &= np.abs(off) <= HEIGHT_LIMIT * table.radius[row]
    return np.where(inside, off, np.inf)


def _sampling_steps(pool: SamplePool, index) -> np.ndarray:
    """(n,) distances of samples ``index`` (n,) to the nearer sample beside them on the contour."""
    points, across, last = pool.points, pool.across, len(pool) - 1
    step = np.full(len(index), np.inf)
    for beside in (np.maximum(index - 1, 0), np.minimum(index + 1, last)):
        offset = points[beside] - points[index]
        length = np.sqrt((offset * offset).sum(axis=1))
        alike = (across[beside] == across[index]).all(axis=1) & (beside != index)
        step = np.where(alike, np.minimum(step, length), step)
    return np.where(np.isfinite(step), step, 0.0)
