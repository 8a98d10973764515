"""Stray pieces: a closed surface is one piece for each component of the patch graph."""

from dataclasses import replace

import igl
import networkx as nx
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.mesh.surface import Surface
from touchatlas.atlas.state import AtlasState

# Least area of a piece, in cores of its largest patch: the star of one touch makes a hexagon, which
# is four fifths of a disc. Doubled, more of what lone patches show is removed.
_LEAST_AREA = 0.3
# Least diagonal of the bounding box of a piece, over that of the surface: as for holes. Doubled,
# bodies of a fifth of the scene are removed.
_LEAST_SIZE = 0.1


def without_stray_pieces(state: AtlasState, surface: Surface) -> Surface:
    """The surface without pieces that the patch graph has no room for, and their number.

    Patches that are connected and have no open outline cover one connected surface. Another piece
    in their cells is a second zero of a polynomial beside the surface, not a part of it. So of all
    pieces that lie in the cells of such a component the one of the largest area is kept. Where an
    outline is open the surface may rightly end and begin again. There only pieces are removed
    that are smaller than a tenth of the surface, or than a single patch would show, if patches are
    filled in between touches.
    """
    count, piece = _pieces(surface)
    if count < 2:
        return surface
    part, closed = _parts(state)
    area = np.bincount(
        piece[surface.faces[:, 0]], igl.doublearea(surface.vertices, surface.faces), count
    )
    # A piece belongs to the part in whose cells its first vertex lies: pieces cross no other part.
    _, first = np.unique(piece, return_index=True)
    home = part[surface.patch[first]]
    order = np.lexsort((-area, home))
    largest = order[np.append(True, home[order][1:] != home[order][:-1])]
    # A vertex without triangles is no piece.
    stray = closed[home] & (area > 0.0)
    stray[largest] = False
    if state.fills:
        stray |= (area > 0.0) & _are_small(state, surface, count, piece, area)
    if not stray.any():
        return surface
    return replace(
        surface.only(~stray[piece]), stray_pieces=surface.stray_pieces + int(stray.sum())
    )


def _are_small(state: AtlasState, surface: Surface, count: int, piece, area) -> np.ndarray:
    """(n,) whether pieces are smaller than one patch shows, or than a tenth of the surface; the one
    of the largest area is not."""
    core, points = np.zeros(count), surface.vertices
    np.maximum.at(core, piece, np.pi * state.table.weight[surface.patch])
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, piece, points)
    np.maximum.at(high, piece, points)
    size = np.linalg.norm(high - low, axis=1)
    small = (area < _LEAST_AREA * core) | (
        size < _LEAST_SIZE * np.linalg.norm(np.ptp(points, axis=0))
    )
    small[area.argmax()] = False
    return small


def _pieces(surface: Surface) -> tuple[int, np.ndarray]:
    """Number of connected pieces, and the piece (v,) of each vertex."""
    count, faces = len(surface.vertices), surface.faces
    sides = np.concatenate([faces[:, :2], faces[:, 1:]])
    joined = coo_array((np.ones(len(sides), np.int8), tuple(sides.T)), shape=(count, count))
    found, label = connected_components(joined, directed=False)
    return int(found), label


def _parts(state: AtlasState) -> tuple[np.ndarray, np.ndarray]:
    """The component of the patch graph (rows,) of each row, and whether each one is closed."""
    part = np.zeros(state.table.size, int)
    components = list(nx.connected_components(state.graph))
    for number, rows in enumerate(components):
        part[list(rows)] = number
    bare = state.table.rows[state.open_outlines().any(axis=1)]
    closed = np.ones(len(components), bool)
    closed[part[bare]] = False
    return part, closed
