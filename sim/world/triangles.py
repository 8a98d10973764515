"""Triangle arrays: areas, samples, normals, topology, a disc of triangles."""

from typing import NamedTuple

import igl
import numpy as np

from touchatlas.patch.geometry.arrays import cross

_BY_AREA = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_AREA


def areas_of(vertices, faces) -> np.ndarray:
    """(f,) areas of triangles, half the length of the cross product of two sides.

    ``igl.doublearea`` computes them from lengths of sides: of triangles that are slivers it finds
    fewer digits, and of degenerate ones often no exact zero.
    """
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return 0.5 * np.sqrt((cross(b - a, c - a) ** 2).sum(axis=1))


def edge_keys(faces) -> np.ndarray:
    """(3 f,) one number for each edge of each face, edge m opposite corner m; the same number for
    the same edge, and ordered as the edges are.

    Numbers are sorted in a tenth of the time that pairs take, and other threads run meanwhile.

    >>> edge_keys(np.array([[0, 1, 2], [2, 1, 3]]))
    array([ 6,  2,  1,  7, 11,  6])
    """
    pairs = faces[:, [[1, 2], [2, 0], [0, 1]]].astype(np.int64)
    return (pairs.min(axis=2) * (int(faces.max()) + 1) + pairs.max(axis=2)).ravel()


class Topology(NamedTuple):
    """Whether each edge of some triangles has two of them, whether two triangles that share an edge
    are wound alike, and the Euler characteristic."""

    is_closed: bool
    is_wound_alike: bool
    euler_characteristic: int


def topology_of(faces) -> Topology:
    """How triangles (f, 3) hang together.

    >>> topology_of(np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    Topology(is_closed=True, is_wound_alike=True, euler_characteristic=2)
    """
    _, edge, count = np.unique(edge_keys(faces), return_inverse=True, return_counts=True)
    along = np.sign(faces[:, [2, 0, 1]] - faces[:, [1, 2, 0]]).ravel()
    two, both = count == 2, np.bincount(edge, along)
    characteristic = len(np.unique(faces)) - len(count) + len(faces)
    return Topology(bool(two.all()), not both[two].any(), characteristic)


def sample_triangles(vertices, faces, count: int, rng):
    """Area-uniform points (count, 3) of a mesh and their face indices (count,)."""
    cumulative = np.cumsum(areas_of(vertices, faces))
    index = np.searchsorted(cumulative, rng.uniform(0.0, cumulative[-1], count))
    u, v = rng.uniform(size=(2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = vertices[faces[index]].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), index


def surface_normals(vertices, faces, index, points) -> np.ndarray:
    """(n, 3) normals at points of the triangles ``index`` (n,): smooth, but for sharp edges."""
    return interpolated(_corner_normals(vertices, faces), vertices, faces, index, points)


def _corner_normals(vertices, faces) -> np.ndarray:
    """(f, 3, 3) normals at the corners of triangles: the vertex normal, except at a vertex on an
    edge of the surface, where it is the triangle's own."""
    flat = igl.per_face_normals(vertices, faces, np.zeros(3))[:, None]
    smooth = igl.per_vertex_normals(vertices, faces, _BY_AREA)[faces]
    on_edge = np.zeros(len(vertices), bool)
    # A vertex of degenerate triangles alone has no normal: NaN is not above the limit.
    # Normals of a vertex and of its triangles that differ by 20 degrees are at an edge.
    on_edge[faces[~((smooth * flat).sum(axis=2) >= np.cos(np.deg2rad(20.0)))]] = True
    return np.where(on_edge[faces][..., None], flat, smooth)


def interpolated(values, vertices, faces, index, points) -> np.ndarray:
    """Values at the corners of triangles (f, 3, ...), interpolated at points (n, 3) in the
    triangles ``index`` (n,)."""
    weights = _barycentric(points, vertices[faces[index]])
    weights = weights.reshape(weights.shape + (1,) * (values.ndim - 2))
    mean: np.ndarray = (weights * values[index]).sum(axis=1)
    return mean


def _barycentric(points, corners) -> np.ndarray:
    """(n, 3) barycentric coordinates of points (n, 3) in triangles (n, 3, 3); thirds where the
    triangle is degenerate."""
    weights = igl.barycentric_coordinates(points, *corners.transpose(1, 0, 2))
    return np.where(np.isfinite(weights).all(axis=1, keepdims=True), weights, 1.0 / 3.0)


def top_sample(points, up=(0.0, 0.0, 1.0)) -> np.ndarray:
    """The sample near the highest ones, along a direction (3,), that lies most centrally among
    them."""
    height = points @ np.asarray(up)
    # The first touch of a tilted plate stays near its highest corner.
    top = points[height >= height.max() - 2e-3 * np.ptp(height)]
    offset = top - top.mean(axis=0)
    return top[(offset**2).sum(axis=1).argmin()]


def disc_faces(circles: int, spokes: int) -> np.ndarray:
    """(f, 3) triangles of a centre and concentric circles of points, counter-clockwise.

    Vertex 0 is the centre; then come the points of each circle, the innermost first.

    >>> disc_faces(1, 3)
    array([[0, 1, 2],
           [0, 2, 3],
           [0, 3, 1]])
    """
    spoke = np.arange(spokes)
    following = (spoke + 1) % spokes
    fan = np.stack([np.zeros(spokes, int), 1 + spoke, 1 + following], axis=1)
    first = 1 + spokes * np.arange(circles - 1)[:, None]
    a, b = first + spoke, first + following
    c, d = a + spokes, b + spokes
    lower, upper = np.stack([a, c, d], axis=-1), np.stack([a, d, b], axis=-1)
    return np.concatenate([fan, lower.reshape(-1, 3), upper.reshape(-1, 3)])
