"""Surface: triangles of an atlas, and what is known at each vertex."""

from dataclasses import dataclass

import igl
import numpy as np


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of an atlas, and what is known at each vertex.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
        Counter-clockwise seen from outside.
    normals : (v, 3) float, unit, world
    deviation : (v,) float, length
        Predicted standard deviation along the normal.
    patch : (v,) int
        Patch in whose cell the vertex lies.
    gaussian_curvature : (v,) float, 1/length^2
        Of the patches, not of the triangles.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    deviation: np.ndarray
    patch: np.ndarray
    gaussian_curvature: np.ndarray

    def total_curvature(self) -> float:
        """Integral of the patches' Gaussian curvature over the triangles.

        2 pi times the Euler characteristic on a closed surface (Gauss-Bonnet; do Carmo,
        section 4-5), up to the error of the patches: a check that needs no truth.
        """
        areas = 0.5 * igl.doublearea(self.vertices, self.faces)
        return float(areas @ self.gaussian_curvature[self.faces].mean(axis=1))

    def only(self, known) -> "Surface":
        """The triangles between vertices that are known (v,), and the vertices they need."""
        faces = self.faces[known[self.faces].all(axis=1)]
        used = np.zeros(len(known), bool)
        used[faces] = True
        columns = {name: column[used] for name, column in vars(self).items() if name != "faces"}
        return Surface(faces=(np.cumsum(used) - 1)[faces], **columns)
