"""Fit a free-form face: overlapping sextics, large where samples are few, and kriging."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.free_form.free_form_surface import FreeFormSurface
from touchatlas.atlas.free_form.packed_covariances import PackedCovariances
from touchatlas.atlas.free_form.residual_kriging import (
    amplitude_of,
    amplitudes_of,
    krige,
    nearest_of,
)
from touchatlas.atlas.free_form.sextic_batch import SexticBatch, joined
from touchatlas.atlas.free_form.sextic_fits import SexticFits, coefficients_of
from touchatlas.atlas.free_form.sextic_prior import with_common_prior
from touchatlas.atlas.free_form.sextic_sites import SexticSites, middles_of, sites_of
from touchatlas.atlas.labels.grow import evenly

# Factor by which the radius of the sextics shrinks until they follow the samples. Nearer to 1,
# radii are a little larger, and more are tried.
_SHRINK = 0.7
# Least number of samples of a sextic, in the median of all, for a smaller radius, and of each one
# that is smaller than others: twice its parameters. Doubled, narrow bends are rounded off. Halved,
# smaller ones follow all samples, and are surer than they are right: of a part, a cow and a goat's
# head after 8 touches 0.68 to 0.96 of the errors were within 1.96 deviations, and are 0.77 to 0.97.
_LEAST = 98
# Least number of samples within ``_SHRINK`` radii of a smaller sextic, in the median, with which it
# is taken although larger ones follow the samples: five times its parameters. On 80 places of four
# smooth bodies the mean error was 3 to 25 % less with it. Doubled, many touches gain less.
_AMPLE = 245
# Least number of places of these samples, one for each parameter, and their size over the distance
# within which they are counted. Samples of one contour are at few places, however many they are:
# they show nothing across it. Either doubled, surfaces have fewer, and no sextic becomes smaller.
_AT_PLACES, _PLACE = 49, 0.2
# Sextics follow the samples where the residuals about half of them have an amplitude of no more
# than this, in deviations of a sample. At 0.7 to 2.5 scans are known about as well. Doubled, bends
# are left to kriging, which knows them less.
_FOLLOWS = 1.4
# The same of each sextic about its middle, above which all are not looked at: it was up to 1.2 of
# that of all, but where they differ much. Doubled, it takes longer, and nothing changes.
_HOPELESS = 1.75
# Ratio of the radii of smaller sextics, where larger ones leave much out, to theirs. At 0.7 two of
# three meshes had less within 1.96 deviations after 8 touches. Doubled, there are none.
_FINER = 0.5
# Most sextics, and samples, whose residuals are looked at to tell that. Doubled, it takes longer,
# and the radius is the same.
_LOOKED_AT = 40
# Ratio of two largest radii, each a power of it in deviations of a sample: the extent grows a
# little with most touches, and a sextic of another radius has to be fitted anew. Doubled over one,
# fewer are fitted.
_RUNG = 2.0 ** (1.0 / 32.0)
# Least standard deviation of a sample, in radii: below it rounding shows. Doubled, nothing changes.
_LEAST_STD = 1e-5
# Mean cosine of the normals of a sextic and of its samples, below which it faces inward, and the
# distance of these from its middle, in radii: it was -0.85 to -0.60 of seven that did, and -0.33 or
# more of 1,800 others. With zero, and samples at any distance, a lemon lost 17 others, and was off
# by 3 % more. At any distance the cosine was as small as -0.3 of others, which fold at their ends,
# and as large as 0.2 of one that did.
_INWARD, _NEAR = -0.45, 0.45
# Deviations up to which a sample without a label is on the surface. Doubled, samples of other
# features are taken for those of the face.
_SURE = 3.0
# Deviation of the surface, in deviations of a sample, from which a sample without a label tells
# nothing: it may be of any face. Doubled, samples of other faces bend the surface beyond its edge.
_VAGUE = 5.0


def fit_free_form(
    points, normals, std: float, radius: float, before: FreeFormSurface | None = None
) -> FreeFormSurface:
    """The surface of a face from its samples: sextics of the largest radius with which they follow
    the samples, or of a smaller one where samples are ample, and kriging of what they leave out.

    Parameters
    ----------
    points : (n, 3) float, length, world
    normals : (n, 3) float, unit, world
        Outward.
    std : float, length
        Standard deviation of a sample's distance.
    radius : float, length
        Largest radius of a sextic.
    before : FreeFormSurface, optional
        A surface of the first of the samples. It saves time and changes nothing: what is taken
        from it was found from the same samples.
    """
    radius = max(radius, std) or 1.0
    std = max(std, _LEAST_STD * radius)
    radius = std * _RUNG ** np.round(np.log(radius / std) / np.log(_RUNG))
    tree = cKDTree(points)
    fits = SexticFits(points, normals, std)
    if before is not None and before.fits is not None:
        fits = before.fits.following(points, normals, std)
    near = nearest_of(tree, np.arange(len(points)))
    sites, levels = _largest(tree, fits, radius), []
    while True:
        levels.append(_with_prior(fits, sites))
        found = FreeFormSurface(joined(levels), fits.points, fits.normals)
        values = found.at(points)
        rest, side = values[:, 0], values[:, 1:4]
        rough = amplitudes_of(side[near], rest[near], std) > _FOLLOWS * std
        finer = _finer(tree, fits, sites.radius, np.flatnonzero(rough))
        if finer is None:
            break
        sites = finer
    kriging = krige(points, side, rest, found.radius, std)
    return replace(found, normals=side, rest=kriging, fits=replace(fits, before={}))


def _largest(tree, fits: SexticFits, radius: float) -> SexticSites:
    """Sextics of the largest radius, up to one, with which they follow the samples, or with which
    they are known; of smaller ones where samples are ample."""
    near = nearest_of(tree, evenly(np.arange(tree.n), _LOOKED_AT))
    while True:
        middles = middles_of(tree, fits.normals, radius)
        if _are_ample(tree, middles, _SHRINK * radius):
            radius *= _SHRINK
            continue
        known = _median_count(tree, middles, _SHRINK * radius) >= _LEAST
        # The same ones as before, until they are twice as many.
        every = 1 << (max(len(middles) - 1, 1) // _LOOKED_AT).bit_length()
        some = sites_of(tree, fits.normals, middles[::every], radius)
        if not known or _each_left_out(tree, fits, some) <= _HOPELESS * fits.std:
            found = sites_of(tree, fits.normals, middles, radius)
            if not known or _left_out(near, fits, found) <= _FOLLOWS * fits.std:
                return found
        radius *= _SHRINK


def _are_ample(tree, middles, radius: float) -> bool:
    """Whether samples are ample for sextics of a radius with middles (m,): many, at many places."""
    within = _SHRINK * radius
    if _median_count(tree, middles, within) < _AMPLE:
        return False
    cubes = np.floor((tree.data - tree.data[0]) / (_PLACE * within)).astype(np.int64)
    places = cKDTree(tree.data[np.unique(cubes, axis=0, return_index=True)[1]])
    counts = places.query_ball_point(tree.data[middles], within, return_length=True)
    return bool(np.median(counts) >= _AT_PLACES)


def _median_count(tree, middles, radius: float) -> float:
    """Median number of samples within a radius of middles (m,)."""
    return float(np.median(tree.query_ball_point(tree.data[middles], radius, return_length=True)))


def _each_left_out(tree, fits: SexticFits, sites: SexticSites) -> float:
    """Median amplitude of what each of some sextics leaves out about its middle, length."""
    near = nearest_of(tree, sites.middles)
    sextics = _sextics(fits, sites, coefficients_of(fits.equations(sites)))
    numbers = np.repeat(np.arange(len(near)), near.shape[1])
    values, _ = sextics.values(numbers, fits.points[near.ravel()])
    rest = values[:, 0].reshape(near.shape)
    return float(np.median(amplitudes_of(fits.normals[near], rest, fits.std)))


def _left_out(near, fits: SexticFits, sites: SexticSites) -> float:
    """Median amplitude of what all sextics leave out in groups of neighbours (g, k), length."""
    sextics = _sextics(fits, sites, coefficients_of(fits.equations(sites)))
    used, place = np.unique(near, return_inverse=True)
    values = FreeFormSurface(sextics, fits.points, fits.normals).at(fits.points[used])
    values = values[place.reshape(near.shape)]
    return float(np.median(amplitudes_of(values[..., 1:4], values[..., 0], fits.std)))


def _finer(tree, fits: SexticFits, radius: float, rough) -> SexticSites | None:
    """The largest sextics, smaller than a radius, that follow the samples about which larger ones
    leave much out, ``rough`` (k,); None where none do."""
    while len(rough):
        radius *= _FINER
        middles = rough[middles_of(cKDTree(tree.data[rough]), fits.normals[rough], radius)]
        count = tree.query_ball_point(tree.data[middles], radius, return_length=True)
        middles = middles[count >= _LEAST]
        if not len(middles):
            return None
        sites = sites_of(tree, fits.normals, middles, radius)
        follow = _left_out_within(fits, sites) <= _FOLLOWS * fits.std
        if follow.any():
            return sites.some(np.flatnonzero(follow))
    return None


def _left_out_within(fits: SexticFits, sites: SexticSites) -> np.ndarray:
    """(m,) amplitude of what each of some sextics leaves out of its own samples, length."""
    sextics = _sextics(fits, sites, coefficients_of(fits.equations(sites)))
    numbers, samples, counts = _pairs_of(sites)
    square = sextics.values(numbers, fits.points[samples])[0][:, 0] ** 2
    return amplitude_of(np.bincount(numbers, square) / counts, fits.std)


def _with_prior(fits: SexticFits, sites: SexticSites) -> SexticBatch:
    """Sextics of one radius with their common prior."""
    coefficients, factors = with_common_prior(fits.equations(sites), fits.std / sites.radius)
    found = _sextics(fits, sites, coefficients)
    found = replace(found, covariances=PackedCovariances(factors))
    inward = _face_inward(fits, sites, found)
    return found.some(np.flatnonzero(~inward)) if inward.any() and not inward.all() else found


def _face_inward(fits: SexticFits, sites: SexticSites, sextics: SexticBatch) -> np.ndarray:
    """(m,) whether sextics face away from their samples. Where a sampling plane touches the
    surface, the normal of a sample may be off by more than 80 degrees: a sextic about it may follow
    the surface with the inside out, and would draw a flap beside it."""
    numbers, samples, _ = _pairs_of(sites)
    off = fits.points[samples] - fits.points[sites.middles[numbers]]
    near = (off * off).sum(axis=1) < (_NEAR * sites.radius) ** 2
    numbers, samples = numbers[near], samples[near]
    normals = sextics.values(numbers, fits.points[samples])[0][:, 1:4]
    cosines = np.einsum("ij,ij->i", normals, fits.normals[samples])
    sums, counts = (np.bincount(numbers, x, len(sextics)) for x in (cosines, None))
    return np.asarray(sums < _INWARD * counts)


def _pairs_of(sites: SexticSites) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of sextics and samples (k,) of them, and how many each has (m,)."""
    counts = np.array([len(some) for some in sites.members])
    return np.repeat(np.arange(len(counts)), counts), np.concatenate(sites.members), counts


def _sextics(fits: SexticFits, sites: SexticSites, coefficients) -> SexticBatch:
    """Sextics at sites with coefficients (m, t), without covariances."""
    middles, radii = fits.points[sites.middles], np.full(len(sites.middles), sites.radius)
    return SexticBatch(middles, sites.axes, radii, coefficients)


def are_on(surface: FreeFormSurface, points, std: float) -> np.ndarray:
    """(n,) whether samples at points (n, 3) lie on a surface within the deviations of both, where
    the surface is known well enough to tell."""
    values = surface.values(points)
    on = values[:, 0] ** 2 <= _SURE**2 * (values[:, 4] + std**2)
    return np.asarray(on & (values[:, 4] <= _VAGUE**2 * std**2))
