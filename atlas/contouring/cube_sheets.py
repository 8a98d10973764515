"""Sheets within a cube: which crossed edges of a cube belong to one piece of the surface.

On each face of a cube the surface runs as one or two lines between the crossed edges. Where the
four corners of a face alternate in side, the lines can run in two ways. Both cubes of such an
ambiguous face must take the same way, or the surface tears.
"""

from functools import lru_cache
from itertools import combinations

import numpy as np

from touchatlas.atlas.contouring.cube_lattice import CORNERS, EDGES, unkey

# Corners of each of the six faces of a cube, two for each axis, in cyclic order.
_FACES = np.array(
    [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]]
)
_BITS = 1 << np.arange(8)


def edge_ends() -> np.ndarray:
    """(12, 2) corners of a cube at the lower and upper end of each of its edges."""
    place = {tuple(corner): i for i, corner in enumerate(CORNERS.tolist())}
    upper = EDGES[:, :3] + np.eye(3, dtype=int)[EDGES[:, 3]]
    return np.array(
        [
            (place[tuple(low)], place[tuple(high)])
            for low, high in zip(EDGES[:, :3].tolist(), upper.tolist(), strict=True)
        ]
    )


@lru_cache(maxsize=1)
def _table() -> np.ndarray:
    """(256, 64, 12) sheet of each edge of a cube, named by its first edge; -1 where not crossed.

    The first index tells the inside corners, one bit each. The second tells the ambiguous faces
    across which the inside is joined, one bit each.
    """
    inside = (np.arange(256)[:, None] >> np.arange(8)) & 1 == 1
    joined = (np.arange(64)[:, None] >> np.arange(6)) & 1 == 1
    low, high = edge_ends().T
    crossed = inside[:, low] != inside[:, high]
    linked = np.zeros((256, 64, 12, 12), bool)
    for face, around in enumerate(_FACES):
        edges = np.flatnonzero(np.isin(low, around) & np.isin(high, around))
        simple = crossed[:, edges].sum(axis=1) == 2
        for a, b in combinations(edges.tolist(), 2):
            both = crossed[:, a] & crossed[:, b]
            linked[both & simple, :, a, b] = True
            common = {int(low[a]), int(high[a])} & {int(low[b]), int(high[b])}
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
    case, table = inside @ _BITS, _table()
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
        torn = _touching(table[case[cube], way[cube]], slot)
        # A face is torn where both of its cubes have one sheet there.
        torn = np.bincount(face[torn], minlength=len(middles)) == 2
        # Each face takes its other way once at most, so that this ends.
        torn &= ~flipped
        if not torn.any():
            break
        flips = _first_alone(torn, face, cube, len(cubes))
        joined, flipped = joined ^ flips, flipped | flips
    local = table[case, way]
    names = np.where(local >= 0, 12 * np.arange(len(cubes))[:, None] + local, -1)
    found, number = np.unique(names, return_inverse=True)
    return number.reshape(-1, 12) - int((found < 0).any())


def _touching(sheets, slot) -> np.ndarray:
    """(n,) whether one sheet of a cube, of sheets (n, 12), holds all edges of its face ``slot``."""
    low, high = edge_ends().T
    edges = np.array([np.flatnonzero(np.isin(low, face) & np.isin(high, face)) for face in _FACES])
    around = np.take_along_axis(sheets, edges[slot], axis=1)
    return (around == around[:, :1]).all(axis=1)


def _first_alone(chosen, face, cube, cubes: int) -> np.ndarray:
    """Those of the chosen faces (m,) that have the least number in each of their cubes: no two of
    them share a cube. ``face`` and ``cube`` (n,) are the sides."""
    least = np.full(cubes, len(chosen))
    some = chosen[face]
    np.minimum.at(least, cube[some], face[some])
    first = np.bincount(face[some & (least[cube] == face)], minlength=len(chosen))
    return chosen & (first == 2)
