"""A triangle mesh as an object to touch: contours are its plane sections."""

import warnings
from functools import cached_property
from itertools import islice
from pathlib import Path

import igl
import numpy as np
import trimesh

from touchatlas.patch import ContourEnd
from touchatlas.sim.world.finer_steps import finer_steps, last_steps
from touchatlas.sim.world.triangles import areas_of, sample_triangles, top_sample

# Default noise and tolerance, as fractions of the diagonal: what a touch probe reaches on an object
# of the size of a hand. With twice as much fewer patches are needed.
_NOISE_FRACTION = 2e-4
_TOLERANCE_FRACTION = 1e-3
# Diagonal of the mesh in the frame in which rays are traced; single precision suits it as well as
# its double.
_RAY_EXTENT = 1e3
# Lines of an OFF file, comments included, in which its counts must stand.
_HEADER = 50
# Bounds of the coordinates, in any unit: beyond them their sixth powers leave the range of double
# precision.
_SMALLEST, _LARGEST = 1e-50, 1e50
# Largest coordinate after scaling. Then trimesh merges vertices that differ by less than 1e-8;
# with twice as much it would merge those of half the distance.
_USUAL_SPAN = 64.0


def load_mesh(path):
    """Vertices (v, 3) and faces (f, 3) of a mesh file, equal vertices merged.

    Raises
    ------
    ValueError
        In one sentence: missing, unreadable or cut-off file, no triangles, NaN, no extent.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give the path of a mesh (PLY, STL, OBJ, OFF, ...)")
    try:
        # Where a number cannot be stored, numpy warns and takes another one.
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            mesh = trimesh.load(path, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
        if vertices.shape[1:] != (3,) or (faces.size and faces.shape[1:] != (3,)):
            raise ValueError
    except Exception:
        # The messages of trimesh and numpy for a broken file do not name the cause.
        raise ValueError(
            f"{path} cannot be read as a mesh: it is cut off, damaged, or no {_kind(path)}; export "
            "it again as PLY or STL"
        ) from None
    if _is_cut_off(mesh) or len(faces) < _declared_in_off(path):
        raise ValueError(f"{path} is cut off: it holds less than it declares; export it again")
    if len(faces) == 0:
        raise ValueError(
            f"{path} holds no triangles: it is empty, cut off, or holds points only; give a "
            "surface mesh"
        )
    if not np.isfinite(vertices).all():
        raise ValueError(f"{path} holds NaN or infinite vertices; repair the mesh first")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError(f"{path} has faces that name vertices it does not have; export it again")
    vertices, faces = _merged(path, vertices, faces)
    faces = faces[areas_of(vertices, faces) > 0.0]
    if len(faces) == 0:
        raise ValueError(f"{path} has no extent: all its triangles have zero area")
    return vertices, faces


def _kind(path: Path) -> str:
    """The kind of file that the name promises."""
    known = path.suffix.lower().lstrip(".") in trimesh.available_formats()
    return f"{path.suffix[1:].upper()} file" if known else "file of a known ending"


def _is_cut_off(mesh) -> bool:
    """Whether a text PLY has fewer lines than its header says: trimesh takes what is there."""
    parts = mesh.metadata.get("_ply_raw", {}).values()
    tables = [(part.get("length", 0), part.get("data")) for part in parts]
    return any(
        length > min(map(len, data.values()), default=0)
        for length, data in tables
        if isinstance(data, dict)
    )


def _declared_in_off(path: Path) -> int:
    """The faces that an OFF file says it has: trimesh may have found fewer. 0 for other files."""
    if path.suffix.lower() != ".off":
        return 0
    with open(path, errors="replace") as file:
        lines = list(islice(file, _HEADER))
    words = " ".join(line.partition("#")[0] for line in lines).split()
    return int(words[2]) if len(words) > 2 and words[2].isdigit() else 0


def _merged(path: Path, vertices, faces):
    """Vertices and faces with equal vertices merged, in any unit: trimesh compares decimals."""
    span = float(np.abs(vertices[faces].reshape(-1, 3)).max())
    if not _SMALLEST < span < _LARGEST:
        raise ValueError(
            f"{path} has coordinates up to {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )
    # By a power of two, which rounds nothing; 1 for hand-sized objects in millimetres.
    unit = 2.0 ** np.round(np.log2(span / _USUAL_SPAN))
    mesh = trimesh.Trimesh(vertices / unit, faces, process=False)
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return unit * np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


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
    """

    description = "a mesh file"

    def __init__(self, name: str, vertices, faces) -> None:
        mesh, self.notes = _wound_alike(name, vertices, faces)
        faces = np.asarray(mesh.faces)
        counts = _triangles_of_edges(faces)
        # Bodies that touch along an edge have four triangles there, and are closed.
        self.closed = bool((counts % 2 == 0).all())
        self.notes += _notes_on_edges(name, counts)
        if self.closed and mesh.volume < 0:
            faces = np.ascontiguousarray(faces[:, ::-1])
        used = np.unique(faces)
        self.name, self.source = name, name
        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
        self.bounds = np.array([self.vertices[used].min(axis=0), self.vertices[used].max(axis=0)])
        self.diagonal = float(np.linalg.norm(self.bounds[1] - self.bounds[0]))
        self.noise_std = _NOISE_FRACTION * self.diagonal
        self.tolerance = _TOLERANCE_FRACTION * self.diagonal
        self.euler_characteristic = int(mesh.euler_number)
        self._tree = igl.AABB()
        self._tree.init(self.vertices, self.faces)
        # The tree's rays are in single precision with an absolute threshold for slivers: rays are
        # asked in a frame of fixed size, and the point found again on the triangle named.
        self._centre, self._unit = self.bounds.mean(axis=0), self.diagonal / _RAY_EXTENT
        self._ray_vertices = (self.vertices - self._centre) / self._unit
        self._ray_tree = igl.AABB()
        self._ray_tree.init(self._ray_vertices, self.faces)
        self._face_edges, self._edge_faces = self._adjacency()

    def _adjacency(self):
        """Edge ids of each face (f, 3), edge m opposite corner m, and faces of each edge."""
        pairs = np.sort(self.faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
        _, edges = np.unique(pairs, axis=0, return_inverse=True)
        edges = edges.reshape(-1, 3)
        order = np.argsort(edges.ravel(), kind="stable")
        starts = np.searchsorted(edges.ravel()[order], np.arange(edges.max() + 2))
        return edges, (order // 3, starts)

    @cached_property
    def area(self) -> float:
        """Area of the surface, length^2."""
        return float(areas_of(self.vertices, self.faces).sum())

    def mesh(self, sagitta: float):
        """The mesh itself: it is the truth, whatever ``sagitta`` is."""
        return self.vertices, self.faces

    def sample(self, count: int, rng):
        """Area-uniform points (count, 3) of the mesh and the normals of their triangles."""
        points, index = sample_triangles(self.vertices, self.faces, count, rng)
        return points, igl.per_face_normals(self.vertices, self.faces, np.zeros(3))[index]

    def start(self):
        """Point where a flat plate lowered on the object meets it, and the direction up."""
        return top_sample(self.sample(4000, np.random.default_rng(0))[0]), np.array([0.0, 0.0, 1.0])

    def contact(self, origin, direction, length: float):
        """First point where a segment meets the mesh, (3,), or None; None, too, for one that begins
        inside a closed mesh, where no probe can be."""
        start = (np.asarray(origin) - self._centre) / self._unit
        hits = self._ray_tree.intersect_ray(
            self._ray_vertices, self.faces, start[None], np.array([direction])
        )[0]
        # A hit is (face, distance, u, v).
        met = [self._distance_along(hit[0], origin, direction) for hit in hits]
        met = [(d, enters) for d, enters in met if 0.0 <= d <= length]
        if not met:
            return None
        distance, enters = min(met)
        return origin + distance * direction if enters or not self.closed else None

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
            self._arm(point, normal, direction, reach, step, max_turn, step_turn)
            for normal, direction in zip(plane_normals, directions, strict=True)
        ]

    def _arm(self, point, normal, direction, reach, step, max_turn, step_turn):
        ahead, open_end = self._walk(point, normal, direction, reach + step)
        behind, _ = self._walk(point, normal, -direction, step)
        line, lengths = _polyline(point, ahead)
        length = min(float(lengths[-1]), reach)
        samples = _at(line, lengths, step * np.arange(1, int(length / step + 1e-9) + 1))
        if not len(samples) and open_end:
            return _at(line, lengths, step * last_steps(length / step)), ContourEnd.LOST_CONTACT
        if not len(samples):
            return samples, ContourEnd.TURNED_AWAY
        first = _at(line, lengths, 0.5 * step) - _at(*_polyline(point, behind), 0.5 * step)
        chords = np.diff(np.vstack([point[None], samples]), axis=0)
        cosine = chords @ first / np.sqrt((chords**2).sum(axis=1) * (first @ first))
        turned = cosine < np.cos(max_turn)
        offset = samples - point
        home = ((offset**2).sum(axis=1) < (0.5 * step) ** 2) & (np.arange(len(samples)) > 2)
        whole = length >= reach - 1e-9 * reach
        end = ContourEnd.LENGTH_REACHED if whole else ContourEnd.LOST_CONTACT
        if (turned | home).any():
            stop = int((turned | home).argmax())
            end = ContourEnd.CLOSED_LOOP if home[stop] else ContourEnd.TURNED_AWAY
            samples = samples[:stop]
        samples = np.vstack([point[None], samples])
        at = finer_steps(samples, step_turn, lambda s: _at(line, lengths, step * s))
        if end is ContourEnd.LOST_CONTACT:
            at = np.append(at, last_steps(length / step))
        return _at(line, lengths, step * at[1:]), end

    def _walk(self, point, normal, direction, reach):
        """Polyline (k, 3) of the plane section from ``point`` onward, and whether it ended at a
        boundary of the mesh."""
        level = (self.vertices - point) @ normal
        above = level >= 0.0
        _, face, _ = self._tree.squared_distance(self.vertices, self.faces, point[None])
        face = int(np.ravel(face)[0])
        path, came, here, length = [], -1, point, 0.0
        owners, starts = self._edge_faces
        while length < reach:
            edge, crossing = self._exit(face, came, level, above, direction, point)
            if edge < 0:
                return np.array(path).reshape(-1, 3), False
            length += float(np.sqrt(((crossing - here) ** 2).sum()))
            path.append(crossing)
            here, came = crossing, edge
            beyond = [f for f in owners[starts[edge] : starts[edge + 1]] if f != face]
            if not beyond:
                return np.array(path), True
            face = int(beyond[0])
        return np.array(path), False

    def _exit(self, face, came, level, above, direction, point):
        """Edge by which the section leaves a face, and where; -1 when it does not cross it.

        In the first face, the crossing that lies farther along ``direction``.
        """
        best = (-1, None, -np.inf)
        corners = self.faces[face]
        for m in range(3):
            edge = int(self._face_edges[face, m])
            a, b = corners[(m + 1) % 3], corners[(m + 2) % 3]
            if edge == came or above[a] == above[b]:
                continue
            fraction = level[a] / (level[a] - level[b])
            crossing = self.vertices[a] + fraction * (self.vertices[b] - self.vertices[a])
            score = float((crossing - point) @ direction) if came < 0 else 0.0
            if score > best[2]:
                best = (edge, crossing, score)
        return best[0], best[1]


def _wound_alike(name: str, vertices, faces):
    """A mesh whose neighbouring triangles are wound alike, and a note where they had to be turned
    or could not be."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.is_winding_consistent:
        return mesh, []
    trimesh.repair.fix_winding(mesh)
    if mesh.is_winding_consistent:
        return mesh, [f"{name} has triangles wound in different directions; they were turned alike"]
    return mesh, [
        f"{name} cannot be wound alike everywhere: it has one side only, like a Moebius strip"
    ]


def _triangles_of_edges(faces) -> np.ndarray:
    """(e,) how many triangles each edge has."""
    pairs = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]], axis=2).reshape(-1, 2)
    return np.unique(pairs, axis=0, return_counts=True)[1]


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


def _polyline(point, path):
    """Corners (k, 3) of a path from a point, and the arc lengths (k,) there."""
    line = np.vstack([point[None], path]) if len(path) else point[None]
    steps = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1))
    return line, np.concatenate([[0.0], np.cumsum(steps)])


def _at(line, lengths, at) -> np.ndarray:
    """(..., 3) points of a polyline at arc lengths (...); its end beyond it."""
    return np.stack([np.interp(at, lengths, line[:, i]) for i in range(3)], axis=-1)
