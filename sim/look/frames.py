"""Frames: what was known before each touch of a run, as arrays of a few bytes a vertex."""

from dataclasses import dataclass, field

import numpy as np

from touchatlas.atlas import Atlas, Surface, Touch
from touchatlas.atlas.body.body import Body
from touchatlas.patch.geometry.arrays import frozen_array
from touchatlas.planner import Planner, ProbePlan, Step
from touchatlas.planner.scene import planes_of
from touchatlas.sim.look.words import Outlook, sought

# Vertices of a drawn surface, at most: more are not told apart in a window.
MOST_VERTICES = 12_000


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface to be looked at.

    Parameters
    ----------
    touch : int
        Number of touches by which it was known.
    vertices : (v, 3) float, length, world
    faces : (f, 3) int
    deviation : (v,) float, length
    face, patch : (v,) int
    """

    touch: int
    vertices: np.ndarray
    faces: np.ndarray
    deviation: np.ndarray
    face: np.ndarray
    patch: np.ndarray


@dataclass
class Frames:
    """What a run knew and did, touch by touch.

    Parameters
    ----------
    meshes : list of Mesh
        The surface before each touch, where it was another than before, and the last one.
    plans : list of ProbePlan
    touches : list of Touch
    words : list of str
        What each touch was for, and what was known before it.
    open_places : list of (k, 3) float, length, world
        Before each touch.
    outlook : Outlook
    scans : list of (n, 3) float, length, world
        Curves that were there before the first touch.
    """

    meshes: list[Mesh] = field(default_factory=list)
    plans: list[ProbePlan] = field(default_factory=list)
    touches: list[Touch] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    open_places: list[np.ndarray] = field(default_factory=list)
    outlook: Outlook = field(default_factory=Outlook)
    scans: list[np.ndarray] = field(default_factory=list)
    _body: Body | None = None

    def add(self, step: Step, planner: Planner, atlas: Atlas, apart: float) -> None:
        """Take one round; of the open places those farther from each other than ``apart``,
        length."""
        less = self.outlook.less_because(step.plan.known)
        words = [sought(step.plan), f"{step.plan.known:.1%} known", *([less] if less else [])]
        self.words.append("; ".join(words))
        self.outlook.add(step, atlas)
        places = planner.places
        if places is not None and places.surface is not None:
            # It was drawn from the body before the touch.
            self.meshes.append(mesh_of(places.surface, len(self.touches), self._body))
        self._body = atlas.body
        rim = np.zeros((0, 3)) if places is None else places.rim
        self.open_places.append(thinned(rim, apart))
        self.plans.append(step.plan)
        self.touches.append(step.touch)

    def end(self, surface: Surface | None, open_places, body: Body | None = None) -> None:
        """Take the finished surface, the places (k, 3) that stayed open, length, world, and the
        body that the surface was drawn from."""
        if surface is not None and len(surface.faces):
            self.meshes.append(mesh_of(surface, len(self.touches), body))
        self.open_places.append(np.reshape(open_places, (-1, 3)))

    def so_far(self) -> "Frames":
        """What is held now, which another thread may read while more is added."""
        count = len(self.touches)
        meshes = [mesh for mesh in self.meshes if mesh.touch <= count]
        places = [*self.open_places[:count], np.zeros((0, 3))]
        columns = self.plans[:count], self.touches[:count], self.words[:count]
        return Frames(meshes, *columns, places)

    def planes(self) -> list[np.ndarray]:
        """Corners (4 n, 3) of the planes of each plan: as large as its arms, and no larger than a
        third of what was touched."""
        contacts = np.reshape([touch.contact for touch in self.touches], (-1, 3))
        most = 0.2 * float(np.linalg.norm(np.ptp(contacts, axis=0))) if len(contacts) else 0.0
        return [planes_of([plan], most)[0] for plan in self.plans]


def mesh_of(surface: Surface, touch: int, body: Body | None = None) -> Mesh:
    """A surface as it is looked at, with fewer triangles where there are very many; without the
    ``body`` that it was drawn from, its patches are its faces."""
    kept, faces = clustered(surface.vertices, surface.faces, MOST_VERTICES)
    patch = face = surface.patch[kept].astype(np.int32)
    if body is not None:
        patch = body.field.trees.patches_at(surface.vertices[kept], face)
    return Mesh(
        touch,
        surface.vertices[kept].astype(np.float32),
        faces.astype(np.int32),
        surface.deviation[kept].astype(np.float32),
        face,
        patch,
    )


def thinned(points, apart: float) -> np.ndarray:
    """Points (k, 3) of those (n, 3), one in each cube of an edge ``apart``, length.

    >>> thinned(np.array([[0.1, 0, 0], [0.2, 0, 0], [5.0, 0, 0]]), 1.0).tolist()
    [[0.1, 0.0, 0.0], [5.0, 0.0, 0.0]]
    """
    points = frozen_array(points, (None, 3), "points")
    cubes = np.floor(points / apart)
    return points[np.sort(np.unique(cubes, axis=0, return_index=True)[1])]


def clustered(vertices, faces, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that are kept, by index (w,), and triangles (g, 3) between these: one vertex for
    each cube of a grid that is as fine as leaves ``most`` vertices or fewer (vertex clustering:
    Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993).

    All are kept where there are no more.
    """
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    if len(used) <= most:
        return used, faces
    points = vertices[used]
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    # A surface passes about six times the square of the number of cubes along its extent.
    cubes = int(np.sqrt(most / 2.0))
    while True:
        cells = np.floor((points - low) * (cubes / extent)).astype(np.int64)
        key = (cells[:, 0] * (cubes + 1) + cells[:, 1]) * (cubes + 1) + cells[:, 2]
        _, first, of = np.unique(key, return_index=True, return_inverse=True)
        if len(first) <= most:
            break
        cubes = int(0.8 * cubes)
    faces = of[faces]
    one, two, three = faces.T
    # A vertex of none of the triangles that are left has no normal.
    left, faces = np.unique(
        faces[(one != two) & (two != three) & (three != one)], return_inverse=True
    )
    return used[first[left]], faces.reshape(-1, 3)
