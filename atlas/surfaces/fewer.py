"""The same surface of fewer sextics: as large as the tolerance allows, fitted to points of it.

Sextics of samples overlap many times, because each alone is unsure between contours: their mean is
surer. Once that is known, a few sextics that follow it say the same.
"""

from dataclasses import dataclass, replace
from heapq import heapify, heappop, heappush

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.pieces.kinds import SEXTIC_BASIS, Kind, prior_precision
from touchatlas.atlas.records.options import Levels
from touchatlas.atlas.surfaces.free_form import FreeFormSurface
from touchatlas.atlas.surfaces.placed_sextics import WEIGHS
from touchatlas.atlas.surfaces.sextic_sites import FACING, SexticSites, pairs_within, sites_of
from touchatlas.atlas.surfaces.sextics import Sextics, joined
from touchatlas.patch.geometry.polynomial import monomials

# How far a sextic may be off the surface where it weighs: in tolerances, and in deviations of the
# surface if that is more.
_BORNE, _SURE = 0.25, 0.5
# Distance up to which a sextic has the surface, in radii.
_HAS = 0.6
# Weight at that distance of a sextic that faces as the side does. Another has no larger share there
# than its weight over this one.
_WEIGHT = (1.0 - (_HAS / WEIGHS) ** 2) ** 3
_PRECISION = np.diag(prior_precision(Kind.SEXTIC))


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points all over a surface.

    Parameters
    ----------
    points, normals : (n, 3) float, length; unit, world
    variances : (n,) float, length^2
        Those of the surface there.
    bounds : (n,) float, length
        How far a sextic may be off there; where it is zero, none may weigh.
    sides : (n, 3) float, unit, world
        Normals of the nearest samples.
    spacing : float, length
        About the distance from one to the next.
    tree : cKDTree
    """

    points: np.ndarray
    normals: np.ndarray
    variances: np.ndarray
    bounds: np.ndarray
    sides: np.ndarray
    spacing: float
    tree: cKDTree


def fewer_sextics(
    surface: FreeFormSurface,
    points,
    normals,
    deviations,
    ends,
    drawn: int,
    spacing: float,
    tolerance: float,
    levels: Levels = Levels(),
) -> FreeFormSurface:
    """A surface of fewer sextics that is mostly off by no more than a quarter of a tolerance; the
    given one, if there is none. Where sextics of the given surface stay, it may be off by more.

    Where a radius allows, those sextics are taken that together have all points (greedy set cover);
    for the others smaller ones are tried. Where even these do not follow, those of the given
    surface stay.

    Parameters
    ----------
    surface : FreeFormSurface
        Without sharp turns.
    points, normals : (n, 3) float, length; unit, world
        On the surface.
    deviations : (n,) float, length
        Those of the surface there.
    ends : (n,) bool
        Whether the surface ends there: then no other sextic may weigh there than those of the
        surface, which tell where it ends.
    drawn : int
        So many of the first points are all over the surface: one of the sextics has each of them.
        The others, feet of samples, show narrow bends between these.
    spacing : float, length
        About the distance from one of the first to the next.
    tolerance : float, length
    levels : Levels
    """
    bounds = np.where(ends, 0.0, np.maximum(_BORNE * tolerance, _SURE * deviations))
    columns = points, normals, deviations**2, bounds, surface.sides(points)
    on = SurfacePoints(*columns, spacing, cKDTree(points))
    left, parts, radius = np.arange(len(points)) < drawn, [], np.sqrt(2.0) * surface.radius
    # Within four distances fifty points lie.
    while left.any() and radius > 4.0 * spacing:
        parts += _of_radius(on, left, radius, levels.facing)
        if sum(map(len, parts)) >= len(surface.sextics):
            return surface
        radius /= np.sqrt(2.0)
    if left.any():
        own = np.unique(surface.leading(points[left]))
        if ends.any():
            own = np.union1d(own, surface.reaching(points[ends]))
        parts.append(surface.sextics.some(own))
    # What the tolerance allows is not sought again.
    found = replace(surface, sextics=joined(parts), least=_BORNE * tolerance)
    return found if len(found.sextics) < len(surface.sextics) else surface


def _of_radius(on: SurfacePoints, left, radius: float, facing: float) -> list[Sextics]:
    """Sextics of a radius that are within the bounds where they weigh. They have points that were
    ``left`` (n,), which no longer are then."""
    middles, parts = _spread(on, np.flatnonzero(left), 0.2 * radius), []
    sites = sites_of(on.tree, on.normals, middles, radius)
    number, place, _ = pairs_within(cKDTree(on.points[middles]), on.tree, _HAS * radius)
    near = np.split(place, np.searchsorted(number, np.arange(1, len(middles))))
    has = [
        some[on.sides[some] @ axes[2] > facing] for axes, some in zip(sites.axes, near, strict=True)
    ]
    tried = np.zeros(len(middles), bool)
    for _ in range(4):
        chosen = _covering(has, left, tried)
        if not len(chosen):
            break
        batch = _fitted(on, sites.some(chosen))
        good = _most_off(on, batch) <= 1.0
        tried[chosen] = True
        for k in chosen[good].tolist():
            left[has[k]] = False
        parts.append(batch.some(np.flatnonzero(good)))
    return parts


def _spread(on: SurfacePoints, some, apart: float) -> np.ndarray:
    """Some of points (k,) that are apart, length, or face apart: one of each cube and side."""
    axis = np.abs(on.normals[some]).argmax(axis=1)
    up = on.normals[some, axis] > 0.0
    cubes = np.floor(on.points[some] / apart).astype(np.int64)
    keys = np.column_stack([cubes, axis, up])
    return np.asarray(some[np.sort(np.unique(keys, axis=0, return_index=True)[1])])


def _covering(has, left, tried) -> np.ndarray:
    """(m,) which sets of points, but for those ``tried``, have all that are ``left`` (n,) and can
    be had: each time the one that has most of them (greedy set cover)."""
    rest, chosen = left.copy(), []
    heap = [(-np.count_nonzero(rest[some]), k) for k, some in enumerate(has) if not tried[k]]
    heapify(heap)
    while heap:
        most, k = heappop(heap)
        count = np.count_nonzero(rest[has[k]])
        if count and count == -most:
            chosen.append(k)
            rest[has[k]] = False
        elif count:
            heappush(heap, (-count, k))
    return np.array(chosen, int)


def _fitted(on: SurfacePoints, sites: SexticSites) -> Sextics:
    """Sextics that follow points of a surface, and are as sure as it is."""
    found = [_followed(on, sites, number) for number in range(len(sites.middles))]
    coefficients, factors = (np.array(column) for column in zip(*found, strict=True))
    middles, radii = on.points[sites.middles], np.full(len(sites.middles), sites.radius)
    return Sextics(middles, sites.axes, radii, coefficients, factors.astype(np.float32))


def _followed(on: SurfacePoints, sites: SexticSites, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (t,) of one of the sextics, and upper triangular U (t, t) of their covariance
    U' U, by which it has on average the variance of the surface, and of what it is off.

    On the surface z follows from x and y, so that its points leave terms in z open. Points beside
    it, at a distance along its normals, show these.
    """
    some, radius = sites.members[number], sites.radius
    level = np.repeat([0.0, on.spacing, -on.spacing], len(some))
    points = np.tile(on.points[some], (3, 1)) + level[:, None] * np.tile(on.normals[some], (3, 1))
    local = (points - on.points[sites.middles[number]]) @ (sites.axes[number].T / radius)
    terms = monomials(SEXTIC_BASIS, *local.T)[: SEXTIC_BASIS.size]
    height = local[:, 2] - level / radius
    beside = np.abs(level) * (0.4 / radius)
    std = np.hypot(max(0.05 * float(np.median(on.bounds)) / radius, 1e-6), beside)
    weighted = terms / std**2
    mean = np.linalg.solve(weighted @ terms.T + _PRECISION, weighted @ height)
    off = (height - mean @ terms)[: len(some)]
    variance = on.variances[some] / radius**2 + off**2
    spread = np.maximum(np.tile(variance, 3) + beside**2, std**2)
    precision = np.divide(terms, spread, out=weighted) @ terms.T + _PRECISION
    # As in touchatlas.atlas.surfaces.sextic_fit.
    factor = np.linalg.inv(np.linalg.cholesky(precision[::-1, ::-1]))[::-1, ::-1]
    predicted = ((factor @ terms[:, : len(some)]) ** 2).sum(axis=0)
    return mean, np.asarray(factor * np.sqrt(np.mean(variance / predicted)))


