"""Cut triangles: the smaller triangles that replace one whose edges were cut."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from touchatlas.atlas.graph.sheets import SheetNeighbours


def cut_faces(faces, cut: dict[tuple[int, int], int], sheets, neighbours: SheetNeighbours):
    """Triangles (g, 3) that replace triangles (f, 3), some edges of which were cut.

    Parameters
    ----------
    faces : (f, 3) int
    cut : dict
        Ascending pairs of vertices to the vertex between them.
    sheets : (v, 3) int
        Patches whose sheets a vertex lies on, filled up with -1.
    neighbours : SheetNeighbours

    Returns
    -------
    faces : (g, 3) int
        Vertices from v on are the middles.
    middles : list of pairs
        For each new vertex inside a triangle between three sheets, the vertices of that triangle
        and the three patches.
    """
    mixed = _is_mixed(faces, cut, sheets)
    out: list[list[int]] = []
    middles: list[tuple[list[int], list[int]]] = []
    for face in faces[mixed].tolist():
        loop = []
        for k in range(3):
            u, v = face[k], face[(k + 1) % 3]
            loop.append(u)
            if (middle := cut.get((min(u, v), max(u, v)))) is not None:
                loop.append(middle)
        three = _three_sheets(loop, sheets, neighbours)
        if three is None:
            out += _triangulated(loop, face)
        else:
            centre = len(sheets) + len(middles)
            middles.append((face, three))
            out += [[centre, a, b] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
    return np.concatenate([faces[~mixed], np.array(out, int).reshape(-1, 3)]), middles


def _is_mixed(faces, cut, sheets) -> np.ndarray:
    """(f,) whether an edge of a triangle was cut, or all its vertices lie on creases."""
    between = np.array(sorted(cut), int).reshape(-1, 2)
    size = len(sheets) + 1
    keys = between[:, 0] * size + between[:, 1]
    low, high = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)]), axis=0)
    is_cut = np.isin(low * size + high, keys)
    return np.asarray((sheets[faces, 1] >= 0).all(axis=1) | is_cut.any(axis=1))


def _three_sheets(loop: list[int], sheets, neighbours: SheetNeighbours) -> list[int] | None:
    """Patches of the three sheets of a loop of vertices; None where it has fewer or more sheets,
    or a vertex that lies on all three."""
    found: list[int] = []
    for i in dict.fromkeys(int(i) for v in loop for i in sheets[v] if i >= 0):
        if all(i != j and i not in neighbours[j] for j in found):
            found.append(i)
    if len(found) != 3:
        return None
    for v in loop:
        mine = {int(i) for i in sheets[v] if i >= 0}
        if all(any(i == j or i in neighbours[j] for j in mine) for i in found):
            return None
    return found


def _triangulated(loop: list[int], face: list[int]) -> list[list[int]]:
    """Triangles of a loop of three to six vertices: those of the triangle ``face`` and a new one on
    each edge that was cut."""
    if len(loop) == 3:
        return [loop]
    if len(loop) == 4:
        # The diagonal joins the new vertex and the old one opposite to it.
        at = next(k for k, v in enumerate(loop) if v not in face)
        a, b, c, d = loop[at:] + loop[:at]
        return [[a, b, c], [a, c, d]]
    if len(loop) == 5:
        # The old vertex between the two new ones is cut off; a quadrilateral is left.
        at = next(k for k in range(5) if loop[k - 1] not in face and loop[(k + 1) % 5] not in face)
        a, b, c, d, e = loop[at:] + loop[:at]
        return [[a, b, e], [b, c, d], [b, d, e]]
    a, b, c, d, e, f = loop if loop[0] in face else loop[1:] + loop[:1]
    return [[a, b, f], [b, c, d], [d, e, f], [b, d, f]]


def weld(points, faces, weldable, tolerance: float):
    """Unite vertices of one place, those within ``tolerance`` of each other.

    Parameters
    ----------
    points : (v, 3) float, length
    faces : (f, 3) int
    weldable : (v,) bool
        Vertices that may be united; the others are left as they are.
    tolerance : float, length

    Returns
    -------
    faces : (g, 3) int
        Without triangles that have become edges, and without pairs that lie on each other.
    kept : (w,) int
        Index of each vertex of the new faces among the old ones.
    """
    some = np.flatnonzero(weldable)
    near = cKDTree(points[some]).query_pairs(tolerance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(near)), near.T), (len(some), len(some)))
    _, group = connected_components(graph, directed=False)
    same = np.arange(len(points))
    same[some] = some[np.unique(group, return_index=True)[1][group]]
    faces = same[faces]
    one, two, three = faces.T
    faces = faces[(one != two) & (two != three) & (three != one)]
    # Two triangles of the same vertices lie on each other and enclose nothing.
    _, index, count = np.unique(np.sort(faces), axis=0, return_inverse=True, return_counts=True)
    faces = faces[count[index.ravel()] == 1]
    kept, faces = np.unique(faces, return_inverse=True)
    return faces.reshape(-1, 3), kept
