"""Atlas: the one mutable object, a graph of patches that grows touch by touch."""

from dataclasses import dataclass

import networkx as nx
import numpy as np

from touchatlas.atlas.blend import Blend, blend
from touchatlas.atlas.boundary import Boundary, power_at
from touchatlas.atlas.frontier import Frontier
from touchatlas.atlas.kin import kin_of
from touchatlas.atlas.moments import absorb, solve
from touchatlas.atlas.rough import learn_residuals
from touchatlas.atlas.table import Table
from touchatlas.atlas.texture import Texture
from touchatlas.atlas.tiling import Tiling
from touchatlas.atlas.touch import Touch, TouchStatus
from touchatlas.patch.fit import FitOptions, PatchFit, fit_patch
from touchatlas.patch.frame import DarbouxFrame
from touchatlas.patch.patch import Patch
from touchatlas.patch.polynomial import LocalPolynomial, monomials
from touchatlas.patch.section import contour_normals
from touchatlas.patch.smoothness import SmoothnessPrior, leftover
from touchatlas.patch.start import UnfitError

_LEAST_POINTS = 5
_LEAST_CONTOURS = 3
# Feature lengths within one object differ by no less than this, as a standard deviation of
# their logarithm, however alike those seen so far were.
_LEAST_LOG_STD = 0.5


@dataclass(frozen=True)
class AtlasOptions:
    """How an atlas is kept.

    Parameters
    ----------
    fit : FitOptions
    bias : float
        Lack of fit that is borne as if it were noise, in tolerances.
    detail : float
        Lack of fit that a patch may have before its radius is reduced, in tolerances: what
        ``learn_residuals`` is to explain.
    least_radius : float
        No patch is made smaller than this for its contours' sake, in tolerances.
    """

    fit: FitOptions = FitOptions(adaptive=False)
    bias: float = 0.2
    detail: float = 5.0
    least_radius: float = 10.0


