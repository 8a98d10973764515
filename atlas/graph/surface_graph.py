"""SurfaceGraph: which patches meet, where, and at what kind of edge."""

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import combinations

import networkx as nx

from touchatlas.atlas.graph.cells import Cells, Places, ended_boundaries, with_even_ends
from touchatlas.atlas.graph.crease_cells import (
    boundaries_with_creases,
    crease_corners,
    visible_places,
)
from touchatlas.atlas.graph.crease_curves import CreaseCurves
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.outlines import Outlines
from touchatlas.atlas.graph.power_diagram import Boundary
from touchatlas.atlas.graph.row_tuples import Pair
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.graph.visibility import Visibility
from touchatlas.atlas.patches.patch_table import PatchTable


class SurfaceGraph:
    """The relations between the patches of a table, and the places that follow from them.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
        Which patches continue each other's sheet.
    creases : Creases
        Which patches meet at a sharp edge.

    Attributes
    ----------
    curves : CreaseCurves
    visibility : Visibility
    cells : Cells
    outlines : Outlines

    Notes
    -----
    The attributes follow from the patches and the two relations. They are kept until ``mark_stale``
    is called.
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours, creases: Creases) -> None:
        self._table, self.neighbours, self.creases = table, neighbours, creases
        self.curves = CreaseCurves(table, self.neighbours, self.creases)
        self.visibility = Visibility(table, self.neighbours, self.creases, self.curves)
        self.cells = Cells(table, self.neighbours)
        self.outlines = Outlines(table, self.neighbours, self.visibility)
        self._diagram: tuple[Places, Mapping[Pair, Boundary]] | None = None

    def mark_stale(self, rows: Iterable[int]) -> None:
        """The polynomials, neighbours or creases of rows changed: compute what follows again."""
        rows = list(rows)
        about = self.neighbours.around(rows)
        if self.creases:
            self.curves.mark_stale(rows)
            self.visibility.mark_stale()
            about |= self.neighbours.around(set().union(*(self.creases.of(i) for i in about)))
        self.outlines.mark_stale(about)
        self.cells.mark_stale(rows)
        self._diagram = None

    @property
    def corners(self) -> Places:
        """Ascending triples of rows, mapped to the point (3,) where three boundaries meet."""
        return self._current_diagram()[0]

    @property
    def gaps(self) -> Places:
        """Triples of rows, mapped to a point (3,) that their cores leave uncovered."""
        gaps = self.cells.gaps
        if not self.creases:
            return gaps
        return visible_places(self.visibility, gaps) | self._at_creases()[1]

    def gaps_of(self, rows: Iterable[int]) -> Places:
        """The gaps of triples with any of the rows."""
        if not self.creases:
            return self.cells.gaps_of(rows)
        rows = set(rows)
        return {triple: point for triple, point in self.gaps.items() if not rows.isdisjoint(triple)}

    def odd_pairs(self) -> list[Pair]:
        """Ascending pairs of rows whose boundary ends in an odd number of corners: at a hole, or at
        the rim of what was touched."""
        corners, boundaries = self._current_diagram()
        ends = Counter(pair for triple in corners for pair in combinations(triple, 2))
        return [pair for pair in boundaries if ends[pair] % 2]

    def as_networkx(self) -> nx.Graph:
        """The rows in use as nodes, and as edges those whose cells meet, each with its
        ``boundary`` (Boundary)."""
        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(self._table.rows.tolist())
        boundaries = self._current_diagram()[1]
        graph.add_edges_from((*pair, {"boundary": b}) for pair, b in boundaries.items())
        return graph

    def _at_creases(self) -> tuple[Places, Places]:
        """The corners and gaps that creases add."""
        return crease_corners(self._table, self.neighbours, self.creases, self.curves)

    def _current_diagram(self) -> tuple[Places, Mapping[Pair, Boundary]]:
        """Corners and boundaries of all cells, on the near side of the creases and along them."""
        if not self.creases:
            return self.cells.corners, self.cells.boundaries
        if self._diagram is None:
            at_creases, more_gaps = self._at_creases()
            corners = visible_places(self.visibility, self.cells.corners) | at_creases
            gaps = visible_places(self.visibility, self.cells.gaps) | more_gaps
            boundaries = boundaries_with_creases(
                self._table,
                self.neighbours,
                self.curves,
                self.visibility,
                self.cells.boundaries,
                {pair for triple in corners for pair in combinations(triple, 2)},
            )
            corners = with_even_ends(self._table, corners, gaps, boundaries)
            self._diagram = corners, ended_boundaries(boundaries, corners)
        return self._diagram
