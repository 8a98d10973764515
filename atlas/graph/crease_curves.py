"""Crease curves: where the polynomials of two patches intersect, up to a third sheet."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np

from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.power_diagram import MEETS
from touchatlas.atlas.graph.row_tuples import Pair, pair_of
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.intersect import intersect, patches_at
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.arrays import cross

# Number of points along a crease before it is cut off. Doubled, curves take twice the time and
# their chords a quarter of the error.
_COUNT = 17
# Least sine of the angle between two patches on their crease: 12 degrees. At smaller angles the
# place of the crease is uncertain. Doubled, curves end where it falls below 24 degrees.
_LEAST_SINE = 0.2


@dataclass(frozen=True)
class Source:
    """All that a crease curve depends on: equal sources give equal curves.

    Parameters
    ----------
    pair : (int, int)
        The creased rows, ascending.
    anchor : tuple of 3 float, length, world
    thirds : tuple of int
        Rows that may cut the curve off, ascending: the sheets of both rows are creased with them.
    sides : tuple of int
        The side of each third on which the crease exists: 1 inside, -1 outside.
    numbers : tuple of bytes
        Polynomials and frames of the two rows and of the thirds.
    """

    pair: tuple[int, int]
    anchor: tuple[float, ...]
    thirds: tuple[int, ...]
    sides: tuple[int, ...]
    numbers: tuple[bytes, ...]


class CreaseCurves:
    """The curve of every crease, computed when it is read and kept until its patches change.

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
        """Rows changed: compute the curves near them again, if their sources differ."""
        stale = self._neighbours.around(rows)
        stale = stale.union(*(self.creases.of(i) for i in stale))
        self._current = {pair for pair in self._current if stale.isdisjoint(pair)}

    def curve(self, first: int, second: int) -> np.ndarray:
        """(n, 3) points along the crease of two rows, world: within both patch radii, up to the
        third sheets. n is 0 where nothing of it is left."""
        pair = pair_of(first, second)
        if pair not in self._current:
            self._update()
        return self._curves[pair]

    def _update(self) -> None:
        """Compute the curves that are stale and whose source differs."""
        stale = sorted(set(self.creases.pairs) - self._current)
        sources = sources_of(self._table, self.creases, stale)
        changed = [source for source in sources if self._sources.get(source.pair) != source]
        for source, line in zip(changed, crease_curves(self._table, changed), strict=True):
            self._sources[source.pair], self._curves[source.pair] = source, line
        self._sources = {pair: self._sources[pair] for pair in self.creases.pairs}
        self._curves = {pair: self._curves[pair] for pair in self.creases.pairs}
        self._current = set(self.creases.pairs)

    def typical_length(self) -> float:
        """Median over the creases of the distance between their ends, length; infinite without
        creases."""
        lines = [self.curve(*pair) for pair in self.creases.pairs]
        ends = np.array([line[-1] - line[0] for line in lines if len(line)]).reshape(-1, 3)
        return float(np.median(np.sqrt((ends * ends).sum(axis=1)))) if len(ends) else np.inf


def sources_of(table: PatchTable, creases: Creases, pairs) -> list[Source]:
    """The source of the curve of each creased pair of rows, ascending."""
    columns, out = (table.origin, table.axes, table.radius, table.mean), []

    @cache
    def numbers(row: int) -> bytes:
        return b"".join(column[row].tobytes() for column in columns)

    behind = {i: creases.behind(i) for i in {i for pair in pairs for i in pair}}
    for i, j in pairs:
        thirds, own = sorted(behind[i].keys() & behind[j].keys()), creases.sign(i, j)
        sides = tuple(side_of(behind[i][k], behind[j][k], own) for k in thirds)
        anchor = tuple(creases.pairs[i, j].anchor.tolist())
        each = tuple(numbers(k) for k in (i, j, *thirds))
        out.append(Source((i, j), anchor, tuple(thirds), sides, each))
    return out


def crease_curves(table: PatchTable, sources: list[Source]) -> list[np.ndarray]:
    """Points (n, 3) along the crease of each source, in order, world; n is 0, or 2 and more."""
    if not sources:
        return []
    both = np.array([source.pair for source in sources])
    anchor = np.array([source.anchor for source in sources])
    points, good, middle = _sampled(table, both, anchor)
    out = []
    for source, line, keep, start in zip(sources, points, good, middle.tolist(), strict=True):
        beyond, fraction = _cut(table, source, line)
        out.append(_run(line, keep, beyond, fraction, start))
    return out


