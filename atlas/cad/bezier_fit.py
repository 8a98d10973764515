"""Bezier faces of a smooth body: as few as are within a bound of its surface.

A few triangles of about equal sides become three quadrilaterals each, the first guess of faces;
those that are off become four.
"""

import igl
import numpy as np

from touchatlas.atlas.cad.bezier import At, face_normals, face_points
from touchatlas.atlas.cad.bezier_tree import BezierTree, first_tree, with_halved
from touchatlas.atlas.cad.kernel import NotWritten
from touchatlas.atlas.field.face_field import FaceField
from touchatlas.atlas.mesh.refine import edges_of
from touchatlas.atlas.records.surface import Surface


def coarse_triangles(surface: Surface, least: int = 32) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) on a surface and triangles (f, 3) of about equal sides between them, as few
    as have normals within 78 degrees of those of the surface, whose cosine is 0.2.

    The shortest edges are collapsed first, which keeps the topology. There are ``least``
    triangles or more.

    Raises
    ------
    NotWritten
        A tenth of the triangles of the surface would not do.
    """
    count = least
    while count <= max(least, len(surface.faces) // 10):
        vertices, faces, _, _ = igl.decimate(surface.vertices, surface.faces, count)
        if 0 < len(faces) <= count + 1:
            _, _, on = igl.point_mesh_squared_distance(vertices, surface.vertices, surface.faces)
            if _face_alike(surface, on, faces):
                return on, faces
        count = 7 * count // 5
    raise NotWritten("the surface is torn: few triangles do not have its normals")


def _face_alike(surface: Surface, vertices, faces) -> bool:
    """Whether triangles have normals like the vertices of the surface to which they are nearest."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    if lengths.min() <= 0.0:
        return False
    _, nearest, _ = igl.point_mesh_squared_distance(surface.vertices, vertices, faces)
    cosines = (normals[nearest] * surface.normals).sum(axis=1) / lengths[nearest]
    return bool(cosines.min() >= 0.2)


def three_quads(vertices, faces) -> tuple[np.ndarray, np.ndarray]:
    """Three quadrilaterals in the place of each triangle (f, 3), between its corners, the middles
    of its edges and its own middle: vertices (v + e + f, 3), length, and quadrilaterals (3 f, 4).

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]])
    >>> points, quads = three_quads(corners, np.array([[0, 1, 2]]))
    >>> quads.tolist()
    [[0, 3, 6, 4], [1, 5, 6, 3], [2, 4, 6, 5]]
    >>> points[6].tolist()
    [2.0, 2.0, 0.0]
    """
    ends, sides = edges_of(faces)
    middles = len(vertices) + sides
    inner = len(vertices) + len(ends) + np.arange(len(faces))
    quads = [
        np.stack([faces[:, k], middles[:, k], inner, middles[:, k - 1]], axis=1) for k in range(3)
    ]
    points = [vertices, vertices[ends].mean(axis=1), vertices[faces].mean(axis=1)]
    return np.concatenate(points), np.stack(quads, axis=1).reshape(-1, 4)


