"""Small handles: those that no contour could show are cut along short loops, and closed across.

At a thin wall or a sharp edge of a free-form face triangles of both sheets may join in a tunnel or
a curl. It changes the Euler characteristic of a surface that is right elsewhere (Guskov and
Wood, Topological noise removal, 2001).
"""

from collections.abc import Iterator

import igl
import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from touchatlas.atlas.mesh.mend import LARGEST, close_holes
from touchatlas.atlas.records.surface import Surface, manifold
from touchatlas.atlas.samples.rims import Rims
from touchatlas.patch.geometry.arrays import box_diagonal


def without_small_handles(surface: Surface, rims: Rims, size: float) -> Surface:
    """The surface without the triangles about the short loops of its handles, closed across
    (``close_holes``).

    What would not leave fewer handles, and as many pieces and rims, is not done.

    Parameters
    ----------
    surface : Surface
    rims : Rims
        Holes beyond these stay open.
    size : float, length
        Half of the largest loop of a handle that is left out.
    """
    # Handles beside a closed one are seen in the next round.
    for _ in range(8):
        regions = _regions(surface, size) if handle_count(surface) else []
        mended = _mended(surface, rims, size, regions) if regions else surface
        if mended is surface:
            break
        surface = mended
    return surface


def handle_count(surface: Surface) -> int:
    """Number of handles of all pieces: V - E + F + rims = 2 (pieces - handles)."""
    # igl counts no edges of no triangles.
    if not len(surface.faces):
        return 0
    characteristic = len(surface.vertices) - len(igl.edges(surface.faces)) + len(surface.faces)
    pieces, rims = _ends(surface)
    return pieces - (characteristic + rims) // 2


def _ends(surface: Surface) -> tuple[int, int]:
    """Numbers of connected pieces and of open rims."""
    pieces = int(igl.vertex_components(surface.faces).max(initial=-1)) + 1
    return pieces, len(igl.boundary_loop_all(surface.faces))


def _mended(surface: Surface, rims: Rims, size: float, regions: list[np.ndarray]) -> Surface:
    """The surface without some regions about its short loops, closed again: all at once or else
    those one by one that leave fewer handles, and as many pieces and rims."""
    left, ends = handle_count(surface), _ends(surface)
    mended, kept = surface, list[np.ndarray]()
    for some in [regions, *([region] for region in regions)]:
        trial = _closed(surface, [*kept, *some], rims, size)
        if len(trial.faces) and _ends(trial) == ends and handle_count(trial) < left:
            mended, left = trial, handle_count(trial)
            if some is regions:
                break
            kept.extend(some)
    return mended


def _regions(surface: Surface, size: float) -> list[np.ndarray]:
    """Triangles (r,) about short loops of a surface that hold handles, apart from each other; each
    grows ring by ring until it holds one."""
    faces, count = surface.faces, len(surface.faces)
    where = faces.ravel(), np.repeat(np.arange(count), 3)
    at = csr_array((np.ones(3 * count, bool), where), shape=(len(surface.vertices), count))
    is_open = np.zeros(len(surface.vertices), bool)
    is_open[igl.boundary_facets(faces)[0].ravel()] = True
    taken, found = np.zeros(count, bool), list[np.ndarray]()
    # Larger holes stay open.
    largest = LARGEST * box_diagonal(surface.vertices)
    for loop in loops_within(surface.vertices, faces, min(2.0 * size, largest)):
        region = np.unique(at[loop].indices)
        while box_diagonal(surface.vertices[np.unique(faces[region])]) <= min(2.5 * size, largest):
            about = np.unique(at[np.unique(faces[region])].indices)
            if taken[about].any() or is_open[faces[region]].any() or len(about) == len(region):
                break
            if _gain(faces, about, region) > 0:
                taken[region] = True
                found.append(region)
                break
            region = about
    return found


def _gain(faces, about, region) -> int:
    """By how much the Euler characteristic of the triangles ``about`` (a,) a region grows where
    discs replace the region (r,), one for each of its rims."""
    beside = faces[np.setdiff1d(about, region)]
    if not len(beside):
        return 0
    rest, index = manifold(beside)
    inner = np.isin(index, faces[region])
    discs = sum(bool(inner[loop].all()) for loop in igl.boundary_loop_all(rest))
    return discs + _characteristic(beside) - _characteristic(faces[about])


def _characteristic(faces) -> int:
    """V - E + F of the manifold of triangles (f, 3)."""
    faces, index = manifold(faces)
    return len(index) - len(igl.edges(faces)) + len(faces)


def _closed(surface: Surface, left_out: list[np.ndarray], rims: Rims, size: float) -> Surface:
    """A surface without some regions and the small pieces that these cut off, closed across."""
    out = np.concatenate(left_out)
    kept = np.ones(len(surface.faces), bool)
    kept[out] = False
    rest = surface.of(surface.faces[kept])
    if not len(rest.faces):
        return rest
    piece = igl.vertex_components(rest.faces)
    sizes = np.array([box_diagonal(rest.vertices[piece == k]) for k in range(piece.max() + 1)])
    # A piece that was there before is no smaller than a hole that stays open.
    small = (sizes <= 2.5 * size) & (sizes < sizes.max())
    if small.any():
        rest = rest.only(~small[piece])
    return close_holes(rest, rims)


def loops_within(points, faces, size: float) -> Iterator[np.ndarray]:
    """Loops of vertices (v, 3) and triangles (f, 3) that cut no piece in two, as vertices, whose
    bounding boxes have a diagonal of ``size``, length, at most.

    A loop through a far root passes the feet of its handle; one through a root beside these is as
    short as can be.
    """
    tree = cKDTree(points[faces].mean(axis=1))
    seen = np.zeros((0, 3))
    for loop in short_loops(points, faces):
        for place in _spread(points[loop], 0.5 * size):
            if (((seen - place) ** 2).sum(axis=1) < (0.25 * size) ** 2).any():
                continue
            seen = np.concatenate([seen, place[None]])
            about = faces[tree.query_ball_point(place, 3.0 * size)]
            used, index = np.unique(about, return_inverse=True)
            if not len(used):
                continue
            root = int(((points[used] - place) ** 2).sum(axis=1).argmin())
            near = short_loops(points[used], index.reshape(-1, 3), root)
            yield from (used[k] for k in near if box_diagonal(points[used[k]]) <= size)


def _spread(points, apart: float) -> np.ndarray:
    """The first of points (n, 3) of a path, and each next one that is as far along it from the one
    before."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _, first = np.unique(np.append(0.0, np.cumsum(steps)) // apart, return_index=True)
    return np.asarray(points[first])


def short_loops(points, faces, root: int = 0) -> list[np.ndarray]:
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
    loops = [_loop(before, *edge) for edge in edges[left].tolist()]
    return sorted(loops, key=lambda loop: box_diagonal(points[loop]))


def _edges_and_sides(faces) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of triangles, and the two triangles (e, 2) beside each. Beyond a boundary is one
    further triangle for each."""
    low, high = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).T
    # One number for each edge is sorted faster than two.
    base = int(faces.max()) + 1
    numbers = (low.astype(np.int64) * base + high).ravel()
    edges, which, count = np.unique(numbers, return_inverse=True, return_counts=True)
    edges = np.stack(np.divmod(edges, base), axis=1)
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
