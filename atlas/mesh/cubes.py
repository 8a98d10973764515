"""Cubes: the cubes of a sparse lattice that a surface passes, and the sheets of it within each.

On each face of a cube the surface runs as one or two lines between the crossed edges. Where the
four corners of a face alternate in side, the lines can run in two ways. Both cubes of such an
ambiguous face must take the same way, or the surface tears.
"""

from functools import lru_cache
from itertools import combinations

import numpy as np

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
# Lower corner and axis of each of the twelve edges, and the corners at its lower and upper end.
EDGES = np.array([(*c, a) for c in CORNERS.tolist() for a in range(3) if c[a] == 0])
_ENDS = np.stack(
    [
        ((EDGES[:, :3] + upper * np.eye(3, dtype=int)[EDGES[:, 3]])[:, None] == CORNERS)
        .all(axis=2)
        .argmax(axis=1)
        for upper in (0, 1)
    ],
    axis=1,
)
# Corners of each of the six faces of a cube, two for each axis, in cyclic order; its edges.
_FACES = np.array(
    [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]]
)
_FACE_EDGES = np.array([np.flatnonzero(np.isin(_ENDS, face).all(axis=1)) for face in _FACES])
# Bits of each lattice index in a key: three of them, and two for the axis of an edge, fit into 64.
_BITS = 20
_UNITS = 1 << _BITS * np.arange(3)[::-1]
_HALF = 1 << (_BITS - 1)


def key(indices) -> np.ndarray:
    """One integer for each lattice index (..., 3), ascending with the index.

    Raises
    ------
    ValueError
        More than half a million cubes from the origin.
    """
    indices = np.asarray(indices)
    if indices.size and not -_HALF < indices.min() <= indices.max() < _HALF - 1:
        raise ValueError(
            f"the cubes reach {np.abs(indices).max()} edges from the first sample; no more "
            f"than {_HALF} can be numbered: give a longer edge"
        )
    return np.asarray((indices.astype(np.int64) + _HALF) @ _UNITS)


