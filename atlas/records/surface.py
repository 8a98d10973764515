"""Surface: the triangles of an atlas, with normal and predicted deviation at each vertex."""

from dataclasses import dataclass, field, replace

import igl
import numpy as np


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles of an atlas, with the values of the field at each vertex.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    normals : (v, 3) float, unit, world
    deviation : (v,) float, length
        Predicted standard deviation along the normal.
    patch : (v,) int
        Id of the face on which the vertex lies.
    gaussian_curvature : (v,) float, 1/length^2
        Curvature of the faces, not of the triangles.
    stray_pieces : int
        Number of pieces beside the surface that were removed.
    closed_holes : (h, 3) float, length, world
        Middles of small holes that were closed across, without samples.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    patch: np.ndarray
    gaussian_curvature: np.ndarray
    stray_pieces: int = 0
    closed_holes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def total_curvature(self) -> float:
        """Integral of the faces' Gaussian curvature over the triangles, no unit.

        On a closed surface it is 2 pi times the Euler characteristic, up to the error of the
        faces (Gauss-Bonnet; do Carmo, section 4-5). This check needs no truth.
        """
        areas = 0.5 * igl.doublearea(self.vertices, self.faces)
        return float(areas @ self.gaussian_curvature[self.faces].mean(axis=1))

    def only(self, known) -> "Surface":
        """The triangles whose vertices are all ``known`` (v,), and their vertices."""
        faces = self.faces[known[self.faces].all(axis=1)]
        _, faces, _, used = igl.remove_unreferenced(self.vertices, faces)
        return self.taken(used, faces)

    def taken(self, index, faces) -> "Surface":
        """The vertices of indices (w,) with other triangles (f, 3) between them."""
        columns = {
            name: column[index]
            for name, column in vars(self).items()
            if name not in ("faces", "stray_pieces", "closed_holes")
        }
        return replace(self, faces=faces, **columns)

    def extended(self, parts: "list[Surface]", faces, closed_holes) -> "Surface":
        """The surface with the vertices of others after its own, triangles (f, 3) between all, and
        holes (h, 3) that were closed besides."""
        every = [self, *parts]
        return Surface(
            np.concatenate([part.vertices for part in every]),
            np.asarray(faces),
            np.concatenate([part.normals for part in every]),
            np.concatenate([part.deviation for part in every]),
            np.concatenate([part.patch for part in every]),
            np.concatenate([part.gaussian_curvature for part in every]),
            self.stray_pieces,
            np.concatenate([self.closed_holes, closed_holes]),
        )
