"""PN triangles: each triangle of a mesh with normals is cut into n x n that follow the normals.

The small triangles lie on cubic triangles through the vertices whose tangent planes there are
across the normals (Vlachos, Peters, Boyd and Mitchell, Curved PN triangles, 2001). Points on an
edge depend on that edge alone, so the cubic triangles of two neighbours share it.
"""

from functools import lru_cache

import numpy as np


class Subdivision:
    """The vertices and triangles of a mesh whose triangles are cut into ``count`` x ``count``.

    The old vertices come first, then the first point of every edge, the second of every edge and so
    on, then in the same way the points inside of the triangles.

    Parameters
    ----------
    size : int
        Number of the old vertices.
    faces : (f, 3) int
        The old triangles.
    count : int
        Parts of an edge.

    Attributes
    ----------
    edges : (e, 2) int
        Each once, the lower vertex first.
    """

    def __init__(self, size: int, faces, count: int) -> None:
        self._size, self._old, self._count = size, faces, count
        tails, heads = faces, np.roll(faces, -1, axis=1)
        keys = np.minimum(tails, heads) * size + np.maximum(tails, heads)
        keys, sides = np.unique(keys, return_inverse=True)
        self.edges = np.stack(np.divmod(keys, max(size, 1)), axis=1)
        self._sides, self._backward = sides.reshape(-1, 3), tails > heads

    def faces(self) -> np.ndarray:
        """(n n f, 3) the small triangles."""
        inner, template = _template(self._count)
        edges, count = len(self.edges), len(self._old)
        along = np.arange(self._count - 1)
        on_edges = np.where(self._backward[..., None], along[::-1], along)
        on_edges = self._size + on_edges * edges + self._sides[..., None]
        inside = np.arange(len(inner) * count).reshape(len(inner), count).T
        inside = self._size + len(along) * edges + inside
        parts = self._old, on_edges.reshape(count, 3 * len(along)), inside
        return np.concatenate(parts, axis=1).take(template.ravel(), axis=1).reshape(-1, 3)

    def linear(self, values) -> np.ndarray:
        """(w, ...) values at all vertices, linear between the values (v, ...) at the old ones."""
        inner, _ = _template(self._count)
        t = np.arange(1, self._count)[:, None] / self._count
        on_edges = _combined(np.concatenate([1.0 - t, t], axis=1), values[self.edges.T])
        return np.concatenate([values, on_edges, _combined(inner, values[self._old.T])])

    def shared(self, labels) -> np.ndarray:
        """(w,) labels at all vertices, from labels (v,) >= 0 of the old ones: -1 on edges and in
        triangles whose old vertices have different labels."""
        parts = [labels]
        for of, times in (
            (self.edges, self._count - 1),
            (self._old, len(_template(self._count)[0])),
        ):
            alike = (labels[of] == labels[of[:, :1]]).all(axis=1)
            parts.append(np.tile(np.where(alike, labels[of[:, 0]], -1), times))
        return np.concatenate(parts)

    def parents(self, which) -> np.ndarray:
        """(m, 3) the old vertices about new ones ``which`` (m,): the ends of the edge, the second
        end twice, or the corners of the triangle."""
        on_edge = which < self._size + (self._count - 1) * len(self.edges)
        out = np.empty((len(which), 3), np.int64)
        edge = (which[on_edge] - self._size) % max(len(self.edges), 1)
        out[on_edge] = self.edges[edge][:, [0, 1, 1]]
        last = which[~on_edge] - self._size - (self._count - 1) * len(self.edges)
        out[~on_edge] = self._old[last % max(len(self._old), 1)]
        return out

    def points(self, vertices, normals) -> np.ndarray:
        """(w, 3) all vertices on the cubic triangles of old vertices and unit normals (v, 3)."""
        inner, _ = _template(self._count)
        lifted = self._lifted(vertices, normals)
        t = np.arange(1, self._count)[:, None] / self._count
        cubic = np.concatenate([_thirds(1.0 - t, t), _thirds(t, 1.0 - t)], axis=1)
        ends = vertices[self.edges.T]
        on_edges = _combined(cubic, np.stack([ends[0], lifted[0], ends[1], lifted[1]]))
        corners = vertices[self._old.T]
        # Control points of each side in turn: near its first corner, then near its second.
        backward, sides = self._backward.T.astype(int), self._sides.T
        six = np.stack([lifted[backward, sides], lifted[1 - backward, sides]], axis=1)
        six = six.reshape(6, -1, 3)
        middle = 1.5 * six.mean(axis=0) - 0.5 * corners.mean(axis=0)
        control = np.concatenate([corners, six, middle[None]])
        return np.concatenate([vertices, on_edges, _combined(_bernstein(inner), control)])

    def _lifted(self, vertices, normals) -> np.ndarray:
        """(2, e, 3) control points of the edges: their thirds, projected on the tangent planes."""
        first, second = self.edges.T
        a, b, n, m = vertices[first], vertices[second], normals[first], normals[second]
        chord = b - a
        near = 2.0 * a + b - np.einsum("ij,ij->i", chord, n)[:, None] * n
        far = 2.0 * b + a + np.einsum("ij,ij->i", chord, m)[:, None] * m
        return np.stack([near, far]) / 3.0


def _combined(weights, values) -> np.ndarray:
    """(m n, ...) combinations of values (k, n, ...) with weights (m, k)."""
    return (weights @ values.reshape(len(values), -1)).reshape(-1, *values.shape[2:])


def _thirds(s, t) -> np.ndarray:
    """Cubic weights of an end and of the control point next to it, at s and t = 1 - s."""
    return np.concatenate([s**3, 3.0 * s * s * t], axis=1)


def _bernstein(weights) -> np.ndarray:
    """(m, 10) cubic Bernstein weights at barycentric points (m, 3): corners, two of each side,
    middle."""
    u, v, w = weights.T
    sides = [
        3.0 * a * b * c for p, q in ((u, v), (v, w), (w, u)) for a, b, c in ((p, p, q), (q, q, p))
    ]
    return np.stack([u**3, v**3, w**3, *sides, 6.0 * u * v * w], axis=1)


@lru_cache
def _template(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (m, 3) of the points inside a triangle, and the small triangles
    (n n, 3): indices of corners, then points of the three sides in turn, then points inside."""
    n = count
    place = {(n, 0, 0): 0, (0, n, 0): 1, (0, 0, n): 2}
    steps = range(1, n)
    sides = [(n - i, i, 0) for i in steps] + [(0, n - i, i) for i in steps]
    sides += [(i, 0, n - i) for i in steps]
    inner = [(i, j, n - i - j) for i in steps for j in range(1, n - i)]
    place |= {point: 3 + k for k, point in enumerate(sides + inner)}
    out = []
    for i in range(n):
        for j in range(n - i):
            k = n - 1 - i - j
            out.append([place[i + 1, j, k], place[i, j + 1, k], place[i, j, k + 1]])
            if k > 0:
                down = (i + 1, j + 1, k - 1), (i, j + 1, k), (i + 1, j, k)
                out.append([place[p] for p in down])
    return np.array(inner, float).reshape(-1, 3) / n, np.array(out)
