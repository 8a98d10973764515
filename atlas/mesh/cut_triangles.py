"""Cutting triangles whose edges were cut: what is put in the place of each."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from touchatlas.atlas.graph.sheets import SheetNeighbours


def cut_faces(faces, cut: dict[tuple[int, int], int], sheets, neighbours: SheetNeighbours):
    """Triangles (g, 3) in the place of triangles (f, 3), some edges of which were cut.

    Parameters
    ----------
    faces : (f, 3) int
    cut : dict
        Ascending pairs of vertices to the vertex between them.
    sheets : (v, 3) int
        Patches whose sheets a vertex lies on, filled up with -1.
    neighbours : Kin

    Returns
    -------
    faces : (g, 3) int
        Vertices from v on are new: the middles.
    middles : list of pairs
        Of each new vertex, which lies inside a triangle between three sheets, the vertices of
        that triangle and the three patches.
    """
    between = np.array(sorted(cut), int).reshape(-1, 2)
    size = len(sheets) + 1
    names = between[:, 0] * size + between[:, 1]
    low, high = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)]), axis=0)
    is_cut = np.isin(low * size + high, names)
    mixed = (sheets[faces, 1] >= 0).all(axis=1) | is_cut.any(axis=1)
    out: list[list[int]] = []
    middles: list[tuple[list[int], list[int]]] = []
    for face in faces[mixed].tolist():
        ring = []
        for k in range(3):
            u, v = face[k], face[(k + 1) % 3]
            ring.append(u)
            if (middle := cut.get((min(u, v), max(u, v)))) is not None:
                ring.append(middle)
        three = _three_sheets(ring, sheets, neighbours)
        if three is None:
            out += _fan(ring, face, sheets, neighbours)
        else:
            centre = len(sheets) + len(middles)
            middles.append((face, three))
            out += [[centre, a, b] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    return np.concatenate([faces[~mixed], np.array(out, int).reshape(-1, 3)]), middles


def _three_sheets(ring: list[int], sheets, neighbours: SheetNeighbours) -> list[int] | None:
    """Three patches of different sheets, pairwise creased, among those of a ring of vertices of
    which none lies on all three."""
    found: list[int] = []
    for i in dict.fromkeys(int(i) for v in ring for i in sheets[v] if i >= 0):
        if all(i != j and i not in neighbours[j] for j in found):
            found.append(i)
    if len(found) != 3:
        return None
    for v in ring:
        mine = {int(i) for i in sheets[v] if i >= 0}
        if all(any(i == j or i in neighbours[j] for j in mine) for i in found):
            return None
    return found


def _fan(ring: list[int], face: list[int], sheets, neighbours: SheetNeighbours) -> list[list[int]]:
    """Triangles of a ring of three, four or five vertices: an ear with one old vertex first."""
    if len(ring) == 3:
        return [ring]
    if len(ring) == 4:
        # The new vertex, and the old one that faces it.
        at = next(k for k, v in enumerate(ring) if v not in face)
        a, b, c, d = ring[at:] + ring[:at]
        return [[a, b, c], [a, c, d]]
    if len(ring) == 5:
        # Two new ones about one old: its ear, and a quadrilateral.
        at = next(k for k in range(5) if ring[k - 1] not in face and ring[(k + 1) % 5] not in face)
        a, b, c, d, e = ring[at:] + ring[:at]
        return [[a, b, e], [b, c, d], [b, d, e]]
    a, b, c, d, e, f = ring if ring[0] in face else ring[1:] + ring[:1]
    return [[a, b, f], [b, c, d], [d, e, f], [b, d, f]]


def weld(points, faces, may, tolerance: float):
    """Make vertices at one place one: those of the vertices (v,) that ``may`` be.

    Returns
    -------
    faces : (g, 3) int
        Without those that have become edges.
    kept : (w,) int
        The vertices that are left, in the numbering of the faces.
    """
    some = np.flatnonzero(may)
    near = cKDTree(points[some]).query_pairs(tolerance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(near)), near.T), (len(some), len(some)))
    _, group = connected_components(graph, directed=False)
    same = np.arange(len(points))
    same[some] = some[np.unique(group, return_index=True)[1][group]]
    faces = same[faces]
    one, two, three = faces.T
    faces = faces[(one != two) & (two != three) & (three != one)]
    # Two triangles of the same vertices lie on each other: a fold that encloses nothing.
    _, update_creases, count = np.unique(
        np.sort(faces), axis=0, return_inverse=True, return_counts=True
    )
    faces = faces[count[update_creases.ravel()] == 1]
    kept, faces = np.unique(faces, return_inverse=True)
    return faces.reshape(-1, 3), kept
