"""NearSurface: signed distance and normal of a surface that is known by its field and triangles."""

import igl
import numpy as np

from touchatlas.atlas.field.face_field import FaceField
from touchatlas.atlas.records.surface import Surface


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
