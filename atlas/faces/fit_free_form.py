"""Fit a free-form face: overlapping sextics, as large as they follow the samples, and kriging."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.free_form_surface import FreeFormSurface
from touchatlas.atlas.faces.grow import evenly
from touchatlas.atlas.faces.kinds import Kind
from touchatlas.atlas.faces.piece import Piece
from touchatlas.atlas.faces.residual_kriging import amplitudes_of, krige, nearest_of
from touchatlas.atlas.faces.sextic_fits import Equations, SexticFits, coefficients_of
from touchatlas.atlas.faces.sextic_prior import with_common_prior
from touchatlas.atlas.faces.sextic_sites import SexticSites, sites_of

# Factor by which the radius of the sextics shrinks until they follow the samples. Nearer to 1,
# radii are a little larger, and more are tried.
_SHRINK = 0.7
# Least number of samples of a sextic, in the median, for a smaller radius: twice its parameters.
# Doubled, narrow bends are rounded off.
_LEAST = 98
# Sextics follow the samples where the residuals about half of them have an amplitude of no more
# than this, in deviations of a sample. At 0.7 to 2.5 scans are known about as well. Doubled, bends
# are left to kriging, which knows them less.
_FOLLOWS = 1.4
# Samples about which residuals are looked at to tell that. Doubled, it takes longer, and the radius
# is the same.
_LOOKED_AT = 60
# Least standard deviation of a sample, in radii: below it rounding shows. Doubled, nothing changes.
_LEAST_STD = 1e-5
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
    values = found.at(points)
    rest, side = values[:, 0], values[:, 1:4]
    rest = krige(points, side, rest, sextics.sites.radius, std)
    return replace(found, normals=side, rest=rest, fits=fits)


def _largest(tree, fits: SexticFits, radius: float) -> "_Sextics":
    """The sextics of the largest radius, up to one, with which they follow the samples, or with
    which they are known."""
    near = nearest_of(tree, evenly(np.arange(tree.n), _LOOKED_AT))
    while True:
        sites = sites_of(tree, fits.normals, radius)
        found = _Sextics(fits, sites, fits.equations(sites))
        counts = tree.query_ball_point(found.origins, _SHRINK * radius, return_length=True)
        if np.median(counts) < _LEAST or found.follow(near):
            return found
        radius *= _SHRINK


@dataclass(frozen=True, eq=False)
class _Sextics:
    """Sextics of one radius and what samples say of them."""

    fits: SexticFits
    sites: SexticSites
    equations: Equations

    @property
    def origins(self) -> np.ndarray:
        """(m, 3) middles, length, world."""
        return self.fits.points[self.sites.middles]

    def follow(self, near) -> bool:
        """Whether they follow the samples, of which groups of neighbours (g, k) are looked at."""
        nothing = np.zeros(self.equations.information.shape)
        surface = self._surface(coefficients_of(self.equations), nothing)
        used, place = np.unique(near, return_inverse=True)
        values, place = surface.at(self.fits.points[used]), place.reshape(near.shape)
        amplitudes = amplitudes_of(values[place, 1:4], values[place, 0], self.fits.std)
        return bool(np.median(amplitudes) <= _FOLLOWS * self.fits.std)

    def with_prior(self) -> FreeFormSurface:
        """The surface that they make with their common prior."""
        noise = self.fits.std / self.sites.radius
        return self._surface(*with_common_prior(self.equations, noise))

    def _surface(self, coefficients, covariances) -> FreeFormSurface:
        radius = self.sites.radius
        rows = zip(self.origins, self.sites.axes, coefficients, covariances, strict=True)
        pieces = tuple(Piece(Kind.SEXTIC, o, a, radius, c, v) for o, a, c, v in rows)
        return FreeFormSurface(pieces, self.fits.points, self.fits.normals)


def are_on(surface: FreeFormSurface, points, std: float) -> np.ndarray:
    """(n,) whether samples at points (n, 3) lie on a surface within the deviations of both, where
    the surface is known well enough to tell."""
    values = surface.values(points)
    on = values[:, 0] ** 2 <= _SURE**2 * (values[:, 4] + std**2)
    return np.asarray(on & (values[:, 4] <= _VAGUE**2 * std**2))
