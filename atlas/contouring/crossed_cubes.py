"""Crossed cubes: sheets of the surface within the cubes of a lattice, and what joins them."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.contouring.cube_flood import Nodes, edge_keys, flood
from touchatlas.atlas.contouring.cube_lattice import EDGES
from touchatlas.atlas.contouring.cube_sheets import edge_ends, sheets_of
from touchatlas.atlas.contouring.quadric_error import seen
from touchatlas.atlas.contouring.weld import collapsed
from touchatlas.atlas.records.surface import manifold

# Distance below which two vertices are one, in edges. Doubled, nothing changes.
_SAME = 1e-6
# Least height of a triangle over its longest side that is no degenerate one. Doubled, slivers
# twice as wide are avoided where the other diagonal allows it.
_THIN = 1e-3


@dataclass(frozen=True, eq=False)
class CrossedCubes:
    """The sheets within the cubes that the surface passes.

    Parameters
    ----------
    nodes : Nodes
        Corners of the cubes.
    edges : (e,) int
        Keys of the lattice edges that the surface crosses.
    crossing, sheet : (n,) int
        Crossed edge and sheet at each side of a cube that the surface crosses.
    low : (v, 3) float, length
        Lowest corner of the cube of each sheet.
    quads : (q, 4) int
        Sheets around each crossed edge with all four cubes, counter-clockwise from outside.
    """

    nodes: Nodes
    edges: np.ndarray
    crossing: np.ndarray
    sheet: np.ndarray
    low: np.ndarray
    quads: np.ndarray


def crossed_cubes(at, at_corners, seeds, edge: float) -> CrossedCubes | None:
    """The sheets within cubes of an edge, length, of the surface of which ``dual_contour`` makes
    triangles; None where no cube near the seeds is crossed."""
    nodes, cubes, inside = flood(at_corners, seeds, edge)
    if not len(cubes):
        return None
    sheets = sheets_of(cubes, inside, lambda points: seen(at, points * edge + nodes.start)[0] < 0.0)
    cube, local = np.nonzero(sheets >= 0)
    sheet = sheets[cube, local]
    edges, crossing = np.unique(edge_keys(cubes)[cube, local], return_inverse=True)
    low = nodes.points(cubes[cube[np.unique(sheet, return_index=True)[1]]])
    quads = _quads(crossing, local, sheet, inside[cube, edge_ends()[local, 0]])
    return CrossedCubes(nodes, edges, crossing, sheet, low, quads)


def _quads(crossing, local, sheet, inside) -> np.ndarray:
    """(q, 4) sheets around each crossed edge with all four cubes, counter-clockwise from outside.

    Parameters
    ----------
    crossing, local, sheet : (n,) int
        Crossed lattice edge, its place in the cube and its sheet there, for each side of a cube.
    inside : (n,) bool
        Whether the lower end of the edge is inside.
    """
    axis = EDGES[:, 3]
    one, two = (EDGES[np.arange(12), (axis + k) % 3] for k in (1, 2))
    # An edge at the lower side of its cube has that cube on its upper side.
    turn = np.array([[2, 3], [1, 0]])[two, one]
    order = np.lexsort((turn[local], crossing))
    whole = np.repeat(np.bincount(crossing), np.bincount(crossing)) == 4
    order = order[whole].reshape(-1, 4)
    quads = sheet[order]
    return np.where(inside[order[:, :1]], quads, quads[:, ::-1])


def across_of(corners):
    """Normals (..., 3) of triangles (..., 3, 3), as long as twice their areas, and whether each is
    degenerate (...)."""
    sides = np.roll(corners, -1, axis=-2) - corners
    across = np.cross(sides[..., 0, :], sides[..., 1, :])
    longest = (sides * sides).sum(axis=-1).max(axis=-1)
    return across, np.linalg.norm(across, axis=-1) < _THIN * longest


def joined(vertices, faces, edge: float):
    """The manifold of triangles, of which edges of no extent are collapsed."""
    group = collapsed(vertices, faces, _SAME * edge)
    faces, index = manifold(group[faces])
    return vertices[index], faces
