"""The truth: what a surface should be, as the judge sees it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchatlas.patch.checks import check_whole
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.judge.surface_file import check_triangles
from touchatlas.sim.world.parts import hidden, hidden_area, part_of_faces
from touchatlas.sim.world.triangles import sample_triangles, surface_normals, topology_of


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
        check_whole(self, "samples", 1, np.inf)


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
        return box_diagonal(self.corners)

    @cached_property
    def closest(self) -> ClosestPoints:
        """The closest points of the triangles."""
        return ClosestPoints(self.vertices, self.faces)

    @cached_property
    def part_of_face(self) -> np.ndarray:
        """(f,) number of the separate part of the surface that each triangle belongs to."""
        return part_of_faces(self.faces)

    @cached_property
    def owners(self) -> np.ndarray:
        """(n,) triangle on which each point lies, of a body of several parts; else 0."""
        if not self.part_of_face.any():
            return np.zeros(len(self.points), int)
        return self.closest(self.points)[1]

    @cached_property
    def hidden(self) -> np.ndarray:
        """(n,) whether points lie inside of another part, where no touch reaches them."""
        return self._hidden(self.points, self.part_of_face[self.owners])

    @cached_property
    def _used(self) -> np.ndarray:
        """(c,) vertices that have a triangle."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        return np.flatnonzero(used)

    @cached_property
    def corners(self) -> np.ndarray:
        """(c, 3) vertices of the triangles, length."""
        return self.vertices[self._used]

    @cached_property
    def part_of_corners(self) -> np.ndarray:
        """(c,) number of the part of each of ``corners``."""
        parts = np.empty(len(self.vertices), int)
        parts[self.faces] = self.part_of_face[:, None]
        return parts[self._used]

    @cached_property
    def hidden_corners(self) -> np.ndarray:
        """(c,) whether ``corners`` lie inside of another part."""
        return self._hidden(self.corners, self.part_of_corners)

    @property
    def seen_corners(self) -> np.ndarray:
        """(s, 3) those of ``corners`` that do not."""
        return self.corners[~self.hidden_corners]

    @property
    def hidden_area(self) -> float:
        """Fraction of the true area that lies inside of other parts."""
        own = self.owners, self.hidden, self.part_of_face
        return hidden_area(self.vertices, self.faces, *own)

    def _hidden(self, points, own) -> np.ndarray:
        """(n,) whether points of the parts ``own`` (n,) lie inside of another part."""
        return hidden(points, own, self.vertices, self.faces, self.part_of_face)


def truth_from_mesh(vertices, faces, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """A mesh as the truth, sampled uniformly by area."""
    vertices, faces = check_triangles(vertices, faces, "the true mesh")
    points, index = sample_triangles(vertices, faces, options.samples, rng)
    topology = topology_of(faces)
    return Truth(
        vertices,
        faces,
        points,
        surface_normals(vertices, faces, index, points),
        topology.is_closed,
        topology.euler_characteristic,
    )