def unkey(keys) -> np.ndarray:
    """(..., 3) lattice indices of keys (...)."""
    return (np.asarray(keys)[..., None] // _UNITS) % (1 << _BITS) - _HALF


def corners_of(cubes) -> np.ndarray:
    """(c, 8) keys of the corners of cubes (c,), which are named by their lowest corner."""
    return cubes[:, None] + CORNERS @ _UNITS


def ends_of(edges) -> np.ndarray:
    """(e, 2) keys of the lower and upper end of edges (e,)."""
    low = edges >> 2
    return np.stack([low, low + _UNITS[edges & 3]], axis=1)


def edge_keys(cubes) -> np.ndarray:
    """(c, 12) keys of the edges of cubes (c,)."""
    return (corners_of(cubes)[:, _ENDS[:, 0]] << 2) + EDGES[:, 3]


class Nodes:
    """Corners of the lattice with the signed distance there.

    Parameters
    ----------
    at : function
        Distance, normal, known and unsure at points, as of ``dual_contour``.
    start : (3,) float, length
        The corner of index 0.
    edge : float, length
    """

    def __init__(self, at, start, edge: float):
        self.at, self.start, self.edge = at, start, edge
        self.keys = np.zeros(0, np.int64)
        self.distance = np.zeros(0)
        self.normal = np.zeros((0, 3))
        self.unsure = np.zeros(0, bool)

    def points(self, keys) -> np.ndarray:
        """(..., 3) places of nodes (...)."""
        return unkey(keys) * self.edge + self.start

    def rows(self, keys) -> np.ndarray:
        """(...) rows of nodes (...), all of which must be there."""
        return np.searchsorted(self.keys, keys)

    def add(self, keys) -> None:
        """Evaluate those of the nodes (n,) that are not there. NaN stands for unknown."""
        new = _new(keys, self.keys)
        if not len(new):
            return
        distance, normal, known, unsure = self.at(self.points(new))
        place = self.rows(new)
        self.keys = np.insert(self.keys, place, new)
        self.distance = np.insert(self.distance, place, np.where(known, distance, np.nan))
        self.normal = np.insert(self.normal, place, normal, axis=0)
        self.unsure = np.insert(self.unsure, place, unsure)

    def settle(self, rows, is_sure) -> None:
        """Ask whether the surface is known at nodes in ``rows`` (n,) that are unsure."""
        rows = rows[self.unsure[rows]]
        points = self.points(self.keys[rows])
        known = is_sure(points, self.distance[rows], self.normal[rows])
        self.distance[rows[~known]] = np.nan
        self.unsure[rows] = False


def flood(at, seeds, edge: float, is_sure=None) -> tuple[Nodes, np.ndarray, np.ndarray]:
    """The cubes that the surface passes. The fill starts from the eight cubes nearest to each seed.

    Unsure corners are taken as known at first, and settled at once when all cubes are found: then
    the fill is repeated among these. One by one, as the fill comes to them, they take longer.

    Parameters
    ----------
    at : function
        From points (n, 3) to signed distance, normal, known and unsure, as of ``dual_contour``.
    seeds : (k, 3) float, length
        Points on the surface, at least one on each connected piece.
    edge : float, length
        Edge of the cubes.
    is_sure : function, optional
        See ``dual_contour``.

    Returns
    -------
    nodes : Nodes
        The corners of all cubes that were asked.
    cubes : (c,) int
        Ascending keys of the cubes that the surface passes.
    inside : (c, 8) bool
        Whether each of their corners is inside.

    Raises
    ------
    ValueError
        The edge is not positive, or there is no seed.
    """
    seeds = np.asarray(seeds, float).reshape(-1, 3)
    if not edge > 0.0:
        raise ValueError(f"the edge of the cubes must be positive, not {edge}")
    if not len(seeds):
        raise ValueError("a surface needs at least one seed: give a point on it")
    # Offset by numbers without a small common multiple, so that no lattice plane lies in a face.
    nodes = Nodes(at, seeds[0] + np.array([0.31, 0.43, 0.37]) * edge, edge)
    near = np.floor((seeds - nodes.start) / nodes.edge - 0.5).astype(np.int64)
    first = np.unique(key(near[:, None] + CORNERS))
    cubes, inside = _filled(nodes, first)
    rows = np.unique(nodes.rows(corners_of(cubes)))
    if is_sure is not None and nodes.unsure[rows].any():
        nodes.settle(rows, is_sure)
        cubes, inside = _filled(nodes, first)
    return nodes, cubes, inside


def _filled(nodes: Nodes, fresh) -> tuple[np.ndarray, np.ndarray]:
    """Ascending keys (c,) of the cubes with known corners that the surface passes and that a fill
    from the cubes ``fresh`` (n,) reaches, and whether each of their corners is inside (c, 8)."""
    tried, found = fresh[:0], [fresh[:0]]
    while len(fresh):
        tried = np.insert(tried, np.searchsorted(tried, fresh), fresh)
        nodes.add(corners_of(fresh))
        distance = nodes.distance[nodes.rows(corners_of(fresh))]
        inside = distance < 0.0
        passed = inside.any(axis=1) & ~inside.all(axis=1) & ~np.isnan(distance).any(axis=1)
        found.append(fresh[passed])
        fresh = _new(_crossed_neighbours(fresh[passed], inside[passed]), tried)
    cubes = np.sort(np.concatenate(found))
    return cubes, nodes.distance[nodes.rows(corners_of(cubes))] < 0.0


def _new(keys, old) -> np.ndarray:
    """Ascending keys, once each, of those that are not among ascending old ones (n,)."""
    keys = np.unique(keys)
    place = np.minimum(np.searchsorted(old, keys), len(old) - 1)
    return keys[old[place] != keys] if len(old) else keys


def _crossed_neighbours(cubes, inside) -> np.ndarray:
    """Keys of the cubes behind those faces of cubes (c,) that the surface crosses, with
    repetitions; ``inside`` (c, 8) tells the side of each corner."""
    four = inside[:, _FACES]
    cube, face = np.nonzero(four.any(axis=2) & ~four.all(axis=2))
    return np.asarray(cubes[cube] + (2 * (face % 2) - 1) * _UNITS[face // 2])


def quads_of(crossing, local, sheet, inside) -> np.ndarray:
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


@lru_cache(maxsize=1)
def _table() -> np.ndarray:
    """(256, 64, 12) sheet of each edge of a cube, named by its first edge; -1 where not crossed.

    The first index tells the inside corners, one bit each. The second tells the ambiguous faces
    across which the inside is joined, one bit each.
    """
    inside = (np.arange(256)[:, None] >> np.arange(8)) & 1 == 1
    joined = (np.arange(64)[:, None] >> np.arange(6)) & 1 == 1
    crossed = inside[:, _ENDS[:, 0]] != inside[:, _ENDS[:, 1]]
    linked = np.zeros((256, 64, 12, 12), bool)
    for face, edges in enumerate(_FACE_EDGES):
        simple = crossed[:, edges].sum(axis=1) == 2
        for a, b in combinations(edges.tolist(), 2):
            both = crossed[:, a] & crossed[:, b]
            linked[both & simple, :, a, b] = True
            common = {*_ENDS[a].tolist()} & {*_ENDS[b].tolist()}
            if common:
                # Two edges are linked round the corner that lies apart from the opposite one.
                apart = inside[:, common.pop(), None] != joined[:, face]
                linked[:, :, a, b] |= (both & ~simple)[:, None] & apart
    reach = linked | linked.swapaxes(2, 3) | np.eye(12, dtype=bool)
    for _ in range(4):
        reach = reach.astype(np.float32) @ reach.astype(np.float32) > 0.0
    return np.where(crossed[:, None], reach.argmax(axis=3), -1)


def sheets_of(cubes, inside, is_inside) -> np.ndarray:
    """(c, 12) sheet of each edge of the cubes: numbers from 0 on, and -1 where not crossed.

    Each sheet gets one vertex of dual marching cubes (Nielson, Dual marching cubes, 2004). Two
    lines on one face that join the same two sheets would give a mesh edge with four faces. The
    face then takes its other way, which splits both sheets (Schaefer, Ju and Warren, Manifold dual
    contouring, 2007, forbid it likewise).

    Parameters
    ----------
    cubes : (c,) int
        Ascending keys of the cubes.
    inside : (c, 8) bool
        Whether each of their corners is inside.
    is_inside : function
        Tells of points (n, 3), in edges on the lattice, whether each is inside; it decides in the
        middle of an ambiguous face.
    """
    case, table = inside @ (1 << np.arange(8)), _table()
    a, b, c, d = np.moveaxis(inside[:, _FACES], 2, 0)
    cube, slot = np.nonzero((a == c) & (b == d) & (a != b))
    corner = CORNERS[_FACES].mean(axis=1)
    twice = np.rint(2.0 * (unkey(cubes[cube]) + corner[slot])).astype(np.int64)
    middles, face = np.unique(twice, axis=0, return_inverse=True)
    face = face.ravel()
    joined = is_inside(0.5 * middles) if len(middles) else np.zeros(0, bool)
    flipped = np.zeros(len(middles), bool)
    while True:
        way = np.zeros(len(cubes), np.int64)
        np.add.at(way, cube, joined[face].astype(np.int64) << slot)
        around = np.take_along_axis(table[case[cube], way[cube]], _FACE_EDGES[slot], axis=1)
        # A face is torn where one sheet holds all of its edges in both of its cubes.
        torn = face[(around == around[:, :1]).all(axis=1)]
        # Each face takes its other way once at most, so that this ends.
        torn = (np.bincount(torn, minlength=len(middles)) == 2) & ~flipped
        if not torn.any():
            break
        flips = _first_alone(torn, face, cube, len(cubes))
        joined, flipped = joined ^ flips, flipped | flips
    local = table[case, way]
    names = np.where(local >= 0, 12 * np.arange(len(cubes))[:, None] + local, -1)
    found, number = np.unique(names, return_inverse=True)
    return number.reshape(-1, 12) - int((found < 0).any())


def _first_alone(chosen, face, cube, cubes: int) -> np.ndarray:
    """Those of the chosen faces (m,) that have the least number in each of their cubes: no two of
    them share a cube. ``face`` and ``cube`` (n,) are the sides."""
    least = np.full(cubes, len(chosen))
    some = chosen[face]
    np.minimum.at(least, cube[some], face[some])
    first = np.bincount(face[some & (least[cube] == face)], minlength=len(chosen))
    return chosen & (first == 2)
