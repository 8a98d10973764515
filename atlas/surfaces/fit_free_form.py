"""Fit a free-form face: overlapping sextics as large as the samples allow, and kriging."""

import hashlib

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.surfaces.free_form import FreeFormSurface
from touchatlas.atlas.surfaces.kriging import beyond_noise, left_out, neighbours
from touchatlas.atlas.surfaces.sextic_fit import equations_of, with_common_prior, with_factors
from touchatlas.atlas.surfaces.sextic_sites import SexticSites, middles_of, sites_of
from touchatlas.atlas.surfaces.sextics import Sextics
from touchatlas.patch.geometry.arrays import evenly

# Radii are powers of this in deviations of a sample, so that the extent, which grows a little with
# most touches, seldom changes them.
_RUNG = np.sqrt(2.0)
# Least number of samples of a sextic, in the median of all: twice its parameters.
_LEAST = 98
# Ratio of the radii of two levels of sextics.
_FINER = 0.5
# Sextics follow the samples where the residuals about half of them have an amplitude of no more
# than this, in deviations of a sample.
_FOLLOWS = 1.4


def fit_free_form(
    points,
    normals,
    std: float,
    radius: float,
    before: FreeFormSurface | None = None,
    levels: Levels = Levels(),
    stds=None,
    tried: int | None = None,
) -> FreeFormSurface:
    """The surface of a face from its samples: sextics of the largest radius with which they follow
    the samples, or of the least radius with which these are enough. Where radii are tried with
    the first samples, what was found for a surface of these holds.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward.
    std : float, length
        Standard deviation of the distance of the surest samples.
    radius : float, length
        Largest radius of a sextic, about.
    before : FreeFormSurface, optional
        A surface of the first of the samples. It saves time and changes nothing: what is taken
        from it was found from the same samples.
    levels : Levels
    stds : (n,) float, length, optional
        Of each sample; all are alike without.
    tried : int, optional
        Number of the first samples with which radii are tried; all without.
    """
    radius = max(radius, std) or 1.0
    # Below it rounding shows.
    std = max(std, 1e-5 * radius)
    stds = np.full(len(points), std) if stds is None else np.maximum(stds, std)
    radius = std * _RUNG ** np.round(np.log(radius / std) / np.log(_RUNG))
    tree, known = cKDTree(points), {} if before is None else before.kept
    kept: dict = {}
    first = slice(tree.n if tried is None else tried)
    trial = points[first], normals[first], stds[first], levels.facing
    sites = _largest_sites(tree, normals, radius, trial, known, kept)
    found: FreeFormSurface | None = None
    while True:
        equations = equations_of(sites, points, stds, known, kept)
        fitted = with_common_prior(equations, std / sites.radius)
        sextics = _sextics(sites, points, fitted)
        good = _face_samples(sites, sextics, points, normals)
        if found is None:
            sextics = sextics.some(np.flatnonzero(good))
            found = FreeFormSurface(sextics, points, normals, kept=kept)
        else:
            good &= _follow_samples(sites, sextics, points, stds)
            found = found.with_finer(sextics.some(np.flatnonzero(good)))
        groups = found.groups
        rough = np.flatnonzero(_left_out(found.at_samples[groups], groups, stds) > 1.0)
        finer = _finer(tree, normals, rough, _FINER * sites.radius, levels.facing)
        if finer is None:
            return found.with_own_sides(stds)
        sites = finer


def _largest_sites(
    tree: cKDTree, normals, radius: float, trial, known: dict, kept: dict
) -> SexticSites:
    """Sextics of the largest radius, length, from ``radius`` down in steps, with which they follow
    samples on ``trial``; or of the first one below which samples are too few. What is found is
    ``kept``, and taken from what is ``known``."""
    while True:
        middles = middles_of(tree, normals, radius, trial[-1])
        counts = tree.query_ball_point(tree.data[middles], radius / _RUNG, return_length=True)
        key = _key(*trial, radius)
        if np.median(counts) >= _LEAST:
            kept[key] = known[key] if key in known else _follow(trial, radius, known, kept)
        if kept.get(key, True):
            return sites_of(tree, normals, middles, radius)
        radius /= _RUNG


