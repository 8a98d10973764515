"""Holes: where the surface that an atlas draws has gaps that no contour crossed."""

import copy
from collections.abc import Iterator
from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.close_holes import LARGEST, SLOPE
from touchatlas.atlas.mesh.extract import open_surface
from touchatlas.atlas.mesh.surface import Surface

# Least part of the surface that is worth a touch, no unit. Doubled, more small holes are closed
# without a sample.
LEAST_SHARE = 1.25e-4
# Standard deviations that hold 95 % of a normal error.
_SURE = 1.96


@dataclass(frozen=True, eq=False)
class Holes:
    """Holes of a surface.

    Parameters
    ----------
    centres : (k, 3) float, length, world
    normals : (k, 3) float, unit, world
        Outward.
    radius : (k,) float, length
        Distance of the rim from the centre, root mean square.
    error : (k,) float, length
        That of a surface which is drawn across the hole, exceeded once in twenty; infinite for a
        hole that is too large to be closed.
    """

    centres: np.ndarray
    normals: np.ndarray
    radius: np.ndarray
    error: np.ndarray

    def taken(self, index) -> "Holes":
        """The holes of an index or mask."""
        return Holes(*(column[index] for column in vars(self).values()))


NO_HOLES = Holes(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


def drawn_holes(atlas: Atlas, tolerance: float) -> Holes:
    """The holes of the surface as it is drawn to a tolerance, length.

    Openings of the body, whose centres lie beyond rims, are left out, and holes so small that a
    touch there teaches less than ``LEAST_SHARE`` of the surface.
    """
    drawn = copy.copy(atlas)
    drawn.tolerance = tolerance
    surface = open_surface(drawn)
    least = LEAST_SHARE * 0.5 * igl.doublearea(surface.vertices, surface.faces).sum()
    size = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    rims = [(p, n) for p, n, area in _rims(surface) if area >= least and n.sum(axis=0).any()]
    centres = np.reshape([points.mean(axis=0) for points, _ in rims], (-1, 3))
    outward = np.reshape([normals.sum(axis=0) for _, normals in rims], (-1, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    closed = np.reshape([_closed(*rim, size) for rim in rims], (-1, 2))
    return Holes(centres, outward, *closed.T).taken(~atlas.rims.beyond(centres, outward))


def _rims(surface: Surface) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Points and normals (n, 3) at each hole, and its area about the mean of the points."""
    vertices, ends = np.unique(igl.boundary_facets(surface.faces)[0], return_inverse=True)
    sides = ends.reshape(-1, 2)
    joined = coo_array((np.ones(len(sides), bool), tuple(sides.T)), (len(vertices),) * 2)
    loop = connected_components(joined)[1]
    points, normals = surface.vertices[vertices], surface.normals[vertices]
    for k in range(loop.max(initial=-1) + 1):
        own = loop == k
        first, second = (points[sides[own[sides[:, 0]]]] - points[own].mean(axis=0)).swapaxes(0, 1)
        area = 0.5 * np.linalg.norm(np.cross(first, second), axis=1).sum()
        yield points[own], normals[own], float(area)


def _closed(rim, normals, size: float) -> tuple[float, float]:
    """Radius and error of a hole, see ``Holes``, from the points and normals (n, 3) of its rim and
    the diagonal of the surface.

    It is closed as on a sphere, where the rim is as steep everywhere. What its slopes differ adds
    to what is expected of any hole.
    """
    offset = rim - rim.mean(axis=0)
    away = np.linalg.norm(offset, axis=1)
    slope = np.einsum("ij,ij->i", normals, offset) / np.maximum(away, np.finfo(float).tiny)
    radius = float(np.sqrt((away * away).mean()))
    error = _SURE * radius * float(np.hypot(SLOPE, slope.std()))
    return radius, error if np.linalg.norm(np.ptp(rim, axis=0)) <= LARGEST * size else np.inf