def _sampled(table: PatchTable, both, anchor):
    """Sampled intersections of pairs of patches (m, 2), near their anchors (m, 3).

    Returns
    -------
    points : (m, c, 3) float
        In planes evenly spaced along the common tangent at the anchor, within both patch balls.
    good : (m, c) bool
        Whether the patches intersect there, within both radii and at a sufficient angle.
    middle : (m,) int
        Which point is at the anchor.
    """
    seen = intersect(table, both, anchor)
    along = cross(seen.normals[:, 0], seen.normals[:, 1])
    along /= np.maximum(np.sqrt((along * along).sum(axis=1)), np.finfo(float).tiny)[:, None]
    offset = seen.points[:, None] - table.origin[both]
    shift = np.einsum("mki,mi->mk", offset, along)
    square = shift**2 - (offset * offset).sum(axis=2) + table.radius[both] ** 2
    half = np.sqrt(np.maximum(square, 0.0))
    low, high = (-shift - half).max(axis=1), (half - shift).min(axis=1)
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
    steps = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _COUNT)
    start = seen.points[:, None] + steps[..., None] * along[:, None]
    planes = np.repeat(along, _COUNT, axis=0)[:, None], np.einsum("mci,mi->mc", start, along)
    many = np.repeat(both, _COUNT, axis=0)
    found = intersect(table, many, start.reshape(-1, 3), (planes[0], planes[1].reshape(-1, 1)))
    sine = np.sqrt((cross(found.normals[:, 0], found.normals[:, 1]) ** 2).sum(axis=1))
    good = (np.abs(found.distance) <= MEETS * table.radius[many]).all(axis=1)
    good &= (found.across <= 1.0 + MEETS).all(axis=1) & (sine >= _LEAST_SINE)
    shape = steps.shape
    return found.points.reshape(*shape, 3), good.reshape(shape), np.abs(steps).argmin(axis=1)


def _cut(table: PatchTable, source: Source, points):
    """Which points (c, 3) of a crease lie beyond a third sheet (c,), and the least fraction (2, c)
    of the step from each point to the next, forward and backward, at which a third is crossed."""
    beyond, fraction = np.zeros(len(points), bool), np.ones((2, len(points)))
    if not source.thirds:
        return beyond, fraction
    seen = patches_at(table, np.tile(source.thirds, (len(points), 1)), points)
    height = np.array(source.sides) * seen.distance
    reached = seen.across <= 1.0
    beyond = (reached & (height > 0.0)).any(axis=1)
    both = reached[1:] & reached[:-1]
    for way, (here, there) in enumerate(((height[:-1], height[1:]), (height[1:], height[:-1]))):
        leaves = both & (here <= 0.0) & (there > 0.0)
        rise = np.where(leaves, there - here, 1.0)
        least = np.where(leaves, -here / rise, 1.0).min(axis=1)
        fraction[way, slice(0, -1) if way == 0 else slice(1, None)] = least
    return beyond, fraction


def side_of(first: int, second: int, own: int) -> int:
    """On which side of a third sheet the crease of two sheets exists: 1 inside, -1 outside.

    The arguments are the signs of the creases of the first and of the second sheet with the third,
    and the sign of their own crease. Three sheets at a corner bound the intersection of their half
    spaces where all edges are convex, and the union where all are concave. With one edge of the
    other kind, they bound a half space combined with the union or intersection of the others.

    >>> side_of(1, 1, 1), side_of(-1, -1, -1), side_of(1, -1, 1)
    (1, -1, -1)
    """
    return first if first == second else -own


def _run(points, good, beyond, fraction, start: int) -> np.ndarray:
    """The unbroken run of good points about the start, up to where a third sheet cuts it off."""
    free = np.flatnonzero(good & ~beyond)
    if not len(free):
        return points[:0]
    start = int(free[np.abs(free - start).argmin()])
    line = [points[start]]
    for way, step in ((0, 1), (1, -1)):
        i, more = start, []
        while 0 <= i + step < len(points) and good[i + step]:
            if beyond[i + step]:
                more.append(points[i] + fraction[way, i] * (points[i + step] - points[i]))
                break
            i += step
            more.append(points[i])
        line = line + more if way == 0 else more[::-1] + line
    return np.array(line) if len(line) > 1 else points[:0]
