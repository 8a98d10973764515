"""The tiling: boundaries and corners of the patches' cells, kept as patches come and go."""

from itertools import combinations

import networkx as nx
import numpy as np

from touchatlas.atlas.graph.power_diagram import (
    CELL_MARGIN,
    CREASE_ANGLE,
    Boundary,
    boundary_curves,
    corners_on,
    corners_with,
    power_at,
)
from touchatlas.atlas.patches.patch_table import PatchTable

Triple = tuple[int, int, int]


class Cells:
    """The power diagram of the patches restricted to the surface, and its dual graph.

    Parameters
    ----------
    table : Table
    neighbours : list of set of int
        Of the atlas; read, never written.

    Attributes
    ----------
    graph : networkx.Graph
        Nodes are patch ids; edges carry a ``boundary`` (Boundary).
    corners : dict
        Ascending triples of ids to the point (3,) where three boundaries meet.
    gaps : dict
        Triples of ids to the point (3,) that their three cores leave uncovered between them.
    """

    def __init__(self, table: PatchTable, neighbours: list[set[int]]) -> None:
        self._table, self._kin = table, neighbours
        self._graph = nx.Graph()
        # Rows whose boundaries are to be drawn anew.
        self._stale: set[int] = set()
        self.corners: dict[Triple, np.ndarray] = {}
        self.gaps: dict[Triple, np.ndarray] = {}
        # Lists: a set of six takes six times the memory.
        self._corners_of: list[list[Triple]] = []

    @property
    def graph(self) -> nx.Graph:
        """The dual graph; boundaries that changed are drawn now."""
        if self._stale:
            pairs = {(min(i, j), max(i, j)) for i in self._stale for j in self._kin[i]}
            self._draw(sorted(pairs))
            self._stale.clear()
        return self._graph

    def add(self, row: int, alive: bool = True) -> None:
        """Enter a node, or a number that is no more in use; boundaries come with ``meet``."""
        self._corners_of.append([])
        if alive:
            self._graph.add_node(row)

    def touch(self, rows) -> None:
        """Boundaries of rows whose polynomials changed are to be drawn anew."""
        self._stale.update(rows)

    def renew(self, rows: set[int]) -> None:
        """Corners and gaps of rows whose polynomials have moved, anew."""
        for triple in {t for i in rows for t in self._corners_of[i]}:
            self._drop(triple)
        self._forget_gaps(rows)
        self._find_around(rows)

    def remove(self, rows: list[int], around: set[int]) -> None:
        """Take nodes out. ``around`` are those that may have got a corner in their place, where
        no new patch has conquered all of theirs."""
        left = {t for i in rows for t in self._corners_of[i]}
        for triple in left:
            self._drop(triple)
        gone = set(rows)
        self._forget_gaps(gone)
        self._graph.remove_nodes_from(rows)
        self._stale -= gone
        if left:
            self._find_around(around)
        self.touch(around)

    def separate_sheets(self, first: int, second: int) -> None:
        """Two rows are no longer kin: they do not meet."""
        for triple in self.corners_of(first, second):
            self._drop(triple)
        for triple in [t for t in self.gaps if first in t and second in t]:
            del self.gaps[triple]
        if self._graph.has_edge(first, second):
            self._graph.remove_edge(first, second)
        about = {first, second}
        self._find_corners(self._around(about | self._kin[first] | self._kin[second]), about)
        self.touch(sorted(about))

    def _forget_gaps(self, rows: set[int]) -> None:
        for triple in [t for t in self.gaps if not rows.isdisjoint(t)]:
            del self.gaps[triple]

    def sharing_corners(self, rows) -> set[int]:
        """Rows that share a corner with any of some rows, and these."""
        return set(rows).union(*(t for i in rows for t in self._corners_of[i]))

    def corners_of(self, first: int, second: int | None = None) -> list[Triple]:
        """The corners on the rim of a patch, or those that two patches share."""
        return [t for t in self._corners_of[first] if second is None or second in t]

    def _enter_corner(self, triple: Triple, point) -> None:
        if triple not in self.corners:
            for i in triple:
                self._corners_of[i].append(triple)
        self.corners[triple] = point

    def _drop(self, triple: Triple) -> None:
        del self.corners[triple]
        for i in triple:
            self._corners_of[i].remove(triple)

    def meet(self, row: int, neighbours: np.ndarray) -> None:
        """Corners and boundaries around a new patch."""
        changed = self._drop_conquered(row, neighbours) + self._find_corners(
            {row: neighbours.tolist()}
        )
        self.touch({row}.union(*changed))

    def conquer(self, row: int, neighbours: np.ndarray) -> None:
        """Give ``row`` the corners of new kin at which it has less power."""
        self.touch(set().union(*self._drop_conquered(row, neighbours)))
        self._find_around({row})

    def _find_around(self, rows: set[int]) -> None:
        """Enter all corners and gaps that touch any of the rows."""
        self._find_corners(self._around(rows | {j for i in rows for j in self._kin[i]}), rows)
        self.touch(rows)

    def _around(self, rows) -> dict[int, list[int]]:
        """The kin of rows, ascending."""
        return {row: sorted(self._kin[row]) for row in sorted(rows)}

    def _find_corners(self, around: dict[int, list[int]], about=None) -> list[Triple]:
        """Enter the corners and gaps of rows with older ones of those around them; returns the
        corners.

        ``about``, a set of rows, leaves out those that touch none of it.
        """
        triples, points, excess = corners_with(self._table, around, self._kin, about)
        found = []
        for triple, point, over in zip(map(tuple, triples.tolist()), points, excess, strict=True):
            if over > CELL_MARGIN:
                self.gaps[triple] = point
                continue
            self._enter_corner(triple, point)
            found.append(triple)
        return found

    def _drop_conquered(self, row: int, neighbours: np.ndarray) -> list[Triple]:
        """Remove, and return, the corners of the kin at which ``row`` has less power."""
        triples = sorted({t for i in neighbours.tolist() for t in self._corners_of[i]})
        near = self._kin[row]
        triples += [t for t in self.gaps if not near.isdisjoint(t)]
        # Of its own corners rounding alone would say which it has.
        triples = [t for t in triples if row not in t]
        if not triples:
            return []
        points = np.array([self.gaps.get(t, self.corners.get(t)) for t in triples])
        table = self._table
        offset = points - table.site[[t[0] for t in triples]]
        own = (offset * offset).sum(axis=1) - table.weight[[t[0] for t in triples]]
        conquered = power_at(table, [row], points)[:, 0] < own
        dropped = [triple for triple, lost in zip(triples, conquered, strict=True) if lost]
        for triple in dropped:
            if self.gaps.pop(triple, None) is None:
                self._drop(triple)
        return dropped

    def _draw(self, pairs: list[tuple[int, int]]) -> None:
        """Make, renew or delete the edges of the given pairs."""
        if not pairs:
            return
        first, second = np.array(pairs).T
        points, gap, angle, real = boundary_curves(self._table, first, second)
        live = self._lowest_on(pairs, points) & real[:, None]
        for e, pair in enumerate(pairs):
            here = live[e]
            if here.any():
                angle_here = float(angle[e][here].max())
                gap_here = gap[e][here]
                boundary = Boundary(
                    pair,
                    points[e][here],
                    float(np.sqrt(gap_here @ gap_here / len(gap_here))),
                    angle_here,
                    angle_here > CREASE_ANGLE,
                )
            elif self.corners_of(*pair):
                boundary = Boundary(pair, points[e][:0], 0.0, 0.0, False)
            else:
                if self._graph.has_edge(*pair):
                    self._graph.remove_edge(*pair)
                continue
            self._graph.add_edge(*pair, boundary=boundary)

    def _lowest_on(self, pairs, points) -> np.ndarray:
        """(e, b) whether no third kin patch has less power than the pair at its points."""
        table = self._table
        rivals = [sorted(self._kin[i] - {j}) for i, j in pairs]
        width = max(1, *map(len, rivals))
        rows = np.array(
            [r + [i] * (width - len(r)) for r, (i, _) in zip(rivals, pairs, strict=True)]
        )
        offset = points[:, :, None] - table.site[rows][:, None]
        rival = (offset * offset).sum(axis=-1) - table.weight[rows][:, None]
        first = [i for i, _ in pairs]
        offset = points - table.site[first][:, None]
        own = (offset * offset).sum(axis=-1) - table.weight[first][:, None]
        return (own <= CELL_MARGIN * table.weight[first][:, None]) & (
            own <= rival.min(axis=2) + 1e-12 * table.weight[first][:, None]
        )

    def mend(self) -> None:
        """Enter and remove the corners on which the polynomials of four patches disagree.

        Where four have about equal power, each triple is judged on a surface of its own. But a
        boundary ends twice: three that lack one end each, and would share it, lack a corner, and
        three with one too many have one too many.
        """
        ends = {pair: len(self.corners_of(*pair)) for pair in self.graph.edges}
        odd = nx.Graph(pair for pair, count in ends.items() if count % 2)
        for triple in [tuple(sorted(c)) for c in nx.enumerate_all_cliques(odd) if len(c) == 3]:
            counts = [len(self.corners_of(*pair)) for pair in combinations(triple, 2)]
            if triple in self.corners and min(counts) == 3:
                self._drop(triple)
            elif triple not in self.corners | self.gaps and counts == [1, 1, 1]:
                first, second, row = triple
                point = corners_on(self._table, *np.array([[row], [first], [second]]))[0]
                if np.isfinite(point).all():
                    self._enter_corner(triple, point)

    def retile(self) -> None:
        """Corners and boundaries of all patches anew, from the polynomials as they are now."""
        self.corners.clear()
        self.gaps.clear()
        self._graph.remove_edges_from(list(self._graph.edges))
        for corners in self._corners_of:
            corners.clear()
        self._find_corners(self._around(self._graph))
        self.touch(self._graph)
