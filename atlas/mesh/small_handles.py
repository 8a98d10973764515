"""Small handles: those that no patch could show are cut, and closed across.

Where patches disagree at a thin wall, triangles of both sheets may join in a tunnel or a curl that
is smaller than any patch. It changes the Euler characteristic of a surface that is right elsewhere
(Guskov and Wood, Topological noise removal, 2001).
"""

from collections.abc import Iterator
from itertools import islice

import igl
import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from touchatlas.atlas.graph.rims import Rims
from touchatlas.atlas.mesh.close_holes import close_holes
from touchatlas.atlas.mesh.surface import Surface

# Radius in which shorter loops are looked for, in sizes: a handle of that size is within. Doubled,
# four times as many triangles are looked at.
_ABOUT = 3.0
# Most loops that are tried. Doubled, surfaces that are wrong in many places take twice as long.
_MOST = 24


def without_small_handles(surface: Surface, rims: Rims, size: float) -> Surface:
    """The surface with its handles of a loop within ``size``, length, cut along it.

    The triangles at the loop are left out, and the two holes are closed (``close_holes``). What
    does not leave one handle fewer, and as many pieces and rims, is not done. The surface must be
    manifold.
    """
    seen: list[np.ndarray] = []
    # igl counts no edges of no triangles.
    handles, tries = _handles(surface) if len(surface.faces) else 0, _MOST
    while handles and tries:
        for loop in islice(_loops_within(surface, size, seen), tries):
            tries -= 1
            cut = _cut(surface, loop, rims)
            if _handles(cut) == handles - 1 and _ends(cut) == _ends(surface):
                surface, handles = cut, handles - 1
                break
        else:
            break
    return surface


def _cut(surface: Surface, loop, rims: Rims) -> Surface:
    """The surface without the triangles at the vertices of a loop, closed again."""
    faces = surface.faces[~np.isin(surface.faces, loop).any(axis=1)]
    _, faces, _, used = igl.remove_unreferenced(surface.vertices, faces)
    faces, index = igl.split_nonmanifold(faces)
    return close_holes(surface.taken(used[index], faces), rims)


def _pieces(surface: Surface) -> int:
    """Number of connected pieces."""
    return int(igl.vertex_components(surface.faces).max(initial=-1)) + 1


def _ends(surface: Surface) -> tuple[int, int]:
    """Numbers of connected pieces and of open rims."""
    return _pieces(surface), len(igl.boundary_loop_all(surface.faces))


def _handles(surface: Surface) -> int:
    """Number of handles of all pieces: V - E + F + boundaries = 2 (pieces - handles)."""
    faces = surface.faces
    used = len(np.unique(faces))
    characteristic = used - len(igl.edges(faces)) + len(faces)
    return _pieces(surface) - (characteristic + len(igl.boundary_loop_all(faces))) // 2


def _loops_within(surface: Surface, size: float, seen: list[np.ndarray]) -> Iterator[np.ndarray]:
    """Loops that cut no piece in two, as vertices, whose bounding boxes have a diagonal of ``size``
    at most.

    A loop through a far root passes the feet of its handle; one through a root beside these is as
    short as can be. Places that are ``seen`` are not looked at again; others are added to them.
    """
    points, faces = surface.vertices, surface.faces
    tree = cKDTree(points[faces].mean(axis=1))
    for loop in _loops(points, faces):
        for place in _spread(points[loop], 0.5 * size):
            if any(((place - other) ** 2).sum() < (0.25 * size) ** 2 for other in seen):
                continue
            seen.append(place)
            about = faces[tree.query_ball_point(place, _ABOUT * size)]
            used, index = np.unique(about, return_inverse=True)
            if not len(used):
                continue
            root = int(((points[used] - place) ** 2).sum(axis=1).argmin())
            near = _loops(points[used], index.reshape(-1, 3), root)
            yield from (used[k] for k in near if _span(points[used[k]]) <= size)


def _spread(points, apart: float) -> np.ndarray:
    """The first of points (n, 3) of a path, and each next one that is as far along it from the one
    before."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _, first = np.unique(np.append(0.0, np.cumsum(steps)) // apart, return_index=True)
    return np.asarray(points[first])


def _loops(points, faces, root: int = 0) -> list[np.ndarray]:
    """Two loops for each handle of triangles (f, 3), as vertices: those that are short among all
    through the root, or the first vertex of another piece, the smallest first.

    They are those of the edges in neither a tree of shortest paths nor a tree of the triangles
    across the other edges (Erickson and Whittlesey, Greedy optimal homotopy and homology
    generators, 2005).
    """
    edges, beside = _edges_and_sides(faces)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    away, before = _shortest_paths(edges, length, len(points), root)
    first, second = edges.T
    in_tree = (before[first] == second) | (before[second] == first)
    around = length + away[first] + away[second]
    left = ~in_tree
    left[left] = ~_in_cotree(beside[left], around[left])
    return sorted(
        (_loop(before, *edge) for edge in edges[left].tolist()), key=lambda k: _span(points[k])
    )


def _span(points) -> float:
    """Diagonal of the bounding box of points (n, 3), length."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _edges_and_sides(faces) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of triangles, and the two triangles (e, 2) beside each. Beyond a boundary is one
    further triangle for each."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges, which, count = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    order = np.argsort(which.ravel(), kind="stable")
    begin = np.concatenate([[0], np.cumsum(count)[:-1]])
    owner = order % len(faces)
    beside = np.stack([owner[begin], owner[np.minimum(begin + 1, len(owner) - 1)]], axis=1)
    rim = np.flatnonzero(count == 1)
    joined = coo_array((np.ones(len(rim)), edges[rim].T), shape=(faces.max() + 1,) * 2)
    beside[rim, 1] = len(faces) + connected_components(joined, directed=False)[1][edges[rim, 0]]
    return edges, beside


def _shortest_paths(edges, length, count: int, root: int) -> tuple[np.ndarray, np.ndarray]:
    """(v,) length of the shortest path to each vertex from ``root``, or the first vertex of another
    piece, and the vertex before it; -9999 at a root."""
    graph = csr_array((length, edges.T), shape=(count, count))
    piece = connected_components(graph, directed=False)[1]
    _, roots = np.unique(piece, return_index=True)
    roots[piece[root]] = root
    away, before, _ = dijkstra(
        graph, directed=False, indices=roots, return_predecessors=True, min_only=True
    )
    return away, before


def _in_cotree(beside, weight) -> np.ndarray:
    """(e,) whether edges between triangles (e, 2) are in the tree of largest weights."""
    low, high = np.sort(beside, axis=1).T
    # Two triangles may share several edges: the heaviest is in the tree.
    order = np.lexsort((-weight, high, low))
    other = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    kept = order[np.append(True, other)]
    size = int(beside.max()) + 1
    # Ranks: a weight of zero would be no edge.
    index = 1 + np.argsort(np.argsort(-weight[kept], kind="stable"))
    tree = minimum_spanning_tree(coo_array((index, (low[kept], high[kept])), shape=(size, size)))
    out = np.zeros(len(beside), bool)
    out[kept[np.isin(index, tree.data.astype(int))]] = True
    return out


def _loop(before, first: int, second: int) -> np.ndarray:
    """Vertices of the loop of an edge and the paths from its ends to where they meet."""
    there, back = _path(before, first), _path(before, second)
    while len(there) > 1 and len(back) > 1 and there[-2] == back[-2]:
        there.pop()
        back.pop()
    return np.array([*there, *back[:-1]])


def _path(before, vertex: int) -> list[int]:
    """Vertices from one to the root of its piece."""
    path = [vertex]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return path
