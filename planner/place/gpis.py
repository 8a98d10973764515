"""GPIS: the place where a Gaussian-process implicit surface is least sure. A baseline.

A Gaussian process over all space is 0 at samples of the surface and d at points a length d outside
of them (Williams and Fitzgibbon, Gaussian process implicit surfaces, 2006; Dragiev, Toussaint and
Gienger, Gaussian process implicit surfaces for shape estimation and grasping, ICRA 2011). Björkman
et al. touch where its variance is largest on the zero level set (Enhancing visual perception of
shape through tactile glances, IROS 2013).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial.distance import cdist

from touchatlas.atlas.known_surface import blend_of_patches
from touchatlas.planner.place.choose import Target, View, known_places, open_places
from touchatlas.planner.probe_plan import Reason

# Samples of the surface that are asked, evenly along the contours. Doubled, a plan takes six times
# as long, and the variance between contours is as before.
_MOST = 500
# Distance of the points outside, and least deviation of an observation, in extents: the one is a
# quarter of a thin wall, and the other keeps 1,000 equations solvable. Doubled, walls are met on
# their other side, or detail is lost.
_OUTSIDE, _NUGGET = 0.005, 1e-4
# Largest distance for which the covariance holds, in extents: places beyond the box of the samples
# are within it. Doubled, the variance is twice as large everywhere, and the order of places stays.
_SIZE = 1.5
# Newton steps onto the zero level set, and the longest way there, in extents. Doubled, nothing
# changes, or places are taken on another sheet.
_STEPS, _FARTHEST = 3, 0.1


@dataclass(frozen=True, eq=False)
class ImplicitSurface:
    """A Gaussian process whose zero level set is a surface.

    Parameters
    ----------
    points : (n, 3) float, length
        Where it was observed.
    factor : (n, n) float, length^2
        Lower Cholesky factor of the covariance of the observations.
    weights : (n,) float, 1/length
        What the covariance is multiplied by to give the mean.
    size : float, length
        Largest distance for which the covariance holds.
    """

    points: np.ndarray
    factor: np.ndarray
    weights: np.ndarray
    size: float

    @classmethod
    def of_samples(cls, points, normals, noise: float, extent: float) -> "ImplicitSurface":
        """The surface of samples (n, 3) with outward normals (n, 3), length; unit."""
        outside = _OUTSIDE * extent
        points = np.concatenate([points, points + outside * normals])
        values = np.repeat([0.0, outside], len(points) // 2)
        size = _SIZE * extent
        covariance = thin_plate(cdist(points, points), size)
        covariance[np.diag_indices_from(covariance)] += noise**2 + (_NUGGET * extent) ** 2
        factor, lower = cho_factor(covariance, lower=True)
        return cls(points, np.tril(factor), cho_solve((factor, lower), values), size)

    def mean(self, points) -> np.ndarray:
        """(m,) expected signed distance at points (m, 3), length."""
        out: np.ndarray = thin_plate(cdist(points, self.points), self.size) @ self.weights
        return out

    def variance(self, points) -> np.ndarray:
        """(m,) variance at points (m, 3), length^2."""
        cross = thin_plate(cdist(self.points, points), self.size)
        taken = (solve_triangular(self.factor, cross, lower=True) ** 2).sum(axis=0)
        out: np.ndarray = np.maximum(self.size**2 - taken, 0.0)
        return out

    def feet(self, points, normals, extent: float) -> np.ndarray:
        """(m, 3) where lines through points (m, 3) along normals (m, 3) meet the surface; the
        points themselves where they do not meet it near by."""
        along, step = np.zeros(len(points)), _OUTSIDE * extent
        for _ in range(_STEPS):
            place = points + along[:, None] * normals
            value, ahead = self.mean(place), self.mean(place + step * normals)
            rise = np.maximum(ahead - value, 0.1 * step)
            along = along - value * step / rise
        near = np.abs(along) <= _FARTHEST * extent
        return points + np.where(near, along, 0.0)[:, None] * normals


def thin_plate(distance, size: float) -> np.ndarray:
    """The covariance of a thin plate, length^2, at distances (n, m): the cubic of Williams and
    Fitzgibbon, scaled to the variance ``size`` squared, and 0 beyond ``size``.

    >>> thin_plate(np.array([0.0, 1.0, 2.0, 3.0]), 2.0)
    array([4., 2., 0., 0.])
    """
    ratio = np.minimum(distance / size, 1.0)
    out: np.ndarray = size**2 * ((2.0 * ratio - 3.0) * ratio**2 + 1.0)
    return out


def gpis(view: View, _: np.random.Generator | None) -> Target | None:
    """The place, known to the atlas or not, whose foot on the implicit surface has the largest
    variance."""
    (points, homes), known = open_places(view), known_places(view)
    found = blend_of_patches(view.atlas, points)
    ahead = np.where(found.known[:, None], found.normal, view.atlas.table.axes[homes, 2])
    places = np.concatenate([points, known.points])
    normals = np.concatenate([ahead, known.normals])
    if not len(places):
        return None
    surface = _surface(view)
    feet = surface.feet(places, normals, view.extent)
    best = int(surface.variance(feet).argmax())
    reason = Reason.EXPAND if best < len(points) else Reason.REFINE
    return Target(places[best], normals[best], reason)


def _surface(view: View) -> ImplicitSurface:
    """The implicit surface of some samples of an atlas."""
    pool, table = view.atlas.membership.pool, view.atlas.table
    count = len(pool.points)
    some = np.unique(np.linspace(0, count - 1, min(count, _MOST)).astype(int))
    noise = float(np.median(table.measurement_std[table.rows]))
    return ImplicitSurface.of_samples(pool.points[some], pool.normals[some], noise, view.extent)
