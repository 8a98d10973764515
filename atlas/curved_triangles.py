"""Curved triangles: a mesh with normals, each triangle cut into n x n that follow its curve.

Cubic triangles through the vertices, tangent to the planes across the normals there (Vlachos,
Peters, Boyd and Mitchell, Curved PN triangles, 2001). What is on an edge follows from the
edge alone, so that neighbours fit.
"""

from functools import lru_cache

import numpy as np


class Subdivision:
    """How the triangles of a mesh are cut: which new vertices there are, and their triangles.

    New vertices are the old ones, then ``count`` - 1 on every edge, then those inside every
    triangle.

    Parameters
    ----------
    faces : (f, 3) int
    count : int
        Parts of an edge.

    Attributes
    ----------
    edges : (e, 2) int
        Each once, the lower vertex first.
    """

    def __init__(self, faces, count: int) -> None:
        self._old, self._count = faces, count
        tails, heads = faces, np.roll(faces, -1, axis=1)
        size = int(faces.max()) + 1 if len(faces) else 1
        names = np.minimum(tails, heads) * size + np.maximum(tails, heads)
        names, sides = np.unique(names, return_inverse=True)
        self.edges = np.stack(np.divmod(names, size), axis=1)
        self._sides, self._backward = sides.reshape(-1, 3), tails > heads

    def faces(self, first: int) -> np.ndarray:
        """(n n f, 3) the small triangles, among ``first`` old vertices and the new ones."""
        inner, template = _template(self._count)
        within = self._count - 1
        along = np.arange(within)
        on_edges = np.where(self._backward[..., None], within - 1 - along, along)
        on_edges = first + self._sides[..., None] * within + on_edges
        inside = first + len(self.edges) * within + np.arange(len(self._old) * len(inner))
        count = len(self._old)
        parts = self._old, on_edges.reshape(count, -1), inside.reshape(count, -1)
        return np.concatenate(parts, axis=1)[:, template].reshape(-1, 3)

    def linear(self, values) -> np.ndarray:
        """(w, ...) values (v, ...) of the old vertices, at all vertices by linear interpolation."""
        inner, _ = _template(self._count)
        t = np.arange(1, self._count)[:, None] / self._count
        flat = values.reshape(len(values), -1)
        on_edges = np.concatenate([1.0 - t, t], axis=1) @ flat[self.edges]
        inside = inner @ flat[self._old]
        parts = [flat, *(part.reshape(-1, flat.shape[1]) for part in (on_edges, inside))]
        return np.concatenate(parts).reshape(-1, *values.shape[1:])

    def parents(self, first: int) -> np.ndarray:
        """(w, 3) the old vertices that every vertex comes from, of ``first`` old ones: itself,
        the ends of its edge, or the corners of its triangle, with repetitions."""
        inner, _ = _template(self._count)
        on_edges = np.repeat(self.edges[:, [0, 1, 1]], self._count - 1, axis=0)
        inside = np.repeat(self._old, len(inner), axis=0)
        return np.concatenate([np.repeat(np.arange(first), 3).reshape(-1, 3), on_edges, inside])

    def points(self, vertices, normals) -> np.ndarray:
        """(w, 3) points of the curved triangles of vertices and unit normals (v, 3)."""
        inner, _ = _template(self._count)
        ends, tangents = vertices[self.edges], self._lifted(vertices, normals, self.edges)
        t = np.arange(1, self._count)[:, None] / self._count
        cubic = np.concatenate([_thirds(1.0 - t, t), _thirds(t, 1.0 - t)], axis=1)
        control = np.stack([ends[:, 0], tangents[:, 0], ends[:, 1], tangents[:, 1]], axis=1)
        parts = [vertices, (cubic @ control).reshape(-1, 3)]
        if len(inner):
            corners, sides = vertices[self._old], []
            for i, j in ((0, 1), (1, 2), (2, 0)):
                pair = self._lifted(vertices, normals, self._old[:, [i, j]])
                sides += [pair[:, 0], pair[:, 1]]
            six = np.stack(sides, axis=1)
            middle = 1.5 * six.mean(axis=1) - 0.5 * corners.mean(axis=1)
            control = np.concatenate([corners, six, middle[:, None]], axis=1)
            parts.append((_bernstein(inner) @ control).reshape(-1, 3))
        return np.concatenate(parts)

    def _lifted(self, vertices, normals, pairs) -> np.ndarray:
        """(e, 2, 3) control points of the edges: their thirds, put into the tangent planes."""
        a, b = vertices[pairs[:, 0]], vertices[pairs[:, 1]]
        n, m = normals[pairs[:, 0]], normals[pairs[:, 1]]
        chord = b - a
        near = 2.0 * a + b - np.einsum("ij,ij->i", chord, n)[:, None] * n
        far = 2.0 * b + a + np.einsum("ij,ij->i", chord, m)[:, None] * m
        return np.stack([near, far], axis=1) / 3.0


def _thirds(s, t) -> np.ndarray:
    """Weights of an end and of the control point next to it, s and t = 1 - s."""
    return np.concatenate([s**3, 3.0 * s * s * t], axis=1)


def _bernstein(weights) -> np.ndarray:
    """(m, 10) cubic weights at barycentric (m, 3): corners, pairs of each side, middle."""
    u, v, w = weights.T
    sides = [
        3.0 * a * b * c for p, q in ((u, v), (v, w), (w, u)) for a, b, c in ((p, p, q), (q, q, p))
    ]
    return np.stack([u**3, v**3, w**3, *sides, 6.0 * u * v * w], axis=1)


@lru_cache
def _template(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric coordinates (m, 3) of the points inside a triangle, and its small triangles
    (n n, 3) among corners, points of the three sides in turn, and these."""
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
