"""SurfaceGraph: which patches meet, and where."""

from collections import Counter
from collections.abc import Iterable
from itertools import combinations

import networkx as nx

from touchatlas.atlas.graph.cells import Cells, Places
from touchatlas.atlas.graph.outlines import Outlines
from touchatlas.atlas.graph.row_tuples import Pair
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.patch_table import PatchTable


class SurfaceGraph:
    """The cells and outlines of the patches of a table, and the graph that follows from them.

    Parameters
    ----------
    table : PatchTable
    neighbours : SheetNeighbours
        Which patches continue each other's sheet.

    Attributes
    ----------
    cells : Cells
    outlines : Outlines

    Notes
    -----
    The attributes follow from the patches and their neighbours. They are kept until ``mark_stale``
    is called.
    """

    def __init__(self, table: PatchTable, neighbours: SheetNeighbours) -> None:
        self._table, self.neighbours = table, neighbours
        self.cells = Cells(table, neighbours)
        self.outlines = Outlines(table, neighbours)

    def mark_stale(self, rows: Iterable[int]) -> None:
        """The polynomials or neighbours of rows changed: compute what follows again."""
        rows = list(rows)
        self.outlines.mark_stale(self.neighbours.around(rows))
        self.cells.mark_stale(rows)

    @property
    def corners(self) -> Places:
        """Ascending triples of rows, mapped to the point (3,) where three boundaries meet."""
        return self.cells.corners

    @property
    def gaps(self) -> Places:
        """Triples of rows, mapped to a point (3,) that their cores leave uncovered."""
        return self.cells.gaps

    def odd_pairs(self) -> list[Pair]:
        """Ascending pairs of rows whose boundary ends in an odd number of corners: at a hole, or at
        the rim of what was touched."""
        ends = Counter(pair for triple in self.corners for pair in combinations(triple, 2))
        return [pair for pair in self.cells.boundaries if ends[pair] % 2]

    def as_networkx(self) -> nx.Graph:
        """The rows in use as nodes, and as edges those whose cells meet, each with its
        ``boundary`` (Boundary)."""
        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(self._table.rows.tolist())
        boundaries = self.cells.boundaries
        graph.add_edges_from((*pair, {"boundary": b}) for pair, b in boundaries.items())
        return graph