class NearSurface:
    """The surface of a smooth body with what was mended in its triangles.

    The field decides where its surface is near the triangles; where holes were closed or handles
    left out, the triangles do.

    Parameters
    ----------
    field : FaceField
    surface : Surface
    near : float, length
        Distance of the field's surface from the triangles up to which the field alone decides; from
        twice that on the triangles alone do, with the mean of both between.
    """

    def __init__(self, field: FaceField, surface: Surface, near: float) -> None:
        self._field, self._surface, self._near = field, surface, near

    def at(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), length, and outward unit normal (n, 3) at points (n, 3) that are
        nearer to the surface than it bends."""
        vertices, faces = self._surface.vertices, self._surface.faces
        _, triangle, foot = igl.point_mesh_squared_distance(points, vertices, faces)
        found = self._field.at(foot)
        share = np.clip(2.0 - np.abs(found.distance) / self._near, 0.0, 1.0)
        normal = share[:, None] * found.normal
        rest = np.flatnonzero(share < 1.0)
        normal[rest] += (1.0 - share[rest, None]) * self._normals(triangle[rest], foot[rest])
        normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
        foot = foot - (share * found.distance)[:, None] * found.normal
        return np.einsum("ij,ij->i", points - foot, normal), normal

    def _normals(self, triangle, foot) -> np.ndarray:
        """(k, 3) mean normals of the corners of triangles (k,) at points (k, 3) on them."""
        corners = self._surface.faces[triangle]
        places = [
            np.ascontiguousarray(c) for c in self._surface.vertices[corners].transpose(1, 0, 2)
        ]
        share = igl.barycentric_coordinates(foot, *places)
        return np.einsum("kc,kcd->kd", share, self._surface.normals[corners])


def bezier_faces(vertices, quads, at: At, bound: float) -> tuple[BezierTree, np.ndarray]:
    """Bezier faces in the place of quadrilaterals, halved until they are within a bound of a
    surface.

    Parameters
    ----------
    vertices : (v, 3) float, length
        Near the surface.
    quads : (q, 4) int
        Counter-clockwise as seen from outside.
    at : function
        Signed distance and normal of the surface near points.
    bound : float, length
        Largest distance at the points of a grid on each face. Where the surface is rough, faces are
        farther: up to twice that, or more where their halves would be folded.

    Returns
    -------
    tree : BezierTree
    errors : (f,) float, length
        Largest distance of each face from the surface; infinite where it is folded.
    """
    tree = first_tree(vertices, quads, at)
    errors = _errors(tree, range(len(tree.faces)), at)
    stays = np.zeros(len(errors), bool)
    # Where the field jumps, halves of halves would become as small as the noise.
    for _ in range(4):
        far = np.flatnonzero((errors > bound) & ~stays)
        trial, numbers, found = _halved(tree, far, at)
        rough = _are_rough(errors[far], found, bound)
        stays[far[rough]] = True
        if rough.any():
            far = far[~rough]
            trial, numbers, found = _halved(tree, far, at)
        if not len(far):
            break
        tree = trial
        stays = np.append(stays, np.zeros(3 * len(far), bool))
        errors = np.append(errors, np.zeros(3 * len(far)))
        errors[numbers] = found
    return tree, errors


def _halved(tree: BezierTree, faces, at: At) -> tuple[BezierTree, np.ndarray, np.ndarray]:
    """A tree with four faces in the place of each of some (k,), and the numbers (k, 4) and errors
    (k, 4) of these."""
    if not len(faces):
        return tree, np.zeros((0, 4), int), np.zeros((0, 4))
    tree, numbers = with_halved(tree, faces, at)
    return tree, numbers, _errors(tree, numbers.ravel(), at).reshape(-1, 4)


def _are_rough(errors, found, bound: float) -> np.ndarray:
    """(k,) whether faces with errors (k,) stay rather than become four with errors ``found``
    (k, 4): those are no nearer, or folded."""
    worst = found.max(axis=1)
    # Halves of bicubic faces of a smooth surface err a sixteenth.
    no_better = (errors <= 2.0 * bound) & (worst > 0.7 * errors)
    return np.asarray(no_better | (np.isfinite(errors) & ~np.isfinite(worst)))


def _errors(tree: BezierTree, faces, at: At) -> np.ndarray:
    """(k,) largest distance of faces (k,) from the surface at the points of a grid; infinite where
    one is folded: its normal is more than 60 degrees off."""
    grid = np.linspace(0.0, 1.0, 7)
    u, v = (x.ravel() for x in np.meshgrid(grid, grid, indexing="ij"))
    controls = np.array([tree.controls[k] for k in faces])
    points = face_points(controls, u, v).reshape(-1, 3)
    distance, normal = at(points)
    cosine = np.einsum("kc,kc->k", face_normals(controls, u, v).reshape(-1, 3), normal)
    off = np.where(cosine < 0.5, np.inf, np.abs(distance))
    return np.asarray(off.reshape(len(controls), -1).max(axis=1))
