"""Filling fits: patches about points of known sheets, from all samples near, many in a call."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.edit.replace import in_ball, is_upright
from touchatlas.atlas.patches.normal_equations import of_patch
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
# Least fraction of the samples in the ball of a patch that are of its sheet: the majority.
# Doubled, a single sample of another sheet would refuse a patch.
_LEAST_ON_SHEET = 0.5
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
    """The patch about each site, of the largest of the radii with which it fits the samples near;
    None where it fits with none of them."""
    radii = state.table.radius[sites.owners]
    known = state.membership.near(sites.points, sites.normals, CANDIDATE_REACH * radii)
    out: list[PatchFit | None] = [None] * len(sites)
    for fraction in _FRACTIONS:
        left = [i for i, fit in enumerate(out) if fit is None and len(known[i])]
        fits = _fits(state, sites.only(left), [known[i] for i in left], fraction * radii[left])
        for i, fit in zip(left, fits, strict=True):
            if fit is not None and _is_good(state, fit, sites.owners[i], known[i]):
                out[i] = fit
    return out


def _is_good(state: AtlasState, fit: PatchFit, owner: int, index) -> bool:
    """Whether a patch is upright, follows its samples, and most samples ``index`` (n,) near it are
    of its sheet."""
    explained = np.hypot(state.table.measurement_std[owner], state.bias)
    follows = fit.patch.residual_rms <= _MISFIT * explained
    return bool(follows and is_upright(fit.patch) and _is_of_sheet(state, fit, index))


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


def _is_of_sheet(state: AtlasState, fit: PatchFit, index) -> bool:
    """Whether most of the samples ``index`` (n,) in the ball of a patch are of its sheet."""
    pool = state.membership.pool
    within = index[in_ball(pool.points[index], fit.patch.frame.origin, fit.patch.radius)]
    trial, row = state.table.with_candidate(fit)
    mine = of_patch(trial, np.array([row]), pool.points[within], pool.normals[within])
    return bool(mine.sum() >= max(1.0, _LEAST_ON_SHEET * len(within)))
