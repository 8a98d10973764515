"""Cells: the parts of the surface on which each patch has the least power of its sheet.

Corners, gaps and boundaries of the cells follow from the patches and their neighbours. They are
computed when they are read, and kept until a patch or its surroundings change.
"""

from collections.abc import Iterable, Mapping
from itertools import combinations

import networkx as nx
import numpy as np

from touchatlas.atlas.graph.power_diagram import (
    CELL_MARGIN,
    Boundary,
    boundary_curves,
    corners_about,
    points_of_equal_power,
    power_at,
)
from touchatlas.atlas.graph.row_tuples import Pair, Triple, pair_of, triple_of
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.patch_table import PatchTable

Places = dict[Triple, np.ndarray]

# Rounding of a power, as a fraction of the weight: equal powers are a tie. Doubled, nothing
# changes.
_TIE = 1e-12


class Cells:
    """The power diagram of the patches of a table, restricted to the surface.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours) -> None:
        self._table, self._neighbours = table, neighbours
        # For each row its corners and gaps: the point, and the power there over the weight.
        self._places: dict[int, dict[Triple, tuple[np.ndarray, float]]] = {}
        self._boundaries: dict[Pair, Boundary] = {}
        self._stale: set[int] = set()
        self._stale_boundaries: set[int] = set()
        self._diagram: tuple[Places, dict[Pair, Boundary]] | None = None

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Rows changed: recompute the corners and boundaries near them at the next reading."""
        # Whether a corner is one depends on the neighbours of its three patches.
        about = self._neighbours.around(self._neighbours.around(rows)).union(rows)
        self._stale |= about
        self._stale_boundaries |= about
        self._diagram = None

    @property
    def corners(self) -> Places:
        """Ascending triples of rows, mapped to the point (3,) where three boundaries meet."""
        return self._current_diagram()[0]

    @property
    def gaps(self) -> Places:
        """Ascending triples of rows, mapped to a point (3,) that their cores leave uncovered."""
        return self.gaps_of(self._table.rows.tolist())

    def gaps_of(self, rows: Iterable[int]) -> Places:
        """The same of triples with any of the rows."""
        places = self._about(rows)
        return {t: point for t, (point, excess) in places.items() if excess > CELL_MARGIN}

    @property
    def boundaries(self) -> Mapping[Pair, Boundary]:
        """Ascending pairs of rows whose cells meet, mapped to the boundary."""
        return self._current_diagram()[1]

    def _about(self, rows: Iterable[int]) -> dict[Triple, tuple[np.ndarray, float]]:
        """The corners and gaps of any of the rows."""
        rows = list(rows)
        if missing := sorted(self._stale.intersection(rows)):
            for row in missing:
                self._places[row] = {}
            self._stale.difference_update(missing)
            found = corners_about(self._table, self._neighbours, missing)
            for triple, point, excess in zip(*(column.tolist() for column in found), strict=True):
                for row in set(triple).intersection(missing):
                    self._places[row][tuple(triple)] = np.array(point), excess
        return {t: place for row in rows for t, place in self._places.get(row, {}).items()}

    def _current_diagram(self) -> tuple[Places, dict[Pair, Boundary]]:
        """Corners and boundaries of all cells. Each boundary ends in an even number of corners."""
        if self._diagram is None:
            places = self._about(self._table.rows.tolist())
            corners = {t: p for t, (p, excess) in sorted(places.items()) if excess <= CELL_MARGIN}
            ended = {pair for triple in corners for pair in combinations(triple, 2)}
            boundaries = self._all_boundaries(ended)
            corners = with_even_ends(self._table, corners, self.gaps, boundaries)
            self._diagram = corners, ended_boundaries(boundaries, corners)
        return self._diagram

    def _all_boundaries(self, ended: set[Pair]) -> dict[Pair, Boundary]:
        """The boundaries of all cells; those of pairs ``ended`` by a corner may have no points."""
        table, neighbours, stale = self._table, self._neighbours, self._stale_boundaries
        rows = [row for row in stale if row in table.index]
        pairs = sorted({pair_of(i, j) for i in rows for j in neighbours[i]})
        kept = {pair: b for pair, b in self._boundaries.items() if stale.isdisjoint(pair)}
        if pairs:
            first, second = np.array(pairs).T
            points, gap, angle, real = boundary_curves(table, first, second)
            live = self._lowest_on(np.array(pairs), points) & real[:, None]
            for e, pair in enumerate(pairs):
                if live[e].any() or pair in ended:
                    here = live[e]
                    kept[pair] = _boundary(pair, points[e][here], gap[e][here], angle[e][here])
        self._boundaries = dict(sorted(kept.items()))
        stale.clear()
        return self._boundaries

    def _lowest_on(self, pairs, points) -> np.ndarray:
        """(e, b) whether points (e, b, 3) belong to the boundaries of pairs (e, 2): no neighbour of
        the first row has less power than the pair, and both patches cover the point."""
        table, first = self._table, pairs[:, 0]
        rivals = self._neighbours.lines()[first]
        power = power_at(table, rivals[:, None], points)
        power[np.broadcast_to((rivals == pairs[:, 1:])[:, None], power.shape)] = np.inf
        own = power_at(table, pairs[:, None, :1], points)[..., 0]
        weight = table.weight[first][:, None]
        covered = own <= CELL_MARGIN * weight
        return np.asarray(covered & (own <= power.min(axis=2) + _TIE * weight))


