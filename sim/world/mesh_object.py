"""A triangle mesh as an object to touch: contours are its plane sections."""

from functools import cached_property

import igl
import numpy as np

from touchatlas.sim.world.mesh_sections import PlaneSections
from touchatlas.sim.world.parts import turned_outward
from touchatlas.sim.world.triangles import (
    areas_of,
    edge_keys,
    sample_triangles,
    surface_normals,
    top_sample,
    topology_of,
)

# Sides from which an open mesh is approached, in this order: from above, below, and around.
_SIDES = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], float)


class MeshObject:
    """Any triangle mesh, closed or open.

    Parameters
    ----------
    name : str
    vertices : (v, 3) float, length
    faces : (f, 3) int
        Turned alike where they are not, and outward when the mesh is closed.

    Attributes
    ----------
    notes : list of str
        What a user should know about the mesh, in sentences.
    unit : str
        Of its lengths, "" where the file names none.
    """

    description = "a mesh file"

    def __init__(self, name: str, vertices, faces) -> None:
        faces, self.closed, self.notes = sound_faces(name, vertices, faces)
        if self.closed:
            _refuse_flat(name, np.asarray(vertices, float)[np.unique(faces)])
        used = np.unique(faces)
        self.name, self.source, self.unit = name, name, ""
        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
        self.bounds = np.array([self.vertices[used].min(axis=0), self.vertices[used].max(axis=0)])
        self.diagonal = float(np.linalg.norm(self.bounds[1] - self.bounds[0]))
        # What a touch probe reaches on an object of the size of a hand.
        self.noise_std = 2e-4 * self.diagonal
        self.tolerance = 1e-3 * self.diagonal
        self.euler_characteristic = topology_of(self.faces).euler_characteristic
        # The tree's rays are in single precision with an absolute threshold for slivers: rays are
        # asked in a frame of fixed size, and the point found again on the triangle named.
        # Rays are traced in single precision, at a diagonal of a thousand.
        self._centre, self._unit = self.bounds.mean(axis=0), self.diagonal / 1e3
        self._ray_vertices = (self.vertices - self._centre) / self._unit
        self._ray_tree = igl.AABB()
        self._ray_tree.init(self._ray_vertices, self.faces)
        self._sections = PlaneSections(self.vertices, self.faces)

    @cached_property
    def area(self) -> float:
        """Area of the surface, length^2."""
        return float(areas_of(self.vertices, self.faces).sum())

    def mesh(self, sagitta: float):
        """The mesh itself: it is the truth, whatever ``sagitta`` is."""
        return self.vertices, self.faces

    def sample(self, count: int, rng):
        """Area-uniform points (count, 3) of the mesh and its unit normals there."""
        points, index = sample_triangles(self.vertices, self.faces, count, rng)
        normals = surface_normals(self.vertices, self.faces, index, points)
        length = np.sqrt((normals * normals).sum(axis=1, keepdims=True))
        return points, normals / np.where(length > 0.0, length, 1.0)

    def start(self):
        """Point where a flat plate lowered on the object meets it, and the direction up.

        Of an open mesh it is the first of six sides from which the outer side of the surface is
        seen: the plate would meet a bowl that stands upright at its rim.
        """
        points, normals = self.sample(4000, np.random.default_rng(0))
        for side in _SIDES if not self.closed else ():
            # Within 60 degrees.
            seen = points[normals @ side > 0.5]
            if not len(seen):
                continue
            top = top_sample(seen, side)
            met = self.contact(top + self.diagonal * side, -side, 2.0 * self.diagonal)
            if met is not None and (met - top) @ side < 0.01 * self.diagonal:
                return top, side
        return top_sample(points), _SIDES[0]

    def contact(self, origin, direction, length: float):
        """First point where a segment that does not begin inside meets the mesh, (3,), or None."""
        met = [distance for distance, _ in self._met(origin, direction) if distance <= length]
        return origin + min(met) * direction if met else None

    def is_inside(self, point) -> bool:
        """Whether a point (3,) lies inside of a closed mesh, where no probe can be: a ray from it
        first meets triangles from their inner side. Where it enters as well, it only touches an
        edge of the mesh from outside."""
        # The direction is in no plane of usual parts. Triangles nearer than a billionth of the
        # diagonal along a ray are met at once.
        met = self._met(point, np.array([0.36, 0.48, 0.8])) if self.closed else []
        first = min(met, default=(0.0, True))[0] + 1e-9 * self.diagonal
        return bool(met) and not any(enters for distance, enters in met if distance <= first)

    def _met(self, origin, direction) -> list[tuple[float, bool]]:
        """Where a ray meets the mesh, length, and whether from the outside, in no order."""
        start = (np.asarray(origin) - self._centre) / self._unit
        hits = self._ray_tree.intersect_ray(
            self._ray_vertices, self.faces, start[None], np.array([direction])
        )[0]
        # A hit is (face, distance, u, v).
        met = [self._distance_along(hit[0], origin, direction) for hit in hits]
        return [(distance, enters) for distance, enters in met if distance >= 0.0]

    def _distance_along(self, face: int, origin, direction) -> tuple[float, bool]:
        """Where a ray meets the plane of a face, length, and whether from its outside."""
        a, b, c = self.vertices[self.faces[face]]
        normal = np.cross(b - a, c - a)
        slope = float(normal @ direction)
        return float(normal @ (a - origin)) / slope if slope != 0.0 else -1.0, slope < 0.0

    def trace_arms(self, point, plane_normals, directions, reach, step, max_turn, step_turn=np.pi):
        """Curves from a surface point in several planes; see ImplicitObject.trace_arms.

        A sharp edge of a mesh cannot be told from a coarse facet by one contour: turning is
        measured over a whole step, and an edge shows as TURNED_AWAY.
        """
        return [
            self._sections.arm(point, normal, direction, reach, step, max_turn, step_turn)
            for normal, direction in zip(plane_normals, directions, strict=True)
        ]


