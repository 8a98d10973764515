"""Cube lattice: one integer for each corner, edge and cube of a sparse lattice."""

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
            f"the cubes reach {np.abs(indices).max()} edges from the first sample; no more "
            f"than {_HALF} can be numbered: give a longer edge"
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
