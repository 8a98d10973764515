"""Crease curves: where the polynomials of two patches meet, cut off where a third sheet begins."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.graph.creases import Creases, Pair
from touchatlas.atlas.graph.power_diagram import MEETS
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import cross

_COUNT = 17
# Sine of the angle at which two patches cross, at least: less, and where they meet is unsure.
_LEAST_SINE = 0.2


@dataclass(frozen=True)
class Source:
    """What a crease curve is drawn from: curves of equal sources are equal.

    Parameters
    ----------
    pair : (int, int)
        The creased rows.
    anchor : tuple of 3 float, length, world
    thirds : tuple of int
        Rows that may cut the curve off, ascending: both sheets are creased with them.
    sides : tuple of int
        On which side of each third the crease is real.
    numbers : tuple of bytes
        The polynomials and frames of the two rows and of the thirds.
    """

    pair: tuple[int, int]
    anchor: tuple[float, ...]
    thirds: tuple[int, ...]
    sides: tuple[int, ...]
    numbers: tuple[bytes, ...]


class CreaseCurves:
    """The curve of every crease, drawn when it is asked for and kept until its patches change.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    creases : Creases
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours, creases: Creases) -> None:
        self._table, self._neighbours, self.creases = table, neighbours, creases
        self._curves: dict[Pair, np.ndarray] = {}
        self._sources: dict[Pair, Source] = {}
        self._current: set[Pair] = set()

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Curves about rows that changed are to be drawn again, where their source changed."""
        stale = self._neighbours.around(rows)
        stale = stale.union(*(self.creases.of(i) for i in stale))
        self._current = {pair for pair in self._current if stale.isdisjoint(pair)}

    def curve(self, first: int, second: int) -> np.ndarray:
        """(n, 3) points along the crease of two rows, as far as both reach and no third sheet
        cuts it off."""
        pair = min(first, second), max(first, second)
        if pair not in self._current:
            self._draw()
        return self._curves[pair]

    def _draw(self) -> None:
        """Draw the curves that are not current, but for those whose source is as it was."""
        stale = sorted(set(self.creases.pairs) - self._current)
        sources = sources_of(self._table, self.creases, stale)
        anew = [source for source in sources if self._sources.get(source.pair) != source]
        lines = dict(self._curves)
        for source, line in zip(anew, crease_curves(self._table, anew), strict=True):
            self._sources[source.pair], lines[source.pair] = source, line
        self._sources = {pair: self._sources[pair] for pair in self.creases.pairs}
        self._curves = {pair: lines[pair] for pair in self.creases.pairs}
        self._current = set(self.creases.pairs)

    def typical_length(self) -> float:
        """Median over the creases of the distance between their ends; infinite without any."""
        lines = [self.curve(*pair) for pair in self.creases.pairs]
        ends = np.array([line[-1] - line[0] for line in lines if len(line)]).reshape(-1, 3)
        return float(np.median(np.sqrt((ends * ends).sum(axis=1)))) if len(ends) else np.inf


def sources_of(table: PatchTable, creases: Creases, pairs) -> list[Source]:
    """For each creased pair of rows what its curve is drawn from."""
    numbers, out = _Numbers(table), []
    behind = {i: creases.behind(i) for i in {i for pair in pairs for i in pair}}
    for i, j in pairs:
        thirds, own = sorted(behind[i].keys() & behind[j].keys()), creases.sign(i, j)
        sides = tuple(side_of(behind[i][k], behind[j][k], own) for k in thirds)
        anchor = tuple(creases.pairs[i, j].anchor.tolist())
        each = tuple(numbers[k] for k in (i, j, *thirds))
        out.append(Source((i, j), anchor, tuple(thirds), sides, each))
    return out


class _Numbers(dict[int, bytes]):
    """Of each row asked for, what its polynomial and frame are now."""

    def __init__(self, table: PatchTable) -> None:
        super().__init__()
        self._columns = table.origin, table.axes, table.radius, table.mean

    def __missing__(self, row: int) -> bytes:
        self[row] = b"".join(column[row].tobytes() for column in self._columns)
        return self[row]


def crease_curves(table: PatchTable, sources: list[Source]) -> list[np.ndarray]:
    """For each source points (n, 3) along its crease, in order; two or more, or none. World,
    length."""
    if not sources:
        return []
    both = np.array([source.pair for source in sources])
    anchor = np.array([source.anchor for source in sources])
    points, good, middle = _sampled(table, both, anchor)
    out = []
    for source, line, keep, start in zip(sources, points, good, middle.tolist(), strict=True):
        beyond, share = _cut(table, source, line)
        out.append(_run(line, keep, beyond, share, start))
    return out


def _sampled(table: PatchTable, both, anchor):
    """Points (m, c, 3) where pairs of patches (m, 2) meet, evenly along their common tangent at
    the anchor as far as both balls reach; which are good (m, c); the one at the anchor (m,)."""
    seen = intersect(table, both, anchor)
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
    found = intersect(table, many, start.reshape(-1, 3), (planes[0], planes[1].reshape(-1, 1)))
    sine = np.sqrt((cross(found.normals[:, 0], found.normals[:, 1]) ** 2).sum(axis=1))
    good = (np.abs(found.distance) <= MEETS * table.radius[many]).all(axis=1)
    good &= (found.across <= 1.0 + MEETS).all(axis=1) & (sine >= _LEAST_SINE)
    shape = way.shape
    return found.points.reshape(*shape, 3), good.reshape(shape), np.abs(way).argmin(axis=1)


def _cut(table: PatchTable, source: Source, points):
    """Which points (c, 3) of a crease a third sheet cuts off (c,), and on the way from each of
    them to the next the least share (2, c) at which it does, forward and backward."""
    beyond, share = np.zeros(len(points), bool), np.ones((2, len(points)))
    if not source.thirds:
        return beyond, share
    seen = patches_at(table, np.tile(source.thirds, (len(points), 1)), points)
    height = np.array(source.sides) * seen.distance
    reached = seen.across <= 1.0
    beyond = (reached & (height > 0.0)).any(axis=1)
    both = reached[1:] & reached[:-1]
    for way, (here, there) in enumerate(((height[:-1], height[1:]), (height[1:], height[:-1]))):
        leaves = both & (here <= 0.0) & (there > 0.0)
        rise = np.where(leaves, there - here, 1.0)
        part = np.where(leaves, -here / rise, 1.0).min(axis=1)
        share[way, slice(0, -1) if way == 0 else slice(1, None)] = part
    return beyond, share


def side_of(first: int, second: int, own: int) -> int:
    """On which side of a third sheet, 1 inside and -1 outside of it, the crease of two is real:
    by the signs of the creases of the first and the second with the third, and of their own.

    Three sheets that meet at a corner bound an intersection of half spaces where all edges are
    convex, a union where all are concave; with one edge of the other kind, of a half space and
    a union of two, or of an intersection of two.

    >>> side_of(1, 1, 1), side_of(-1, -1, -1), side_of(1, -1, 1)
    (1, -1, -1)
    """
    return first if first == second else -own


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
