"""Atlas: the one mutable object, a graph of patches that grows touch by touch."""

import networkx as nx
import numpy as np

from touchatlas.atlas.check.invariants import violations
from touchatlas.atlas.edit.fill import fill
from touchatlas.atlas.edit.insert import learn
from touchatlas.atlas.edit.merge import merged_fit, replace_by
from touchatlas.atlas.edit.refresh import update_creases
from touchatlas.atlas.edit.simplify import simplify
from touchatlas.atlas.edit.split import divide, parts_of
from touchatlas.atlas.field.blend import Blend, blend
from touchatlas.atlas.graph.cells import Cells, Triple
from touchatlas.atlas.graph.crease_cells import crease_corners, graph_with_creases, visible
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.edge_ends import EdgeEnds
from touchatlas.atlas.graph.frontier import Frontier
from touchatlas.atlas.graph.power_diagram import Boundary
from touchatlas.atlas.graph.sheets import SheetNeighbours
from touchatlas.atlas.patches.normal_equations import covariance_of, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.prediction import half_way_deviation
from touchatlas.atlas.patches.sample_membership import SampleMembership, prior_of
from touchatlas.atlas.records.change import AtlasChange
from touchatlas.atlas.records.options import AtlasOptions, check_tolerance
from touchatlas.atlas.records.touch import Touch
from touchatlas.atlas.residual.hyperparameters import ResidualScale
from touchatlas.atlas.residual.learn_residuals import learn_residuals
from touchatlas.patch.fit.smoothness import SmoothnessPrior, leftover
from touchatlas.patch.geometry.frame import DarbouxFrame
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import LocalPolynomial


