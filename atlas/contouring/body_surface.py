"""Triangles of a body: its field in cubes, sharp at edges where it has some."""

from dataclasses import replace

import igl
import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.contouring.dual_contouring import dual_contour
from touchatlas.atlas.contouring.smooth_contouring import smooth_contour
from touchatlas.atlas.field.face_field import FaceValues
from touchatlas.atlas.records.surface import Surface

# Cubes along the extent of a body: with the first number its shape is drawn for planning, the
# second is the most, because time and memory grow with its square. Doubled, four times the time.
_COARSE, MOST = 32, 160
# Largest edge of a cube over the thinnest wall, so that each side has its own cubes. Doubled, both
# sides of a wall pass the same cube.
_WALL = 0.4
# Least thickness of a wall that counts, in deviations of a sample: a difference of two samples is
# less by chance in all but one of 200. Doubled, walls of eight deviations may close.
_TOLD = 4.0
# Largest edge of a cube over the reach of samples: its corners are within 0.4 reaches of the
# surface that passes it, up to where ``Body.at`` finds their feet. Doubled, the surface of a
# scanned lemon lost a third of its area.
WITHIN_REACH = 0.23
# Parts of a side of a triangle: the curvature is asked in the middles of their square of smaller
# ones. With two the total curvature of two plates was 1.983 and 1.997 times 2 pi, with four 1.987
# and 1.994, with eight 1.996 and 1.998, but drawing them took 0.9 s instead of 0.5.
_PARTS = 4
# Largest edge of a cube over the radius of the narrowest bend. Doubled, narrow holes close.
_BEND = 0.5


def is_smooth(body: Body) -> bool:
    """Whether a body is one free-form face, without sharp edges."""
    return body.field.is_one


def coarse_edge(body: Body) -> float:
    """Edge of the cubes that show the shape of a body, length."""
    wall = max(body.thickness, _TOLD * body.samples.std)
    edge = min(body.extent / _COARSE, _WALL * wall, WITHIN_REACH * body.reach)
    return max(edge, body.extent / MOST)


def shape_edge(body: Body) -> float:
    """Edge of the cubes in which triangles of a body are drawn before they are refined, length: a
    narrow bend passes some of them. Roundings of edges are cut off, and refined."""
    if is_smooth(body):
        return coarse_edge(body)
    bend = _BEND / max(body.largest_curvature, np.finfo(float).tiny)
    return max(min(coarse_edge(body), bend), body.extent / MOST)


def fine_edge(body: Body, sagitta: float) -> float:
    """Edge of the cubes whose triangles are within ``sagitta`` (length) of the faces: the sagitta
    of a chord c on a circle of radius r is c^2 / 8 r, and a chord is a diagonal of two edges. Such
    cubes show small holes of a body with edges. Roundings of edges do not count.
    """
    if is_smooth(body):
        return coarse_edge(body)
    # Planes alone bend by rounding at most; with zero the quotient overflows.
    bend = np.sqrt(4.0 * sagitta / max(body.largest_curvature, np.finfo(float).eps / body.extent))
    return max(min(coarse_edge(body), float(bend)), body.extent / MOST)


def body_surface(body: Body, edge: float) -> Surface:
    """The surface of a body in cubes of an edge, length. Its ``patch`` is the id of the face, and
    its curvatures are zero: see ``with_curvatures``.

    It is closed where the surface is known everywhere, and ends where it is not.
    """
    vertices, faces, found = body_triangles(body, edge)
    none = np.zeros(len(vertices))
    return Surface(vertices, faces, found.normal, found.deviation, found.face, none)


def with_curvatures(body: Body, surface: Surface) -> Surface:
    """A surface with the Gaussian curvature of the body at its vertices; where that jumps at rims,
    the mean about each vertex."""
    vertices, faces = surface.vertices, surface.faces
    if is_smooth(body):
        curvature = body.gaussian_curvature(vertices, surface.patch)
    else:
        # At vertices a tenth of that of a plate was missing.
        found = body.field.at(vertices[faces].mean(axis=1))
        weights = _inner_weights(_PARTS)
        points = (weights @ vertices[faces]).reshape(-1, 3)
        inside = body.gaussian_curvature(points, np.repeat(found.face, len(weights)))
        # A triangle stands for the part of the surface that it is seen against along its normals.
        cosine = (igl.per_face_normals(vertices, faces, np.zeros(3)) * found.normal).sum(axis=1)
        means = np.maximum(cosine, 0.0) * inside.reshape(-1, len(weights)).mean(axis=1)
        curvature = _means_about_vertices(vertices, faces, means)
    return replace(surface, gaussian_curvature=curvature)


def _inner_weights(parts: int) -> np.ndarray:
    """(parts^2, 3) weights of the corners of a triangle in the middles of equal smaller ones.

    >>> _inner_weights(2).round(2).tolist()
    [[0.17, 0.17, 0.67], [0.17, 0.67, 0.17], [0.33, 0.33, 0.33], [0.67, 0.17, 0.17]]
    """
    upright = [(i + 1 / 3, j + 1 / 3) for i in range(parts) for j in range(parts - i)]
    turned = [(i + 2 / 3, j + 2 / 3) for i in range(parts) for j in range(parts - i - 1)]
    first, second = np.array(sorted(upright + turned)).T / parts
    return np.column_stack([first, second, 1.0 - first - second])


def body_triangles(body: Body, edge: float) -> tuple[np.ndarray, np.ndarray, FaceValues]:
    """The vertices (v, 3) and triangles (f, 3) of that surface, and what the faces say of the
    vertices."""

    def at(points):
        found = body.field.at(points)
        return found.distance, found.normal

    def at_corners(points):
        found, known = body.at(points)
        return found.distance, found.normal, known

    contour = smooth_contour if is_smooth(body) else dual_contour
    vertices, faces = contour(at, at_corners, body.seeds, edge)
    found = body.field.at(vertices)
    if is_smooth(body):
        vertices = vertices - np.clip(found.distance, -edge, edge)[:, None] * found.normal
    # A face whose equation fails at a vertex says nothing of it: it may lie anywhere.
    return vertices, faces, replace(found, deviation=np.minimum(found.deviation, body.extent))


def _means_about_vertices(vertices, faces, values) -> np.ndarray:
    """(v,) means of the values of triangles (f,) about each vertex, each with the weight of its
    area: their integral over all triangles is the same."""
    area, corners = np.repeat(igl.doublearea(vertices, faces), 3), faces.ravel()
    total = np.bincount(corners, area, len(vertices))
    sums = np.bincount(corners, area * np.repeat(values, 3), len(vertices))
    return np.asarray(sums / np.maximum(total, np.finfo(float).tiny))
