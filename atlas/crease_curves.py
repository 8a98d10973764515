"""Crease curves: where the polynomials of two patches meet, cut off where a third sheet begins."""

from typing import TYPE_CHECKING

import numpy as np

from touchatlas.atlas.meeting import look, meet
from touchatlas.atlas.table import Table
from touchatlas.patch.arrays import cross

if TYPE_CHECKING:
    from touchatlas.atlas.creases import Creases

_COUNT = 17
# Patches meet where they are no farther from a point, in patch radii, and turn apart by so much.
_MEETS, _LEAST_SINE = 1e-6, 0.2


def crease_curves(table: Table, creases: "Creases", pairs) -> list[np.ndarray]:
    """For each creased pair of rows points (n, 3) along its crease, in order; two or more, or
    none. World, length."""
    if not len(pairs):
        return []
    both = np.array(pairs)
    anchor = np.array([creases.pairs[pair].anchor for pair in pairs])
    points, good, middle = _sampled(table, both, anchor)
    out = []
    for pair, line, keep, start in zip(pairs, points, good, middle.tolist(), strict=True):
        beyond, share = _cut(table, creases, pair, line)
        out.append(_run(line, keep, beyond, share, start))
    return out


def _sampled(table: Table, both, anchor):
    """Points (m, c, 3) where pairs of patches (m, 2) meet, evenly along their common tangent at
    the anchor as far as both balls reach; which are good (m, c); the one at the anchor (m,)."""
    seen = meet(table, both, anchor)
    along = cross(seen.normals[:, 0], seen.normals[:, 1])
    along /= np.maximum(np.sqrt((along * along).sum(axis=1)), np.finfo(float).tiny)[:, None]
    offset = seen.points[:, None] - table.origin[both]
    shift = np.einsum("mki,mi->mk", offset, along)
    square = shift**2 - (offset * offset).sum(axis=2) + table.radius[both] ** 2
    half = np.sqrt(np.maximum(square, 0.0))
    low, high = (-shift - half).max(axis=1), (half - shift).min(axis=1)
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
    way = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _COUNT)
    start = seen.points[:, None] + way[..., None] * along[:, None]
    planes = np.repeat(along, _COUNT, axis=0)[:, None], np.einsum("mci,mi->mc", start, along)
    many = np.repeat(both, _COUNT, axis=0)
    found = meet(table, many, start.reshape(-1, 3), (planes[0], planes[1].reshape(-1, 1)))
    sine = np.sqrt((cross(found.normals[:, 0], found.normals[:, 1]) ** 2).sum(axis=1))
    good = (np.abs(found.distance) <= _MEETS * table.radius[many]).all(axis=1)
    good &= (found.across <= 1.0 + _MEETS).all(axis=1) & (sine >= _LEAST_SINE)
    shape = way.shape
    return found.points.reshape(*shape, 3), good.reshape(shape), np.abs(way).argmin(axis=1)


def _cut(table: Table, creases: "Creases", pair, points):
    """Which points (c, 3) of a crease a third sheet cuts off (c,), and on the way from each of
    them to the next the least share (2, c) at which it does, forward and backward."""
    third = np.array(sorted(creases.behind(pair[0]) & creases.behind(pair[1])), int)
    beyond, share = np.zeros(len(points), bool), np.ones((2, len(points)))
    if not len(third):
        return beyond, share
    rows = np.tile(third, (len(points), 1))
    seen = look(table, rows, points)
    side = np.array([side_of(creases, pair[0], pair[1], k) for k in third.tolist()])
    height = side * seen.distance
    reached = seen.across <= 1.0
    beyond = (reached & (height > 0.0)).any(axis=1)
    both = reached[1:] & reached[:-1]
    for way, (here, there) in enumerate(((height[:-1], height[1:]), (height[1:], height[:-1]))):
        leaves = both & (here <= 0.0) & (there > 0.0)
        rise = np.where(leaves, there - here, 1.0)
        part = np.where(leaves, -here / rise, 1.0).min(axis=1)
        share[way, slice(0, -1) if way == 0 else slice(1, None)] = part
    return beyond, share


def side_of(creases: "Creases", first: int, second: int, third: int) -> int:
    """On which side of a third sheet, 1 inside and -1 outside of it, the crease of two is real.

    Three sheets that meet at a corner bound an intersection of half spaces where all edges are
    convex, a union where all are concave; with one edge of the other kind, of a half space and
    a union of two, or of an intersection of two.
    """
    a, b = creases.sheet_sign(first, third), creases.sheet_sign(second, third)
    return a if a == b else -creases.sign(first, second)


def _run(points, good, beyond, share, start: int) -> np.ndarray:
    """The run of good points about the start, up to where it is cut off."""
    free = np.flatnonzero(good & ~beyond)
    if not len(free):
        return points[:0]
    start = int(free[np.abs(free - start).argmin()])
    line = [points[start]]
    for way, step in ((0, 1), (1, -1)):
        i, more = start, []
        while 0 <= i + step < len(points) and good[i + step]:
            if beyond[i + step]:
                more.append(points[i] + share[way, i] * (points[i + step] - points[i]))
                break
            i += step
            more.append(points[i])
        line = line + more if way == 0 else more[::-1] + line
    return np.array(line) if len(line) > 1 else points[:0]
