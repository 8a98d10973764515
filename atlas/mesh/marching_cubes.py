"""Marching cubes on a sparse lattice: keys of corners and edges, and the table of cases."""

from functools import lru_cache

import igl
import numpy as np

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
# Lower corner and axis of each of the twelve edges.
EDGES = np.array([(*c, a) for c in CORNERS.tolist() for a in range(3) if c[a] == 0])
# Bits of each lattice index in a key: three of them, and two bits for the axis of an edge, fit
# into 64. Doubled, they do not.
_BITS = 20
_HALF = 1 << (_BITS - 1)
_MASK = (1 << _BITS) - 1
_FACES = tuple(
    (axis, side, np.flatnonzero(CORNERS[:, axis] == side)) for axis in range(3) for side in (0, 1)
)


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
            f"the cubes reach {np.abs(indices).max()} edges from the first patch; no more than "
            f"{_HALF} can be numbered: give a longer edge"
        )
    x, y, z = np.moveaxis(indices.astype(np.int64) + _HALF, -1, 0)
    return (x << 2 * _BITS) | (y << _BITS) | z


def unkey(keys) -> np.ndarray:
    """(..., 3) lattice indices of keys (...)."""
    return np.stack([keys >> 2 * _BITS, (keys >> _BITS) & _MASK, keys & _MASK], axis=-1) - _HALF


def _step(offsets) -> np.ndarray:
    """What is added to a key for steps (..., 3) on the lattice."""
    x, y, z = np.moveaxis(np.asarray(offsets, np.int64), -1, 0)
    return (x << 2 * _BITS) + (y << _BITS) + z


def corners_of(cubes) -> np.ndarray:
    """(c, 8) keys of the corners of cubes (c,), which are named by their lowest corner."""
    return cubes[:, None] + _step(CORNERS)


def ends_of(edges) -> tuple[np.ndarray, np.ndarray]:
    """Keys of the two ends, lower and upper, of edges (e,)."""
    low = edges >> 2
    return low, low + _step(np.eye(3, dtype=np.int64))[edges & 3]


def crossed_neighbours(cubes, inside) -> np.ndarray:
    """Keys of the cubes behind those faces of the cubes (c,) that the surface crosses, with
    repetitions; ``inside`` (c, 8) tells the side of each corner."""
    out = []
    for axis, side, four in _FACES:
        face = inside[:, four]
        crossed = face.any(axis=1) & ~face.all(axis=1)
        out.append(cubes[crossed] + (2 * side - 1) * _step(np.eye(3, dtype=np.int64)[axis]))
    return np.concatenate(out)


@lru_cache(maxsize=1)
def _cases() -> tuple[np.ndarray, np.ndarray]:
    """Triangles of the 256 cases (256, 5, 3), as edges of the cube, and their number (256,).

    The table (Lorensen and Cline, Marching cubes, 1987) is read off igl's results for single
    cubes.
    """
    middles = {
        tuple(2 * low + (np.arange(3) == axis)): e
        for e, (low, axis) in enumerate(zip(EDGES[:, :3], EDGES[:, 3], strict=True))
    }
    table, counts = np.zeros((256, 5, 3), np.int64), np.zeros(256, np.int64)
    for case in range(1, 255):
        values = np.where((case >> np.arange(8)) & 1, -1.0, 1.0)
        vertices, faces, _ = igl.marching_cubes(values, CORNERS.astype(float), np.arange(8)[None])
        edges = [middles[tuple(v)] for v in np.rint(2.0 * vertices).astype(int).tolist()]
        counts[case] = len(faces)
        table[case, : len(faces)] = np.array(edges)[faces]
    # With one corner inside the triangle must face away from that corner.
    a, b, c = EDGES[table[1, 0], 3]
    if round(float(np.linalg.det(np.eye(3)[[a, b, c]]))) < 0:
        table = table[:, :, ::-1]
    return table, counts


def triangles(cubes, inside) -> np.ndarray:
    """(f, 3) keys of the lattice edges on which the corners of the triangles lie.

    The triangles are counter-clockwise seen from outside.

    Parameters
    ----------
    cubes : (c,) int
        Keys of cubes.
    inside : (c, 8) bool
        Whether each of their corners is inside.
    """
    table, counts = _cases()
    case = inside @ (1 << np.arange(8))
    edge_step = (_step(EDGES[:, :3]) << 2) + EDGES[:, 3]
    used = np.arange(5) < counts[case][:, None]
    local = edge_step[table[case][used]]
    return np.repeat(cubes << 2, counts[case])[:, None] + local