class Atlas:
    """A graph of Darboux-frame patches that share their samples and meet at boundaries.

    Parameters
    ----------
    tolerance : float, length
        How well the surface is wanted.
    options : AtlasOptions

    Attributes
    ----------
    table : Table
        The patches' numbers, a row an id.
    neighbours : list of set of int
        For each patch, the patches that continue its sheet within reach.
    creases : Creases
        Which patches meet at an edge.
    cells : Tiling
        Boundaries, corners and gaps.
    frontier : Frontier
    edge_ends : EdgeEnds
    touches : int
    """

    def __init__(self, tolerance: float, options: AtlasOptions = AtlasOptions()) -> None:
        if not isinstance(options, AtlasOptions):
            raise ValueError(f"options are {options!r}; they must be AtlasOptions")
        self.tolerance = check_tolerance(tolerance)
        self.options = options
        self.table = PatchTable(options.fit.basis, options.fit.core)
        self.neighbours = SheetNeighbours()
        self.creases = self.neighbours.creases = Creases(self.table, self.neighbours)
        self.cells = Cells(self.table, self.neighbours)
        self.membership = SampleMembership(self.table)
        self.frontier = Frontier()
        self.edge_ends = EdgeEnds()
        self.touches = 0
        self.residual_scale = ResidualScale()

    def __len__(self) -> int:
        return len(self.table.rows)

    @property
    def graph(self) -> nx.Graph:
        """Nodes are patch ids (see ``patch``); edges carry a ``boundary`` (Boundary). To be read:
        networkx refuses to change it, but its ``copy()``."""
        if not self.creases:
            return self.cells.graph.copy(as_view=True)
        table, neighbours = self.table, self.neighbours
        return nx.freeze(
            graph_with_creases(table, neighbours, self.creases, self.cells, self.corners)
        )

    @property
    def corners(self) -> dict[Triple, np.ndarray]:
        """Ascending triples of ids to the point (3,) where three boundaries meet."""
        smooth = visible(self.creases, self.cells.corners)
        if not self.creases:
            return smooth
        return smooth | crease_corners(self.table, self.neighbours, self.creases)[0]

    @property
    def gaps(self) -> dict[Triple, np.ndarray]:
        """Triples of ids to the point (3,) that their three cores leave uncovered."""
        gaps = visible(self.creases, self.cells.gaps)
        if not self.creases:
            return gaps
        return gaps | crease_corners(self.table, self.neighbours, self.creases)[1]

    @property
    def bias(self) -> float:
        """Lack of fit that a patch may have, length."""
        return self.options.bias * self.tolerance

    @property
    def parameter_count(self) -> int:
        """Coefficients over all patches."""
        return len(self) * self.table.basis.size

    @property
    def point_count(self) -> int:
        """Samples over all touches."""
        return len(self.membership.pool)

    @property
    def prior(self) -> SmoothnessPrior:
        """What the patches so far say about the feature length of the next."""
        return prior_of(self.table.lengths)

    def patch(self, patch_id: int) -> Patch:
        """The patch of an id, as it is now."""
        self._check(patch_id)
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

    def _check(self, *patch_ids: int) -> None:
        for i in patch_ids:
            whole = isinstance(i, int | np.integer) and not isinstance(i, bool)
            if not (whole and i in self.table.index):
                raise KeyError(f"no patch {i!r}; the nodes of the graph are the ids in use")

    def blend(self, points) -> Blend:
        """Signed distance, normal, deviation and curvature at world points (n, 3)."""
        return blend(self.table, self.neighbours, points)

    def predicted_coverage(self) -> float:
        """Share of the patches' outlines that other patches cover: 1 when nothing is open."""
        rows = self.table.rows
        return float(1.0 - self.table.outline_open[rows].mean()) if len(rows) else 0.0

    def predicted_deviation(self) -> float:
        """Root mean square over the patches of their deviation half-way to the rim, length."""
        return half_way_deviation(self.table, self.table.rows) if len(self) else float("inf")

    def boundary(self, first: int, second: int) -> Boundary:
        """The boundary of two patches that meet; KeyError where they do not."""
        self._check(first, second)
        beside = self.graph[first]
        if second not in beside:
            raise KeyError(f"patches {first} and {second} do not meet; {first} meets {[*beside]}")
        return beside[second]["boundary"]

    def add(self, touch: Touch) -> AtlasChange:
        """Learn one touch: a new patch, better neighbours, new boundaries, a new frontier.

        Returns
        -------
        AtlasChange
            With ``refused`` set, and nothing changed, when the contours are too few or too
            short for a patch, or one of them was learned before.

        Raises
        ------
        ValueError
            What is no Touch, or an approach tangent to the surface; nothing is changed.
        """
        change = learn(self, touch)
        self.touches += 1
        return change

    def enter(self, row: int, neighbours: list[int]) -> None:
        """Make a row of the table a node, kin to others."""
        nothing = np.zeros(0, np.int32)
        self.neighbours.append(set(neighbours))
        for i in neighbours:
            self.neighbours[i].add(row)
        self.membership.fitted.append(nothing)
        self.membership.owned.append(nothing)
        self.cells.add(row)

    def learned(self, rows: np.ndarray) -> tuple[int, ...]:
        """Solve rows that learned new samples; frame anew those that are due.

        Returns those of them that do not hold what they have learned: they leave out more than
        a residual is to explain.
        """
        solve(self.table, rows)
        due = self.membership.outgrown(rows)
        self.refit(due)
        self.cells.touch(rows.tolist())
        return self._too_large(due)

    def _too_large(self, rows: np.ndarray) -> tuple[int, ...]:
        table = self.table
        rim = leftover(table.basis, table.length_ratio[rows]) * table.core ** (
            table.basis.degree + 1
        )
        most = self.options.detail * self.tolerance
        return tuple(rows[rim * table.radius[rows] > most].tolist())

    def refit(self, rows) -> None:
        """Choose frames and priors of patches anew, from all samples about them."""
        candidates = [
            self.membership.known_about(row, self.neighbours[row]) for row in rows.tolist()
        ]
        self.membership.refit(rows, candidates, self.bias, self.prior, self.options.fit)

    def merge(self, first: int, second: int) -> AtlasChange:
        """One patch in the place of two that meet, and of all that it covers, when one polynomial
        holds their samples within the noise; refused otherwise."""
        self._check(first, second)
        if first == second:
            raise ValueError(f"both patches are {first}; give two that meet")
        if second not in self.neighbours[first]:
            return AtlasChange(refused=f"patches {first} and {second} are not of one sheet")
        fit = merged_fit(self, first, second)
        merged = None if fit is None else replace_by(self, fit)
        if merged is None:
            return AtlasChange(refused=f"no one polynomial holds patches {first} and {second}")
        row, gone = merged
        added = () if row in gone else (row,)
        return AtlasChange(added, tuple(sorted(self.neighbours[row])), gone, (), gone)

    def split(self, patch_id: int) -> AtlasChange:
        """Patches of half the radius in the place of one: seven, but for those that lie beyond
        edges or have no cell; refused where the samples do not determine all of them."""
        self._check(patch_id)
        parts = parts_of(self, patch_id)
        if parts is None:
            return AtlasChange(refused=f"too few samples about patch {patch_id} for smaller ones")
        rows = divide(self, patch_id, parts)
        return AtlasChange(rows, (), (), (patch_id,), (patch_id,))

    def simplify(self) -> AtlasChange:
        """Merge whatever one patch explains, pair by pair, until nothing more can be."""
        return simplify(self)

    def fill(self) -> AtlasChange:
        """Patches where samples lie between patches, though no touch had its place there: for a
        surface of few touches. After ``refit_all``, which chooses again what they lean on."""
        return fill(self)

    def euler_characteristic(self) -> int:
        """V - E + F of the patch graph: patches, boundaries and corners."""
        return len(self) - self.graph.number_of_edges() + len(self.corners)

    def learn_residuals(self) -> int:
        """Detail finer than the patches, where the evidence asks for it; how many have it.

        To be called when the surface is wanted: a patch that learns from a later touch loses its
        residual.
        """
        before = set(self.table.residuals)
        self.residual_scale = learn_residuals(self.table, self.membership, self.prior)
        if changed := before | set(self.table.residuals):
            update_creases(self, sorted(changed))
            self.cells.retile()
            self.cells.mend()
        return len(self.table.residuals)

    @property
    def closed(self) -> bool:
        """Whether the patches cover all that they border on: nothing is left to be touched."""
        places = len(self.frontier) + len(self.edge_ends) + len(self.gaps)
        return bool(len(self) and not (places or self.table.outline_open[self.table.rows].any()))

    def validate(self) -> None:
        """Prove what must hold: samples belong, equations are their sums, patches solve them, the
        graph matches the geometry, outlines are open where nothing covers them.

        Raises
        ------
        AssertionError
            Naming all that does not hold.
        """
        if broken := violations(self):
            raise AssertionError("; ".join(broken))

    def refit_all(self) -> None:
        """Refit all patches from all they could have learned from, split those that do not hold,
        and draw boundaries and corners anew: what an exploration ends with."""
        self.refit(self.table.rows)
        for row in self._too_large(self.table.rows):
            if self.table.alive[row]:
                self.split(row)
        update_creases(self, self.table.rows.tolist())
        self.cells.retile()
        self.cells.mend()