def _follow(trial, radius: float, known: dict, kept: dict) -> bool:
    """Whether sextics of a radius, length, follow samples on trial in the median."""
    points, normals, stds, facing = trial
    tree = cKDTree(points)
    sites = sites_of(tree, normals, middles_of(tree, normals, radius, facing), radius)
    fitted = with_factors(equations_of(sites, points, stds, known, kept))
    surface = FreeFormSurface(_sextics(sites, points, fitted), points, normals)
    some = neighbours(tree, evenly(np.arange(tree.n), 40))
    values = surface.at(points[some.ravel()]).reshape(*some.shape, 4)
    return bool(np.median(_left_out(values, some, stds)) <= 1.0)


def _key(*content) -> bytes:
    """A name of arrays and numbers."""
    return hashlib.blake2b(b"".join(np.asarray(one).tobytes() for one in content)).digest()


def _finer(tree: cKDTree, normals, rough, radius: float, facing: float) -> SexticSites | None:
    """Sextics of a radius, length, with middles among the samples that larger ones do not follow,
    ``rough`` (k,), and enough samples; None where none have: the next level of Ohtake and others
    (2003)."""
    if not len(rough):
        return None
    middles = rough[middles_of(cKDTree(tree.data[rough]), normals[rough], radius, facing)]
    counts = tree.query_ball_point(tree.data[middles], radius, return_length=True)
    middles = middles[counts >= _LEAST]
    return sites_of(tree, normals, middles, radius) if len(middles) else None


def _follow_samples(sites: SexticSites, sextics: Sextics, points, stds) -> np.ndarray:
    """(m,) whether each of some sextics follows its own samples: one across an edge does not."""
    counts = np.array([len(some) for some in sites.members])
    numbers, samples = np.repeat(np.arange(len(counts)), counts), np.concatenate(sites.members)
    rest = sextics.values(numbers, points[samples])[0][:, 0] / stds[samples]
    square = np.bincount(numbers, rest * rest, len(counts)) / counts
    return np.asarray(beyond_noise(square, 1.0) <= _FOLLOWS**2)


def _sextics(sites: SexticSites, points, fitted) -> Sextics:
    """Sextics at sites, of fitted coefficients (m, t) and factors (m, t, t)."""
    coefficients, factors = fitted
    radii = np.full(len(sites.middles), sites.radius)
    frame = points[sites.middles], sites.axes, radii
    return Sextics(*frame, coefficients, factors)


def _face_samples(sites: SexticSites, sextics: Sextics, points, normals) -> np.ndarray:
    """(m,) whether sextics face on average as their samples within half of a radius do; all where
    none does. Where a sampling plane touches the surface, the normal of a sample may be off by
    more than 80 degrees: a sextic about it may follow the surface with the inside out."""
    numbers = np.repeat(np.arange(len(sextics)), [len(some) for some in sites.members])
    samples = np.concatenate(sites.members)
    off = points[samples] - sextics.origins[numbers]
    near = (off * off).sum(axis=1) < (0.5 * sites.radius) ** 2
    numbers, samples = numbers[near], samples[near]
    own = sextics.values(numbers, points[samples])[0][:, 1:4]
    sums = np.bincount(numbers, (own * normals[samples]).sum(axis=1), len(sextics))
    return np.asarray(sums > 0.0) if (sums > 0.0).any() else np.ones(len(sextics), bool)


def _left_out(values, groups, stds) -> np.ndarray:
    """(g,) variance of what a surface leaves out in groups of neighbours (g, k), with its distance
    and normal at these (g, k, 4), and deviations (n,) of all samples, over the largest with which
    it follows them."""
    found = left_out(values[..., 1:4], values[..., 0], stds[groups])
    return np.asarray(found / (_FOLLOWS * np.median(stds[groups], axis=1)) ** 2)


def are_on(surface: FreeFormSurface, points, std: float, levels: Levels = Levels()) -> np.ndarray:
    """(n,) whether samples at points (n, 3) lie on a surface within the deviations of both, where
    the surface is known well enough to tell: to so many deviations of a sample."""
    values, sure = surface.values(points), levels.sure**2
    on = values[:, 0] ** 2 <= sure * (values[:, 4] + std**2)
    return np.asarray(on & (values[:, 4] <= sure * std**2))
