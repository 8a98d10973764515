"""Cells: the part of the surface on which a patch has the least power of its sheet.

Corners, gaps and boundaries of the cells follow from the patches and their neighbours. They are
worked out when they are asked for, and kept until a patch or its surroundings change.
"""

from collections.abc import Iterable, Mapping
from itertools import combinations

import networkx as nx
import numpy as np

from touchatlas.atlas.graph.power_diagram import (
    CELL_MARGIN,
    CREASE_ANGLE,
    Boundary,
    boundary_curves,
    corners_about,
    points_of_equal_power,
    power_at,
)
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.patch_table import PatchTable

Pair = tuple[int, int]
Triple = tuple[int, int, int]
Places = dict[Triple, np.ndarray]


class Cells:
    """The power diagram of the patches of a table, restricted to the surface.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours) -> None:
        self._table, self._neighbours = table, neighbours
        # Of each row its corners and gaps: the point, and the power there over the weight.
        self._places: dict[int, dict[Triple, tuple[np.ndarray, float]]] = {}
        self._boundaries: dict[Pair, Boundary] = {}
        self._stale: set[int] = set()
        self._undrawn: set[int] = set()
        self._mended: tuple[Places, dict[Pair, Boundary]] | None = None

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Corners and boundaries of rows, and of all about them, are to be worked out again."""
        # A corner of a row is judged by the neighbours of its three patches.
        about = self._neighbours.around(self._neighbours.around(rows)).union(rows)
        self._stale |= about
        self._undrawn |= about
        self._mended = None

    def sharing_corners(self, rows: Iterable[int]) -> set[int]:
        """Some rows, and those that have a corner with any of them."""
        corners = (t for t, (_, excess) in self._about(rows).items() if excess <= CELL_MARGIN)
        return set(rows).union(*corners)

    @property
    def corners(self) -> Places:
        """Ascending triples of rows to the point (3,) where three boundaries meet."""
        return self._diagram()[0]

    @property
    def gaps(self) -> Places:
        """Triples of rows to the point (3,) that their three cores leave uncovered."""
        places = self._about(self._table.rows.tolist())
        return {t: point for t, (point, excess) in places.items() if excess > CELL_MARGIN}

    @property
    def boundaries(self) -> Mapping[Pair, Boundary]:
        """Ascending pairs of rows whose cells meet, to the boundary."""
        return self._diagram()[1]

    def _about(self, rows: Iterable[int]) -> dict[Triple, tuple[np.ndarray, float]]:
        """The corners and gaps that any of some rows has."""
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

    def _diagram(self) -> tuple[Places, dict[Pair, Boundary]]:
        """Corners and boundaries of all cells, so that boundaries end in corners."""
        if self._mended is None:
            places = self._about(self._table.rows.tolist())
            corners = {t: p for t, (p, excess) in sorted(places.items()) if excess <= CELL_MARGIN}
            ended = {pair for triple in corners for pair in combinations(triple, 2)}
            boundaries = self._draw(ended)
            corners = mended(self._table, corners, self.gaps, boundaries)
            self._mended = corners, ended_boundaries(boundaries, corners)
        return self._mended

    def _draw(self, ended: set[Pair]) -> dict[Pair, Boundary]:
        """The boundaries of all cells; those of pairs ``ended`` by a corner may have no points."""
        table, neighbours = self._table, self._neighbours
        rows = [row for row in self._undrawn if row in table.index]
        pairs = sorted({(min(i, j), max(i, j)) for i in rows for j in neighbours[i]})
        kept = {p: b for p, b in self._boundaries.items() if self._undrawn.isdisjoint(p)}
        if pairs:
            first, second = np.array(pairs).T
            points, gap, angle, real = boundary_curves(table, first, second)
            live = self._lowest_on(np.array(pairs), points) & real[:, None]
            for e, pair in enumerate(pairs):
                if live[e].any() or pair in ended:
                    here = live[e]
                    kept[pair] = _boundary(pair, points[e][here], gap[e][here], angle[e][here])
        self._boundaries = dict(sorted(kept.items()))
        self._undrawn.clear()
        return self._boundaries

    def _lowest_on(self, pairs, points) -> np.ndarray:
        """(e, b) whether no neighbour of the first of pairs (e, 2) has less power than the two at
        points (e, b, 3)."""
        table, first = self._table, pairs[:, 0]
        rivals = self._neighbours.lines()[first]
        power = power_at(table, rivals[:, None], points)
        power[np.broadcast_to((rivals == pairs[:, 1:])[:, None], power.shape)] = np.inf
        own = power_at(table, pairs[:, None, :1], points)[..., 0]
        weight = table.weight[first][:, None]
        covered = own <= CELL_MARGIN * weight
        return np.asarray(covered & (own <= power.min(axis=2) + 1e-12 * weight))


def ended_boundaries(boundaries: Mapping[Pair, Boundary], corners: Places) -> dict[Pair, Boundary]:
    """The boundaries that have points, or a corner."""
    ended = {pair for triple in corners for pair in combinations(triple, 2)}
    return {pair: b for pair, b in boundaries.items() if len(b.points) or pair in ended}


def _boundary(pair: Pair, points, gap, angle) -> Boundary:
    if not len(points):
        return Boundary(pair, points, 0.0, 0.0, False)
    largest = float(angle.max())
    return Boundary(
        pair, points, float(np.sqrt(np.mean(gap * gap))), largest, largest > CREASE_ANGLE
    )


def mended(table: PatchTable, corners: Places, gaps: Places, boundaries) -> Places:
    """Corners of which each boundary has an even number, as far as that is clear.

    Where four patches have about equal power, each triple is judged on a polynomial of its own,
    and these disagree. But a boundary ends twice: three boundaries that lack one end each, and
    would share it, lack a corner, and three that have one too many have one too many. One with
    no other end, and no point, is none.
    """
    out = dict(corners)
    count = dict.fromkeys(boundaries, 0)
    for pair in (pair for triple in out for pair in combinations(triple, 2)):
        count[pair] += 1
    known = {frozenset(triple) for triple in (*out, *gaps)}
    odd = nx.Graph(pair for pair, ends in count.items() if ends % 2)
    cliques = (sorted(clique) for clique in nx.enumerate_all_cliques(odd) if len(clique) == 3)
    for low, middle, high in sorted(cliques):
        triple, change = (low, middle, high), 0
        pairs = list(combinations(triple, 2))
        if triple in out and all(_has_too_many(count[p], boundaries[p]) for p in pairs):
            del out[triple]
            change = -1
        elif frozenset(triple) not in known and all(count[p] == 1 for p in pairs):
            point = points_of_equal_power(table, *np.array([[high], [low], [middle]]))[0]
            if np.isfinite(point).all():
                out[triple], change = point, 1
        for pair in pairs:
            count[pair] += change
    return out


def _has_too_many(ends: int, boundary: Boundary) -> bool:
    """Whether a boundary with an odd number of corners has one too many."""
    return ends == 3 or (ends == 1 and not len(boundary.points))
