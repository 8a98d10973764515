"""Split triangles: their edges, and what becomes of triangles whose edges are cut in the middle."""

import numpy as np


def edges_of(faces) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of triangles (f, 3), each once, the lower vertex first, and which edge (f, 3)
    follows each corner."""
    tails, heads = faces.astype(np.int64), np.roll(faces, -1, axis=1)
    keys, sides = np.unique(
        np.minimum(tails, heads) << 32 | np.maximum(tails, heads), return_inverse=True
    )
    return np.stack([keys >> 32, keys & (1 << 32) - 1], axis=1), sides.reshape(-1, 3)


def triangles_beside(sides, count: int) -> np.ndarray:
    """(e, 2) the triangles on both sides of each of so many edges, from the edges (f, 3) of
    triangles; -1 where there is none."""
    out = np.full((count, 2), -1)
    order = np.argsort(sides.ravel(), kind="stable")
    edge = sides.ravel()[order]
    second = np.append(False, edge[1:] == edge[:-1])
    out[edge, second.astype(int)] = order // 3
    return out


def split(faces, middles, points) -> np.ndarray:
    """Triangles (g, 3) in the place of triangles (f, 3).

    Parameters
    ----------
    faces : (f, 3) int
    middles : (f, 3) int
        The vertex in the middle of the side that follows a corner; -1 where there is none.
    points : (v, 3) float, length
        Vertices. A quadrilateral is cut along its shorter diagonal.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0]])
    >>> split(np.array([[0, 1, 2]]), np.array([[3, -1, -1]]), points).tolist()
    [[0, 3, 2], [3, 1, 2]]
    """
    has = middles >= 0
    count = has.sum(axis=1)
    # Turned until the first side has a middle, and the second if two have.
    first = np.where(count == 1, has.argmax(axis=1), (has.argmin(axis=1) + 1) % 3)
    turned = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turned, axis=1).T
    m, n, p = np.take_along_axis(middles, turned, axis=1).T
    along, across = (((points[s] - points[t]) ** 2).sum(axis=1) for s, t in ((a, n), (m, c)))
    two, shorter = count == 2, along <= across
    parts = [
        (count == 0, (a, b, c)),
        *((count == 1, corners) for corners in ((a, m, c), (m, b, c))),
        (two, (m, b, n)),
        *((two & shorter, corners) for corners in ((a, m, n), (a, n, c))),
        *((two & ~shorter, corners) for corners in ((a, m, c), (m, n, c))),
        *((count == 3, corners) for corners in ((a, m, p), (m, b, n), (p, n, c), (m, n, p))),
    ]
    return np.concatenate([np.stack([x[some] for x in corners], axis=1) for some, corners in parts])