@dataclass(frozen=True)
class AtlasChange:
    """What one change did to the atlas: patch ids.

    ``refused`` says in words why a touch taught nothing; it is empty otherwise.
    """

    added: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    merged: tuple[int, ...] = ()
    split: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    refused: str = ""


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
    kin : list of set of int
        For each patch, the patches that continue its sheet within reach.
    tiling : Tiling
        Boundaries, corners and gaps.
    frontier : Frontier
    touches : int
    texture : Texture
        Of the surface, since residuals were last learned.
    """

    def __init__(self, tolerance: float, options: AtlasOptions = AtlasOptions()) -> None:
        if not (np.isfinite(tolerance) and tolerance > 0):
            raise ValueError(f"tolerance is {tolerance}; it must be a length > 0")
        self.tolerance = float(tolerance)
        self.options = options
        self.table = Table(options.fit.basis, options.fit.core)
        self.kin: list[set[int]] = []
        self.tiling = Tiling(self.table, self.kin)
        self.samples: list[tuple[np.ndarray, np.ndarray]] = []
        self.frontier = Frontier()
        self.touches = 0
        self.length_sums = np.zeros(3)
        self.texture = Texture()

    def __len__(self) -> int:
        return self.table.size

    @property
    def graph(self) -> nx.Graph:
        """Nodes are patch ids (see ``patch``); edges carry a ``boundary`` (Boundary)."""
        return self.tiling.graph

    @property
    def parameter_count(self) -> int:
        """Coefficients over all patches."""
        return self.table.size * self.table.basis.size

    @property
    def point_count(self) -> int:
        """Samples over all touches."""
        return sum(len(points) for points, _ in self.samples)

    @property
    def prior(self) -> SmoothnessPrior:
        """What the patches so far say about the feature length of the next."""
        count, total, squares = self.length_sums
        if count < 3:
            return SmoothnessPrior()
        mean = total / count
        spread = np.sqrt(max(squares / count - mean * mean, 0.0))
        return SmoothnessPrior(mean, max(spread, _LEAST_LOG_STD))

    def patch(self, patch_id: int) -> Patch:
        """The patch of an id, as it is now."""
        table, i = self.table, patch_id
        if not 0 <= i < table.size:
            raise KeyError(f"no patch {patch_id}; ids run from 0 to {table.size - 1}")
        return Patch(
            i,
            DarbouxFrame(table.origin[i], table.axes[i]),
            LocalPolynomial(table.basis, table.mean[i].copy(), float(table.radius[i])),
            table.covariance[i].copy(),
            float(table.radius[i]),
            table.core,
            float(table.noise[i]),
            float(table.residual[i]),
            int(table.count[i]),
            float(table.condition[i]),
            float(leftover(table.basis, table.turn[i])),
        )

    def blend(self, points) -> Blend:
        """Signed distance, normal, deviation and curvature at world points (n, 3)."""
        return blend(self.table, self.kin, points)

    def predicted_coverage(self) -> float:
        """Share of the patches' outlines that other patches cover: 1 when nothing is open."""
        return float(1.0 - self.table.ring_open.mean()) if len(self) else 0.0

    def predicted_deviation(self) -> float:
        """Root mean square over the patches of their deviation half-way to the rim, length."""
        if not len(self):
            return float("inf")
        table = self.table
        angles = np.pi / 4.0 * np.arange(8) + 0.2
        x, y = 0.5 * np.cos(angles), 0.5 * np.sin(angles)
        # The height by its curvature alone: it matters little here.
        z = np.stack([x * x, x * y, y * y]).T @ table.mean[:, 3:6, None]
        shape = z.shape[:2]
        terms = monomials(
            table.basis, np.broadcast_to(x, shape), np.broadcast_to(y, shape), z[..., 0]
        )[: table.basis.size]
        variance = np.einsum("tmn,mts,smn->m", terms, table.covariance, terms) / len(angles)
        return float(np.sqrt(np.mean(table.radius**2 * variance)))

    def boundary(self, first: int, second: int) -> Boundary:
        """The boundary of two patches that meet."""
        return self.graph.edges[first, second]["boundary"]

    def add(self, touch: Touch) -> AtlasChange:
        """Learn one touch: a new patch, better neighbours, new boundaries, a new frontier.

        Returns
        -------
        AtlasChange
            With ``refused`` set, and nothing changed, when the contours are too few or too
            short for a patch.
        """
        self.touches += 1
        if touch.status is not TouchStatus.TOUCHED:
            return AtlasChange(refused=f"the probe reported: {touch.status.value}")
        contours = tuple(c for c in touch.contours if len(c.points) >= _LEAST_POINTS)
        if len(contours) < _LEAST_CONTOURS:
            return AtlasChange(
                refused=f"{len(contours)} contours have {_LEAST_POINTS} points or more; a patch "
                f"needs {_LEAST_CONTOURS}: sample more finely"
            )
        try:
            fit = fit_patch(
                touch.contact,
                contours,
                touch.approach,
                bias=self.options.bias * self.tolerance,
                detail=self.options.detail * self.tolerance,
                radius_floor=self.options.least_radius * self.tolerance,
                radius_limit=self._radius_limit(touch),
                prior=self.prior,
                options=self.options.fit,
            )
        except UnfitError as error:
            return AtlasChange(refused=str(error))
        normals = [contour_normals(c, fit.patch.frame.normal) for c in contours]
        sensor = float(np.sqrt(np.mean([c.noise_std**2 for c in contours])))
        points = np.concatenate([c.points_in_plane for c in contours])
        return self._insert(fit, sensor, points, np.concatenate(normals))

    def _radius_limit(self, touch: Touch) -> float:
        """Largest radius whose core takes no earlier centre out of its own cell."""
        table = self.table
        offset = table.origin - touch.contact
        alike = table.axes[:, 2] @ touch.approach > 0
        square = (offset * offset).sum(axis=1) + table.power
        return float(0.99 * np.sqrt(square[alike].min()) / table.core) if alike.any() else np.inf

    def _insert(self, fit: PatchFit, sensor: float, points, normals) -> AtlasChange:
        """Enter a fitted patch with its samples and their normals within their contours."""
        table = self.table
        row = table.append(fit)
        table.sensor[row] = sensor
        kin = kin_of(table, row)
        # Within the patch its polynomial knows the normals better than single contours do.
        scaled = table.scaled_local(np.array([row]), points)
        upward = table.surface(np.array([row]), scaled)[1][0]
        upward = upward / np.sqrt((upward**2).sum(axis=1))[:, None] @ table.axes[row]
        inside = (scaled[0, :, :2] ** 2).sum(axis=1) <= 1.0
        normals = np.where(inside[:, None], upward, normals)
        if len(kin):
            absorb(table, kin, points, normals)
        owner = self._owner(row, kin)
        if owner != row:
            table.size -= 1
            self._give_samples(owner, points, normals)
            solve(table, kin)
            self.frontier.cover(table, owner)
            frame = fit.patch.frame
            self.frontier.visit(frame.origin, frame.normal, 0.5 * fit.patch.radius)
            self._link(owner, kin)
            return AtlasChange(changed=tuple(kin.tolist()))
        self._join(row, kin, points, normals)
        log_length = np.log(table.radius[row] / fit.turn)
        self.length_sums += (1.0, log_length, log_length**2)
        rows = np.append(kin, row)
        solve(table, rows)
        table.renew_ring(row)
        self._close_frontier(row, kin, points, normals)
        self.tiling.meet(row, kin)
        return AtlasChange(added=(row,), changed=tuple(kin.tolist()))

    def _owner(self, row: int, kin: np.ndarray) -> int:
        """The patch in whose cell the centre of ``row`` lies: itself, unless it is hidden."""
        if not len(kin):
            return row
        power = power_at(self.table, kin, self.table.origin[row])
        return row if -self.table.power[row] < power.min() else int(kin[power.argmin()])

    def _link(self, owner: int, kin: np.ndarray) -> None:
        """One touch was of the sheet of all these: so they are kin to its owner, and what its
        core covers of them is closed."""
        table = self.table
        others = kin[kin != owner]
        offset = table.origin[others] - table.origin[owner]
        reach = table.radius[others] + table.radius[owner]
        for i in others[(offset * offset).sum(axis=1) < reach**2].tolist():
            self.kin[owner].add(i)
            self.kin[i].add(owner)
        table.ring_open[others] *= power_at(table, [owner], table.ring[others])[..., 0] > 0
        self.tiling.conquer(owner, others)

    def _give_samples(self, owner: int, points, normals) -> None:
        old_points, old_normals = self.samples[owner]
        self.samples[owner] = (
            np.concatenate([old_points, points]),
            np.concatenate([old_normals, normals]),
        )

    def _join(self, row: int, kin: np.ndarray, points, normals) -> None:
        """Enter ``row`` among its kin, and learn from their samples."""
        members = kin.tolist()
        if members:
            earlier = [self.samples[i] for i in members]
            absorb(
                self.table,
                np.array([row]),
                np.concatenate([p for p, _ in earlier]),
                np.concatenate([n for _, n in earlier]),
            )
        self.samples.append((points, normals))
        self.kin.append(set(members))
        for i in members:
            self.kin[i].add(row)
        self.tiling.add(row)

    def _close_frontier(self, row: int, kin: np.ndarray, points, normals) -> None:
        table = self.table
        self.frontier.cover(table, row)
        self.frontier.extend(table, row, kin, points, normals)
        if len(kin):
            table.ring_open[kin] *= power_at(table, [row], table.ring[kin])[..., 0] > 0
            table.ring_open[row] *= power_at(table, kin, table.ring[row]).min(axis=1) > 0

    def euler_characteristic(self) -> int:
        """V - E + F of the patch graph: patches, boundaries and corners."""
        return self.tiling.euler_characteristic()

    def learn_residuals(self) -> int:
        """Detail finer than the patches, where the evidence asks for it; how many have it.

        To be called when the surface is wanted: a patch that learns from a later touch loses its
        residual.
        """
        self.texture = learn_residuals(self.table, self.kin, self.samples, self.prior)
        return len(self.table.rough)

    def retile(self) -> None:
        """Corners and boundaries of all patches anew, from the polynomials as they are now."""
        self.tiling.retile()
