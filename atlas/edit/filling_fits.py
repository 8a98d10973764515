"""Filling fits: patches about points of known sheets, from all samples near, many in a call."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.edit.replace import are_upright, is_upright
from touchatlas.atlas.patches.normal_equations import absorb, of_patch, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_membership import CANDIDATE_REACH, CandidateSamples
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patches
from touchatlas.patch.fit.start import Stack, UnfitError
from touchatlas.patch.geometry.frame import axes_from_normal

# Radii that are tried in turn, as fractions of the owner's radius, each about 1/sqrt(2) of the one
# before. The next one is tried where a patch would be steep, misses its samples, or where most
# samples in it are of another sheet. Doubled, the patches would be larger than the owner, whose
# samples they are fitted to. The last is that of a fillet beside a flat face.
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


def fits_at(state: AtlasState, sites: Sites) -> list[PatchFit | None]:
    """The patch about each site, of the largest of the radii with which it follows the samples
    near. Where none does it is the smallest one that is upright, whose misfit widens its deviation;
    None where there is none.
    """
    table, options = state.table, state.options
    least = np.minimum(options.least_radius * state.scale, table.radius[sites.owners])
    known = state.membership.near(
        sites.points, sites.normals, CANDIDATE_REACH * table.radius[sites.owners]
    )
    out: list[PatchFit | None] = [None] * len(sites)
    done = np.array([not len(index) for index in known], bool)
    for fraction in _FRACTIONS:
        left = np.flatnonzero(~done).tolist()
        radii = np.maximum(fraction * table.radius[sites.owners[left]], least[left])
        fits = _fits(state, sites.only(left), [known[i] for i in left], radii)
        for i, fit in zip(left, fits, strict=True):
            if fit is None or not is_upright(fit.patch):
                continue
            trial, row = _learned(state, fit, sites.owners[i], known[i])
            if (
                trial.count[row] >= LEAST_SAMPLES
                and explains_core(state, trial, row)[0]
                and are_upright(trial, row)[0]
            ):
                out[i] = fit
                done[i] = follows(state, trial, row)[0]
    return out


def _learned(state: AtlasState, fit: PatchFit, owner: int, index) -> tuple[PatchTable, np.ndarray]:
    """A table with a fitted patch that has learned the samples ``index`` (n,) of its sheet, as it
    will when it is entered, and its row (1,)."""
    trial, candidate = state.table.with_candidate(fit)
    row, pool = np.array([candidate]), state.membership.pool
    trial.measurement_std[row] = state.table.measurement_std[owner]
    member = of_patch(trial, row, pool.points[index], pool.normals[index])
    absorb(trial, row, pool, index, member)
    solve(trial, row)
    return trial, row


def follows(state: AtlasState, table: PatchTable, rows) -> np.ndarray:
    """(m,) whether the residuals of rows (m,) of a table are what noise and bias explain."""
    explained = np.hypot(table.measurement_std[rows], state.bias)
    return np.asarray(table.residual[rows] <= _MISFIT * explained)


def _fits(state: AtlasState, sites: Sites, known, radii) -> list[PatchFit | None]:
    """Patches about sites from samples ``known`` (n arrays); None where no polynomial fits."""
    if not len(sites):
        return []
    half = len(sites) // 2
    if half and sum(map(len, known)) > _AT_ONCE:
        return _halves(state, sites, known, radii, half)
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
        return _halves(state, sites, known, radii, half) if half else [None]


def _halves(state: AtlasState, sites: Sites, known, radii, half: int) -> list[PatchFit | None]:
    """The fits of the first ``half`` sites, then of the others."""
    some, others = slice(half), slice(half, None)
    return [
        *_fits(state, sites.only(some), known[some], radii[some]),
        *_fits(state, sites.only(others), known[others], radii[others]),
    ]


def explains_core(state: AtlasState, table: PatchTable, rows) -> np.ndarray:
    """(m,) whether most of the samples in the cores of rows (m,), whose normals are within 60
    degrees of the patch's, are of its sheet."""
    pool, core = state.membership.pool, table.core * table.radius[rows]
    near = state.membership.near(table.origin[rows], table.axes[rows, 2], core)
    shares = [
        of_patch(table, np.array([row]), pool.points[index], pool.normals[index]).mean()
        if len(index)
        else 1.0
        for row, index in zip(rows.tolist(), near, strict=True)
    ]
    return np.array(shares) >= _LEAST_ON_SHEET