def ended_boundaries(boundaries: Mapping[Pair, Boundary], corners: Places) -> dict[Pair, Boundary]:
    """The boundaries with points, or with a corner."""
    ended = {pair for triple in corners for pair in combinations(triple, 2)}
    return {pair: b for pair, b in boundaries.items() if len(b.points) or pair in ended}


def _boundary(pair: Pair, points, gap, angle) -> Boundary:
    """The boundary of a pair from its points (b, 3), gaps (b,) and angles (b,)."""
    if not len(points):
        return Boundary(pair, points, 0.0, 0.0)
    return Boundary(pair, points, float(np.sqrt(np.mean(gap * gap))), float(angle.max()))


def with_even_ends(table: PatchTable, corners: Places, gaps: Places, boundaries) -> Places:
    """Corners, corrected so that each boundary ends in an even number of them where possible.

    Where four patches have about equal power, each triple is tested on another polynomial, and the
    tests may disagree. But a boundary has two ends. So where three boundaries with one end each
    form a triple, its corner is missing and is added. Where each of the three boundaries of a
    corner has an end too many, the corner is dropped.
    """
    out = dict(corners)
    count = dict.fromkeys(boundaries, 0)
    for pair in (pair for triple in out for pair in combinations(triple, 2)):
        count[pair] += 1
    known = {frozenset(triple) for triple in (*out, *gaps)}
    odd = nx.Graph(pair for pair, ends in count.items() if ends % 2)
    for triple in sorted(triple_of(c) for c in nx.enumerate_all_cliques(odd) if len(c) == 3):
        pairs, change = list(combinations(triple, 2)), 0
        if triple in out and all(_has_too_many(count[p], boundaries[p]) for p in pairs):
            del out[triple]
            change = -1
        elif frozenset(triple) not in known and all(count[p] == 1 for p in pairs):
            first, second, row = np.array(triple)[:, None]
            point = points_of_equal_power(table, row, first, second)[0]
            if np.isfinite(point).all():
                out[triple], change = point, 1
        for pair in pairs:
            count[pair] += change
    return out


def _has_too_many(ends: int, boundary: Boundary) -> bool:
    """Whether a boundary with an odd number of corners has one too many. A boundary with a single
    corner and no points is none."""
    return ends == 3 or (ends == 1 and not len(boundary.points))
