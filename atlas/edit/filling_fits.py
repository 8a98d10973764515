"""Filling fits: patches about points of known sheets, from all samples near, many in a call."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.edit.replace import are_upright, upright_fits
from touchatlas.atlas.patches.normal_equations import absorb, of_patch, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import (
    CANDIDATE_REACH,
    CandidateSamples,
    accepted,
)
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.estimate import FIT_REACH
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patches
from touchatlas.patch.fit.smoothness import leftover
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.geometry.frame import axes_from_normal

# Radii that are tried in turn, as fractions of the owner's radius, each about 1/sqrt(2) of the one
# before. The next one is tried where a patch would be steep, misses its samples, its degree leaves
# out too much, or most samples in it are of another sheet. Doubled, the patches would be larger
# than the owner, whose samples they are fitted to. The last is that of a fillet beside a flat face.
_FRACTIONS = 1.0, 0.7, 0.5, 0.35, 0.25, 0.17
# Largest misfit of a patch, in what noise and bias explain together: chi-square over its degrees of
# freedom exceeds 1.5^2 by chance in one of a thousand patches of 20 samples. Doubled,
# patches hold flat faces and fillets at once.
_MISFIT = 1.5
# Least fraction of the samples in the core of a patch, facing as it does, that are of its sheet:
# of more others it would hide the surface. With twice the rest, folds of polynomials stay.
_LEAST_ON_SHEET = 0.9
# Least number of samples of a patch between touches: the terms of its quadratic form. Doubled,
# fewer gaps between sparse contours are filled.
LEAST_SAMPLES = 6.0
# Number of candidates that are fitted in one numpy call, so that they fit the caches. Doubled, a
# call takes twice the memory.
_AT_ONCE = 1 << 14


@dataclass(frozen=True, eq=False)
class Sites:
    """Points of known sheets where patches are wanted.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
    owners : (n,) int
        The patch of whose sheet each point is.
    """

    points: np.ndarray
    normals: np.ndarray
    owners: np.ndarray

    def __len__(self) -> int:
        return len(self.owners)

    def only(self, index) -> "Sites":
        """The sites of some indices, or of a mask."""
        return Sites(self.points[index], self.normals[index], self.owners[index])


@dataclass(frozen=True, eq=False)
class Filling:
    """A patch that has learned the samples of its sheet, and is not entered yet.

    Parameters
    ----------
    fit : PatchFit
    columns : dict of str to array
        Its row of a ``PatchTable``.
    samples : (n,) int
        Those in its equations.
    """

    fit: PatchFit
    columns: dict[str, np.ndarray]
    samples: np.ndarray


def fits_at(state: AtlasState, sites: Sites) -> list[Filling | None]:
    """The patch about each site, of the largest of the radii with which it follows the samples
    near. Where none does it is the smallest one that is upright, whose misfit widens its deviation;
    None where there is none.
    """
    table, options = state.table, state.options
    least = np.minimum(options.least_radius * state.scale, table.radius[sites.owners])
    known = state.membership.near(
        sites.points, sites.normals, CANDIDATE_REACH * table.radius[sites.owners]
    )
    out: list[Filling | None] = [None] * len(sites)
    done, tried = np.zeros(len(sites), bool), np.full(len(sites), np.inf)
    for fraction in _FRACTIONS:
        radii = np.maximum(fraction * table.radius[sites.owners], least)
        # A radius that was tried already gives the same patch.
        left = np.flatnonzero(~done & (radii < tried)).tolist()
        tried[left] = radii[left]
        close = {i: _within(state, known[i], sites.points[i], radii[i]) for i in left}
        for some in _chunks({i: len(close[i]) for i in left}):
            fits = _fits(state, sites.only(some), [close[i] for i in some], radii[some])
            fitted = [i for i, fit in zip(some, fits, strict=True) if fit is not None]
            found = [fit for fit in fits if fit is not None]
            for i, (filling, is_sure) in zip(
                fitted, _learned(state, found, sites.owners[fitted]), strict=True
            ):
                out[i], done[i] = (filling, is_sure) if filling else (out[i], False)
    return out


def _within(state: AtlasState, index, point, radius: float) -> np.ndarray:
    """Those of samples ``index`` (n,) that a fit of a radius about a point (3,) weighs."""
    offset = state.membership.pool.points[index] - point
    kept: np.ndarray = index[(offset * offset).sum(axis=1) <= (FIT_REACH * radius) ** 2]
    return kept


def _chunks(counts: dict[int, int]) -> Iterator[list[int]]:
    """Sites that are fitted in one call, of about as many samples each, given these numbers by
    site. Sites with too few samples are left out."""
    order = sorted((count, i) for i, count in counts.items() if count >= LEAST_SAMPLES)
    while order:
        step = max(1, _AT_ONCE // order[-1][0])
        yield sorted(i for _, i in order[-step:])
        order = order[:-step]


def _learned(state: AtlasState, fits, owners) -> list[tuple[Filling | None, bool]]:
    """What each of m fits is after it has learned the samples of its sheet about its final place,
    and whether it follows them; None where it is no patch.

    The noise of their measurements is that of patches ``owners`` (m,).
    """
    out: list[tuple[Filling | None, bool]] = [(None, False)] * len(fits)
    upright = np.flatnonzero(upright_fits(fits))
    if not len(upright):
        return out
    membership = state.membership
    trial, rows = state.table.with_candidates([fits[i] for i in upright])
    trial.measurement_std[rows] = state.table.measurement_std[owners[upright]]
    found = accepted(
        trial, membership.pool, rows, CandidateSamples(membership.known_about(rows, trial)), 1.0
    )
    absorb(trial, rows, membership.pool, found.index, found.present)
    trial.learned[rows] = trial.count[rows]
    solve(trial, rows)
    good = (trial.count[rows] >= LEAST_SAMPLES) & are_upright(trial, rows)
    good &= _explains_core(state, trial, rows)
    sure = _is_fitted_well(state, trial, rows)
    for k in np.flatnonzero(good).tolist():
        samples = found.index[k][found.present[k]]
        filling = Filling(fits[upright[k]], trial.copy_of(int(rows[k])), samples)
        out[upright[k]] = filling, bool(sure[k])
    return out


def follows(state: AtlasState, table: PatchTable, rows) -> np.ndarray:
    """(m,) whether rows (m,) of a table are fitted well, and of the sheet of their samples."""
    return _is_fitted_well(state, table, rows) & _explains_core(state, table, rows)


def _is_fitted_well(state: AtlasState, table: PatchTable, rows) -> np.ndarray:
    """(m,) whether the residuals of rows (m,) of a table are what noise and bias explain, and their
    degree leaves out no more than is borne."""
    explained = np.hypot(table.measurement_std[rows], state.bias)
    rim = leftover(table.basis, table.length_ratio[rows]) * table.core ** (table.basis.degree + 1)
    good = table.residual[rows] <= _MISFIT * explained
    good &= rim * table.radius[rows] <= state.detail
    return np.asarray(good)


def _fits(state: AtlasState, sites: Sites, known, radii) -> list[PatchFit | None]:
    """Patches about sites from samples ``known`` (n arrays); None where no polynomial fits."""
    if not len(sites):
        return []
    table, pool, samples = state.table, state.membership.pool, CandidateSamples(known)
    axes = [
        axes_from_normal(n, table.axes[i, 0])
        for n, i in zip(sites.normals, sites.owners, strict=True)
    ]
    stack = Stack(
        sites.points,
        np.array(axes),
        pool.points[samples.index] - sites.points[:, None],
        pool.across[samples.index],
        samples.present.astype(float),
        radii,
        table.noise[sites.owners],
        np.ones(len(sites)),
    )
    try:
        return list(refit_patches(stack, state.bias, state.prior, state.options.fit))
    except UnfitError:
        # One site without a fit fails the whole stack.
        half = len(sites) // 2
        return _halves(state, sites, known, radii, half) if half else [None]


def _halves(state: AtlasState, sites: Sites, known, radii, half: int) -> list[PatchFit | None]:
    """The fits of the first ``half`` sites, then of the others."""
    some, others = slice(half), slice(half, None)
    return [
        *_fits(state, sites.only(some), known[some], radii[some]),
        *_fits(state, sites.only(others), known[others], radii[others]),
    ]


def _explains_core(state: AtlasState, table: PatchTable, rows) -> np.ndarray:
    """(m,) whether most of the samples in the cores of rows (m,), whose normals are within 60
    degrees of the patch's, are of its sheet."""
    pool, core = state.membership.pool, table.core * table.radius[rows]
    if not len(rows):
        return np.zeros(0, bool)
    near = CandidateSamples(state.membership.near(table.origin[rows], table.axes[rows, 2], core))
    member = of_patch(table, rows, pool.points[near.index], pool.normals[near.index])
    on_sheet, count = ((part & near.present).sum(axis=1) for part in (member, near.present))
    return np.asarray(on_sheet >= _LEAST_ON_SHEET * count)