def _most_off(on: SurfacePoints, batch: Sextics) -> np.ndarray:
    """(m,) by how much each sextic is off at most, in the bounds of points where it weighs,
    times its largest share there; infinite where it is folded amid what it has."""
    radius = batch.radii[0]
    number, place, away = pairs_within(cKDTree(batch.origins), on.tree, WEIGHS * radius)
    upward, sides = batch.axes[:, 2].take(number, axis=0), on.sides.take(place, axis=0)
    cosine = np.einsum("ij,ij->i", upward, sides)
    faces = (cosine > FACING) & (away < WEIGHS * radius)
    number, place, away, sides = number[faces], place[faces], away[faces], sides[faces]
    weight = (1.0 - (away / (WEIGHS * radius)) ** 2) ** 3
    weight *= (cosine[faces] - FACING) / (1.0 - FACING)
    share = np.minimum(weight / _WEIGHT, 1.0)
    points, bound = on.points.take(place, axis=0), on.bounds.take(place)
    values = batch.values(number, points)[0]
    off = np.full(len(bound), np.inf)
    np.divide(np.abs(values[:, 0]), bound, out=off, where=bound > 0.0)
    # Of every second point the place outside, of the others that inside.
    level = np.where(place % 2, on.spacing, -on.spacing)
    beside = points + level[:, None] * on.normals.take(place, axis=0)
    far = np.abs(batch.values(number, beside)[0][:, 0] - level) / (0.5 * on.spacing)
    off = np.maximum(off, far) * share
    folded = np.einsum("ij,ij->i", values[:, 1:4], sides) <= 0.0
    off[folded & (away < _HAS * radius)] = np.inf
    out = np.zeros(len(batch))
    np.maximum.at(out, number, off)
    return out
