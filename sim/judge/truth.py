"""The truth: what a surface should be, as the judge sees it."""

from dataclasses import dataclass

import igl
import numpy as np
import trimesh

from touchatlas.sim.judge.closest_points import closest_points
from touchatlas.sim.judge.surface_file import check_triangles
from touchatlas.sim.judge.truth_parts import part_of_faces
from touchatlas.sim.world.triangles import sample_triangles


@dataclass(frozen=True)
class EvaluateOptions:
    """How a surface is judged.

    Parameters
    ----------
    samples : int
        Area-uniform points each way.
    """

    samples: int = 40_000

    def __post_init__(self) -> None:
        if self.samples < 1:
            raise ValueError(f"samples is {self.samples}; at least one point each way is needed")


@dataclass(frozen=True, eq=False)
class Truth:
    """What the surface should be.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    points, normals : (n, 3) float
        Area-uniform points exactly on the true surface, with outward unit normals.
    closed : bool
    euler_characteristic : int
    """

    vertices: np.ndarray
    faces: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    closed: bool
    euler_characteristic: int

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, length."""
        return float(np.linalg.norm(np.ptp(self.vertices[np.unique(self.faces)], axis=0)))

    @property
    def parts(self) -> np.ndarray:
        """(n,) for each point, the number of the separate part of the surface that it is on."""
        labels = part_of_faces(self.faces)
        if not labels.any():
            return np.zeros(len(self.points), int)
        _, face, _ = closest_points(self.points, self.vertices, self.faces)
        return labels[face]


def truth_from_mesh(vertices, faces, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """A mesh as the truth, sampled uniformly by area."""
    vertices, faces = check_triangles(vertices, faces, "the true mesh")
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    points, index = sample_triangles(vertices, faces, options.samples, rng)
    return Truth(
        vertices,
        faces,
        points,
        igl.per_face_normals(vertices, faces, np.zeros(3))[index],
        bool(mesh.is_watertight),
        int(mesh.euler_number),
    )
