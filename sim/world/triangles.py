"""Small helpers on triangle arrays."""

import numpy as np

from touchatlas.patch.geometry.arrays import cross

_TOP = 2e-3


def areas_of(vertices, faces) -> np.ndarray:
    """(f,) areas of triangles."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return 0.5 * np.sqrt((cross(b - a, c - a) ** 2).sum(axis=1))


def sample_triangles(vertices, faces, count: int, rng):
    """Area-uniform points (count, 3) of a mesh and their face indices (count,)."""
    cumulative = np.cumsum(areas_of(vertices, faces))
    index = np.searchsorted(cumulative, rng.uniform(0.0, cumulative[-1], count))
    u, v = rng.uniform(size=(2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = vertices[faces[index]].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), index


def top_sample(points) -> np.ndarray:
    """The sample near the highest ones that lies most centrally among them."""
    height = points[:, 2]
    top = points[height >= height.max() - _TOP * np.ptp(height)]
    offset = top - top.mean(axis=0)
    return top[(offset**2).sum(axis=1).argmin()]


def face_normals(vertices, faces) -> np.ndarray:
    """(f, 3) unit normals; zero for degenerate triangles."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = cross(b - a, c - a)
    length = np.sqrt((normals**2).sum(axis=1))
    return normals / np.where(length > 0.0, length, 1.0)[:, None]