def sound_faces(name: str, vertices, faces) -> tuple[np.ndarray, bool, list[str]]:
    """Each face once, neighbours wound alike, closed bodies turned outward.

    Returns
    -------
    faces : (f, 3) int
    closed : bool
    notes : list of str
        What was changed, and what else a user should know, in sentences.
    """
    faces, notes = _each_once(name, np.asarray(faces, np.int64))
    faces, more = _wound_alike(name, vertices, faces)
    counts = _triangles_of_edges(faces)
    # Bodies that touch along an edge have four triangles there, and are closed.
    closed = bool((counts % 2 == 0).all())
    notes += more + _notes_on_edges(name, counts)
    if closed:
        faces, wrong = turned_outward(vertices, faces)
        notes += [_many(name, wrong)] if wrong else []
    return faces, closed, notes


def _refuse_flat(name: str, vertices) -> None:
    """Refuse a closed mesh in one plane: it has no inside."""
    sizes = np.linalg.svd(vertices - vertices.mean(axis=0), compute_uv=False)
    # A millionth of the tolerance is flat.
    if not sizes[2] > 1e-9 * sizes[0]:
        raise ValueError(
            f"{name} is a closed mesh in one plane, which encloses nothing; give a body, or one "
            "side of a sheet"
        )


def _wound_alike(name: str, vertices, faces):
    """Faces of which neighbours are wound alike, and a note where they had to be turned or could
    not be."""
    if topology_of(faces).is_wound_alike:
        return faces, []
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    trimesh.repair.fix_winding(mesh)
    if mesh.is_winding_consistent:
        return np.asarray(mesh.faces), [
            f"{name} has triangles wound in different directions; they were turned alike"
        ]
    return np.asarray(mesh.faces), [
        f"{name} cannot be wound alike everywhere: it has one side only, like a Moebius strip"
    ]


def _each_once(name: str, faces):
    """Faces (f, 3) of which none has the corners of an earlier one, and a note where any had.

    A face that two bodies have in common is a wall between them, and left out where the others
    close without it.
    """
    sorted_ = np.sort(faces, axis=1)
    first, counts = np.unique(sorted_, axis=0, return_index=True, return_counts=True)[1:]
    if len(first) == len(faces):
        return faces, []
    twice, single = len(faces) - len(first), np.sort(first[counts == 1])
    if len(single) and not (_triangles_of_edges(faces[single]) % 2).any():
        return faces[single], [
            f"{name} has walls between bodies that share triangles ({twice}); they were left out"
        ]
    return faces[np.sort(first)], [
        f"{name} has triangles that name the same corners again ({twice}); they count once"
    ]


def _many(name: str, wrong: int) -> str:
    bodies = "was a body" if wrong == 1 else f"were {wrong} bodies"
    return f"in {name} there {bodies} inside out, now turned outward"


def _triangles_of_edges(faces) -> np.ndarray:
    """(e,) how many triangles each edge has."""
    return np.unique(edge_keys(faces), return_counts=True)[1]


def _notes_on_edges(name: str, counts) -> list[str]:
    """Notes on edges that do not have two triangles."""
    found, open_edges, many = [], int((counts == 1).sum()), int((counts > 2).sum())
    if open_edges:
        found.append(
            f"{name} is an open mesh (edges with one triangle only: {open_edges}); its surface "
            "will be open too"
        )
    if many:
        found.append(
            f"{name} has edges where more than two triangles meet ({many}); contours that cross "
            "one may go on along the wrong triangle"
        )
    return found
