"""Fit a free-form face: overlapping sextics, as large as they follow the samples, and kriging."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.free_form_surface import FACING, FreeFormSurface
from touchatlas.atlas.faces.grow import evenly
from touchatlas.atlas.faces.kinds import Kind
from touchatlas.atlas.faces.piece import Piece
from touchatlas.atlas.faces.residual_kriging import amplitudes_of, krige, nearest_of
from touchatlas.atlas.faces.sextic_fits import Equations, SexticFits, coefficients_of
from touchatlas.atlas.faces.sextic_prior import with_common_prior
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal

# Factor by which the radius of the sextics shrinks until they follow the samples. Nearer to 1, radii
# are a little larger, and more are tried.
_SHRINK = 0.7
# Distance from the middle of a sextic within which no other one has its middle, in radii. Doubled,
# a quarter of the sextics is left, and they meet where they are least sure.
_APART = 0.5
# Least number of samples of a sextic, in the median, for a smaller radius: twice its parameters.
# Doubled, narrow bends are rounded off.
_LEAST = 98
# Sextics follow the samples where the residuals about half of them have an amplitude of no more than
# this, in deviations of a sample. At 0.7 to 2.5 scans are known about as well. Doubled, bends are
# left to kriging, which knows them less.
_FOLLOWS = 1.4
# Cosine of the normals of two samples below which both may be the middles of sextics however near
# they are: 60 degrees. Doubled, tubes have twice as many.
_TURNED = 0.5
# Deviations up to which a sample without a label is on the surface. Doubled, samples of other
# features are taken for those of the face.
_SURE = 3.0
# Deviation of the surface, in deviations of a sample, from which a sample without a label tells
# nothing: it may be of any face. Doubled, samples of other faces bend the surface beyond its edge.
_VAGUE = 5.0
# Least square of the sine of a tangent and the normal. Doubled, nothing changes.
_LEAST_TANGENT = 1e-6
# Most samples of a fit. Doubled, it takes longer.
_FITTED = 400
# Samples about which residuals are looked at to tell whether sextics follow. Doubled, it takes
# longer, and the radius is the same.
_LOOKED_AT = 100
# Least standard deviation of a sample, in radii: below it rounding shows. Doubled, nothing changes.
_LEAST_STD = 1e-5


def fit_free_form(
    points, normals, std: float, radius: float, before: FreeFormSurface | None = None
) -> FreeFormSurface:
    """The surface of a face from its samples: sextics of the largest radius with which they follow
    the samples, and kriging of what they leave out.

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
    tree = cKDTree(points)
    fits = SexticFits(points, normals, std)
    if before is not None and before.fits is not None:
        fits = before.fits.following(points, normals, std)
    sextics = _largest(tree, fits, radius)
    found = sextics.with_prior()
    values = found.values(points)
    rest, side = values[:, 0], values[:, 1:4]
    rest = krige(points, side, rest, sextics.radius, std)
    return replace(found, normals=side, rest=rest, fits=fits)


def _largest(tree, fits: SexticFits, radius: float) -> "_Sextics":
    """The sextics of the largest radius, up to one, with which they follow the samples, or with
    which they are known."""
    near = nearest_of(tree, evenly(np.arange(tree.n), _LOOKED_AT))
    while True:
        found = _of_radius(tree, fits, radius)
        counts = tree.query_ball_point(found.origins, _SHRINK * radius, return_length=True)
        if np.median(counts) < _LEAST or found.follow(near):
            return found
        radius *= _SHRINK


def _of_radius(tree, fits: SexticFits, radius: float) -> "_Sextics":
    """The sextics of one radius."""
    points, normals = fits.points, fits.normals
    left, sites, members, axes = np.ones(tree.n, bool), [], [], []
    for site in range(tree.n):
        if left[site]:
            near = np.sort(tree.query_ball_point(points[site], radius))
            cosine = normals[near] @ normals[site]
            mine = near[cosine > FACING]
            some = evenly(mine, _FITTED)
            sites.append(site)
            members.append(some)
            axes.append(_axes(points[some], points[site], normals[mine].mean(axis=0)))
            away = ((points[near] - points[site]) ** 2).sum(axis=1)
            left[near[(away <= (_APART * radius) ** 2) & (cosine > _TURNED)]] = False
            left[site] = False
    frames = np.array(axes)
    equations = fits.equations(sites, members, frames, radius)
    return _Sextics(fits, radius, np.array(sites), frames, equations)


@dataclass(frozen=True, eq=False)
class _Sextics:
    """Sextics of one radius about samples ``sites`` (m,) with axes (m, 3, 3), and what the samples
    say of them."""

    fits: SexticFits
    radius: float
    sites: np.ndarray
    axes: np.ndarray
    equations: Equations

    @property
    def origins(self) -> np.ndarray:
        """(m, 3) middles, length, world."""
        return self.fits.points[self.sites]

    def follow(self, near) -> bool:
        """Whether they follow the samples, groups of which (g, k) are looked at."""
        nothing = np.zeros(self.equations.information.shape)
        surface = self._surface(coefficients_of(self.equations), nothing)
        used, place = np.unique(near, return_inverse=True)
        values, place = surface.values(self.fits.points[used]), place.reshape(near.shape)
        amplitudes = amplitudes_of(values[place, 1:4], values[place, 0], self.fits.std)
        return bool(np.median(amplitudes) <= _FOLLOWS * self.fits.std)

    def with_prior(self) -> FreeFormSurface:
        """The surface that they make with their common prior."""
        return self._surface(*with_common_prior(self.equations, self.fits.std / self.radius))

    def _surface(self, coefficients, covariances) -> FreeFormSurface:
        rows = zip(self.origins, self.axes, coefficients, covariances, strict=True)
        pieces = tuple(Piece(Kind.SEXTIC, o, a, self.radius, c, v) for o, a, c, v in rows)
        return FreeFormSurface(pieces, self.fits.points, self.fits.normals)


def _axes(points, origin, normal) -> np.ndarray:
    """Axes with a normal, the first towards the farthest of the points (n, 3): they turn as these
    do."""
    offset = points - origin
    square = (offset * offset).sum(axis=1)
    normal = normal / np.sqrt(normal @ normal)
    tangent = offset[square.argmax()]
    across = tangent - (tangent @ normal) * normal
    if not across @ across > _LEAST_TANGENT * square.max():
        tangent = any_tangent(normal)
    return axes_from_normal(normal, tangent)


def are_on(surface: FreeFormSurface, points, std: float) -> np.ndarray:
    """(n,) whether samples at points (n, 3) lie on a surface within the deviations of both, where
    the surface is known well enough to tell."""
    values = surface.values(points)
    on = values[:, 0] ** 2 <= _SURE**2 * (values[:, 4] + std**2)
    return np.asarray(on & (values[:, 4] <= _VAGUE**2 * std**2))
