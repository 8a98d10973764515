"""Stray pieces: pieces of a surface that no sample supports, or that are small beside it."""

from dataclasses import replace

import igl
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.records.surface import Surface

# Least diagonal of the bounding box of a piece, over that of the surface: as for holes. Doubled,
# bodies of a fifth of the scene are removed.
LEAST_SIZE = 0.1


def without_stray_pieces(surface: Surface, samples, least: float = LEAST_SIZE) -> Surface:
    """The surface without stray pieces, and their number.

    Between samples the field may have another zero beside the surface. A piece there is no
    sample's nearest, or it is small. The one of the largest area stays.

    Parameters
    ----------
    surface : Surface
    samples : (n, 3) float, length, world
        Points on the body.
    least : float
        Diagonal of the bounding box of a piece, over that of the surface, below which it is small.
    """
    piece = igl.vertex_components(surface.faces) if len(surface.faces) else np.zeros(0, int)
    count = int(piece.max(initial=-1)) + 1
    if count < 2:
        return surface
    points = surface.vertices
    nearest = piece[cKDTree(points).query(samples)[1]]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, piece, points)
    np.maximum.at(high, piece, points)
    stray = np.linalg.norm(high - low, axis=1) < least * np.linalg.norm(np.ptp(points, axis=0))
    stray |= np.bincount(nearest, minlength=count) == 0
    area = np.bincount(piece[surface.faces[:, 0]], igl.doublearea(points, surface.faces), count)
    stray[area.argmax()] = False
    if not stray.any():
        return surface
    strays = surface.stray_pieces + int(stray.sum())
    return replace(surface.only(~stray[piece]), stray_pieces=strays)
