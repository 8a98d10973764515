"""AtlasState: patches, samples and graph, with the elementary changes that keep them consistent.

The state is what an atlas learned. Cells, outlines and the frontier follow from it: they are
computed when they are read, and ``mark_stale`` tells them what changed.
"""

from collections.abc import Iterable

import networkx as nx
import numpy as np

from touchatlas.atlas.faces.known_law import KnownLaw
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.field.blend import Field
from touchatlas.atlas.graph.cells import Places
from touchatlas.atlas.graph.edge_ends import EdgeEnds
from touchatlas.atlas.graph.frontier import Frontier
from touchatlas.atlas.graph.power_diagram import Boundary
from touchatlas.atlas.graph.rims import Rims
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.graph.surface_graph import SurfaceGraph
from touchatlas.atlas.patches.normal_equations import covariance_of, half_way_deviation, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import SampleMembership, prior_of
from touchatlas.atlas.records.options import AtlasOptions, check_tolerance
from touchatlas.atlas.residual.hyperparameters import ResidualScale
from touchatlas.patch.fit.smoothness import SmoothnessPrior, leftover
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import LocalPolynomial


class AtlasState:
    """What an atlas has learned.

    Parameters
    ----------
    tolerance : float, length
        Error of the surface that is wanted.
    options : AtlasOptions
    scale : float, length, optional
        Unit of the options of the fits. Without it, five standard deviations of the noise of the
        first touch, or the tolerance where that has no noise: so that a looser tolerance costs no
        touch more.

    Attributes
    ----------
    table : PatchTable
        The patches. The id of a patch is its row.
    neighbours : SheetNeighbours
        Which patches continue each other's sheet.
    surface_graph : SurfaceGraph
        Where patches meet: cells, corners, gaps, outlines.
    membership : SampleMembership
        The samples, their owners, and the patches that are fitted to them.
    frontier : Frontier
        The samples that no core covers.
    edge_ends : EdgeEnds
        The contour ends at edges whose far side is unknown.
    rims : Rims
        The contour ends at which contact was lost, and the rims of the surface that they show.
    field : Field
        The blended surface.
    residual_scale : ResidualScale
        Amplitude and correlation length of the residuals.
    known_law : KnownLaw
        What was found when lawful faces were last looked for.
    touches : int
        Number of touches, with those that were refused.
    scale_is_given : bool
        Whether the scale was given, and does not follow from the first touch.
    """

    def __init__(
        self,
        tolerance: float,
        options: AtlasOptions = AtlasOptions(),
        scale: float | None = None,
    ) -> None:
        if not isinstance(options, AtlasOptions):
            raise ValueError(f"options are {options!r}; they must be AtlasOptions")
        self.tolerance = check_tolerance(tolerance)
        self.scale = self.tolerance if scale is None else check_tolerance(scale, "scale")
        self.scale_is_given = scale is not None
        self.options = options
        self.table = PatchTable(options.fit.basis, options.fit.core)
        self.neighbours = SheetNeighbours()
        self.surface_graph = SurfaceGraph(self.table, self.neighbours)
        self.membership = SampleMembership(self.table)
        self.frontier = Frontier(self.table, self.neighbours, self.membership)
        self.edge_ends = EdgeEnds()
        self.rims = Rims(self.membership.pool)
        self.field = Field(self.table, self.surface_graph)
        self.residual_scale = ResidualScale()
        self.known_law = KnownLaw()
        self.touches = 0

    def __len__(self) -> int:
        return len(self.table.index)

    @property
    def graph(self) -> nx.Graph:
        """Patch ids as nodes (see ``patch``), and as edges the pairs that meet, each with its
        ``boundary`` (Boundary): ``weight=lambda i, j, d: d["boundary"].gap_rms`` weighs them. It
        is frozen; its ``copy()`` can be changed."""
        return nx.freeze(self.surface_graph.as_networkx())

    @property
    def corners(self) -> Places:
        """Ascending triples of ids, mapped to the point (3,) where three boundaries meet."""
        return self.surface_graph.corners

    @property
    def gaps(self) -> Places:
        """Triples of ids, mapped to a point (3,) that their cores leave uncovered."""
        return self.surface_graph.gaps

    @property
    def closed(self) -> bool:
        """Whether no sample, edge, outline or gap is open: no place is left to touch."""
        places = len(self.frontier) + len(self.edge_ends)
        return bool(len(self) and not (places or self.open_outlines().any() or self.gaps))

    @property
    def bias(self) -> float:
        """Lack of fit that counts as if it were noise, length."""
        return self.options.bias * self.scale

    @property
    def detail(self) -> float:
        """Lack of fit beyond which the radius of a patch is reduced, length. With filling it is the
        bias: a patch that leaves out more is wrong beyond its samples."""
        return self.bias if self.options.fill else self.options.detail * self.scale

    @property
    def sample_std(self) -> float:
        """Standard deviation of a sample's distance from the surface: the root mean square of the
        noise that contours state, and the lack of fit that is borne, length."""
        table = self.table
        noise = np.sqrt((table.measurement_std[table.rows] ** 2).mean()) if len(self) else 0.0
        return float(np.hypot(noise, self.bias))

    @property
    def body(self) -> LawfulBody | None:
        """The surface of a body whose faces obey laws; None where some do not, or no edge was
        seen."""
        return self.known_law.body

    @property
    def fills(self) -> bool:
        """Whether patches between touches are fitted as touches arrive."""
        return self.options.fill

    @property
    def prior(self) -> SmoothnessPrior:
        """Prior of the next patch, from the feature lengths of the patches so far."""
        return prior_of(self.table.lengths)

    @property
    def parameter_count(self) -> int:
        """Number of coefficients of all patches."""
        return len(self) * self.table.basis.size

    @property
    def point_count(self) -> int:
        """Number of samples of all touches."""
        return len(self.membership.pool)

    def open_outlines(self) -> np.ndarray:
        """(m, 24) whether points of the outlines of the m patches in use are in no cell."""
        return self.surface_graph.outlines.open(self.table.rows)

    def outlines_closed(self) -> float:
        """Fraction of the points of all outlines that are not open; 0 without patches."""
        return float(1.0 - self.open_outlines().mean()) if len(self) else 0.0

    def predicted_deviation(self) -> float:
        """Root mean square over the patches of their deviation half-way to the rim, length;
        infinite without patches."""
        return half_way_deviation(self.table, self.table.rows) if len(self) else float("inf")

    def euler_characteristic(self) -> int:
        """V - E + F of the patch graph: patches, boundaries and corners."""
        return len(self) - self.graph.number_of_edges() + len(self.corners)

    def boundary(self, first: int, second: int) -> Boundary:
        """The boundary of two patches that meet; KeyError if they do not."""
        self.check(first, second)
        beside = self.graph[first]
        if second not in beside:
            raise KeyError(f"patches {first} and {second} do not meet; {first} meets {[*beside]}")
        return beside[second]["boundary"]

    def patch(self, patch_id: int) -> Patch:
        """A copy of the patch of an id, as it is now; KeyError for an unknown id."""
        self.check(patch_id)
        table, i = self.table, patch_id
        return Patch(
            i,
            DarbouxFrame(table.origin[i], table.axes[i]),
            LocalPolynomial(table.basis, table.mean[i].copy(), float(table.radius[i])),
            covariance_of(table, i).copy(),
            float(table.radius[i]),
            table.core,
            float(table.noise[i]),
            float(table.residual[i]),
            int(table.count[i]),
            float(table.condition[i]),
            float(leftover(table.basis, table.length_ratio[i])),
        )

    def check(self, *patch_ids: int) -> None:
        """Raise KeyError unless all are ids of patches in use."""
        for i in patch_ids:
            whole = isinstance(i, int | np.integer) and not isinstance(i, bool)
            if not (whole and i in self.table.index):
                raise KeyError(f"no patch {i!r}; the nodes of the graph are the ids in use")

    def mark_stale(self, rows: Iterable[int]) -> None:
        """Neighbours or samples of rows changed: compute what follows again.

        Where only polynomials changed, it is enough to mark the surface graph.
        """
        rows = list(rows)
        self.surface_graph.mark_stale(rows)
        self.frontier.mark_stale(rows)

    def enter(self, row: int, neighbours: list[int]) -> None:
        """Enter the last row of the table into graph and samples, with its sheet neighbours."""
        self.neighbours.append(neighbours)
        self.membership.append()
        self.mark_stale([row])

    def remove(self, rows: list[int]) -> None:
        """Remove patches. Their samples must have other owners already."""
        self.mark_stale(rows)
        for row in rows:
            self.neighbours.isolate(row)
            self.membership.drop(row)
        self.table.remove(rows)

    def learned(self, rows: np.ndarray) -> None:
        """Solve rows with new samples, and refit those that are due."""
        solve(self.table, rows)
        self.refit(self.membership.outgrown(rows))
        self.surface_graph.mark_stale(rows.tolist())

    def refit(self, rows) -> None:
        """Refit rows to the samples of their sheets: all near that face alike. Where nothing is
        filled, those that the row and its sheet neighbours own."""
        if self.fills:
            known = self.membership.known_about(rows)
        else:
            known = [self.membership.of_sheet(row, self.neighbours[row]) for row in rows.tolist()]
        self.membership.refit(rows, known, self.bias, self.prior, self.options.fit)
        self.surface_graph.mark_stale(rows.tolist())
