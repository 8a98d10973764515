"""Holes: where the surface that an atlas draws has gaps that no contour crossed."""

import copy
from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.mesh.close_holes import LARGEST, SLOPE
from touchatlas.atlas.mesh.extract import open_surface
from touchatlas.atlas.mesh.triangles_across import SURE, edges_within, triangles_across

# Least part of the surface that is worth a touch, no unit. Doubled, more small holes are closed
# without a sample.
LEAST_SHARE = 1.25e-4


@dataclass(frozen=True, eq=False)
class Holes:
    """Holes of a surface.

    Parameters
    ----------
    centres : (k, 3) float, length, world
        The middle of the rim; for a hole that is closed from side to side (``close_slits``), the
        middle of the edge across it that has the largest error.
    normals : (k, 3) float, unit, world
        Outward.
    radius : (k,) float, length
        Distance of the rim from the centre, root mean square; half of the length of such an edge.
    error : (k,) float, length
        That of a surface which is drawn across the hole, exceeded once in twenty; infinite for a
        hole that cannot be closed.
    samples : int
        Number of samples of the atlas when the surface was drawn: later ones may have crossed a
        hole.
    """

    centres: np.ndarray
    normals: np.ndarray
    radius: np.ndarray
    error: np.ndarray
    samples: int = 0

    def taken(self, index) -> "Holes":
        """The holes of an index or mask."""
        centres, normals = self.centres[index], self.normals[index]
        return Holes(centres, normals, self.radius[index], self.error[index], self.samples)


NO_HOLES = Holes(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))


def drawn_holes(atlas: Atlas, tolerance: float) -> Holes:
    """The holes of the surface as it is drawn to a tolerance, length.

    Openings of the body, whose centres lie beyond rims, are left out, and holes so small that a
    touch there teaches less than ``LEAST_SHARE`` of the surface.
    """
    drawn = copy.copy(atlas)
    drawn.tolerance = tolerance
    surface = open_surface(drawn)
    if not len(surface.faces):
        return NO_HOLES
    least = LEAST_SHARE * 0.5 * igl.doublearea(surface.vertices, surface.faces).sum()
    size = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    loops = [np.array(loop) for loop in igl.boundary_loop_all(surface.faces)]
    rims = [(surface.vertices[loop], surface.normals[loop]) for loop in loops]
    edges = edges_within(surface.faces, loops)
    found = [
        _hole(*rim, within, size)
        for rim, within in zip(rims, edges, strict=True)
        if _area(rim[0]) >= least
    ]
    if not found:
        return NO_HOLES
    centres, normals, radius, error = map(np.array, zip(*found, strict=True))
    holes = Holes(centres, normals, radius, error, atlas.point_count)
    return holes.taken(~atlas.rims.beyond(holes.centres, holes.normals))


def _area(rim) -> float:
    """Area of a hole about the mean of its rim (n, 3), length^2."""
    offset = rim - rim.mean(axis=0)
    return 0.5 * float(np.linalg.norm(np.cross(offset, np.roll(offset, -1, axis=0)), axis=1).sum())


def _hole(rim, normals, edges, size: float) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Centre, outward normal, radius and error of a hole, see ``Holes``, from the points and
    normals (n, 3) of its rim in order, the edges (m, 2) between these and the diagonal of the
    surface."""
    centre = rim.mean(axis=0)
    radius, error = _closed(rim, normals)
    if np.linalg.norm(np.ptp(rim, axis=0)) <= LARGEST * size:
        return centre, _outward(rim, normals, centre, np.inf), radius, error
    across = triangles_across(rim, normals, edges)
    if across is None or not len(across.error):
        return centre, _outward(rim, normals, centre, np.inf), radius, np.inf
    worst, centre = int(across.error.argmax()), across.widest(rim)
    a, b = rim[across.diagonals[worst]]
    width = float(np.linalg.norm(b - a))
    return centre, _outward(rim, normals, centre, width), 0.5 * width, float(across.error[worst])


def _outward(rim, normals, centre, reach: float) -> np.ndarray:
    """(3,) unit normal of a hole from that part of its rim (n, 3) which is within ``reach``.

    Normals of the rim add where the surface is level. At the crest of a wall they are opposed, and
    the directions from the surface into the hole add.
    """
    along = np.roll(rim, -1, axis=0) - rim
    length = np.linalg.norm(along, axis=1)
    into = np.cross(along, normals) + length[:, None] * normals
    found = into[np.linalg.norm(rim - centre, axis=1) <= reach].sum(axis=0)
    return np.asarray(found / max(np.linalg.norm(found), np.finfo(float).tiny))


def _closed(rim, normals) -> tuple[float, float]:
    """Radius and error of a hole that is closed, see ``Holes``, from the points and normals (n, 3)
    of its rim.

    It is closed as on a sphere, where the rim is as steep everywhere. What its slopes differ adds
    to what is expected of any hole.
    """
    offset = rim - rim.mean(axis=0)
    away = np.linalg.norm(offset, axis=1)
    slope = np.einsum("ij,ij->i", normals, offset) / np.maximum(away, np.finfo(float).tiny)
    radius = float(np.sqrt((away * away).mean()))
    return radius, SURE * radius * float(np.hypot(SLOPE, slope.std()))
