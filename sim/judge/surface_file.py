"""A surface for the judge: read from a file, and checked."""

from pathlib import Path

import numpy as np

from touchatlas.sim.world.mesh_object import sound_faces
from touchatlas.sim.world.triangles import areas_of


def load_surface(path):
    """A surface file for the judge: vertices (v, 3), faces (f, 3), deviation (v,) or None, notes.

    A file with the vertex property ``deviation`` was written by a run, and stays as it is. In any
    other file equal vertices are merged, and faces are made sound as those of the truth are; what
    was changed is in the notes, in sentences.

    Raises
    ------
    ValueError
        In one sentence: missing or unreadable file, no triangles, NaN, no extent.
    """
    # A surface that was not read from a file is checked without trimesh.
    from touchatlas.sim.world.mesh_file import read_mesh

    vertices, faces, _, more = read_mesh(path)
    if not _holds_deviation(Path(path)):
        faces, _, notes = sound_faces(Path(path).stem, vertices, faces)
        return vertices, faces, None, more + notes
    import trimesh

    mesh = trimesh.load(path, force="mesh", process=False)
    # Here trimesh keeps the properties of a PLY that are not geometry, for both encodings.
    table = mesh.metadata.get("_ply_raw", {}).get("vertex", {}).get("data")
    vertices, faces = check_triangles(mesh.vertices, mesh.faces, str(path))
    return vertices, faces, check_deviation(np.ravel(table["deviation"]), len(vertices)), []


def _holds_deviation(path: Path) -> bool:
    """Whether a file is a PLY whose header names the property ``deviation``."""
    with path.open("rb") as file:
        header = file.read(4000).partition(b"end_header")[0].split()
    return header[:1] == [b"ply"] and b"deviation" in header


def check_triangles(vertices, faces, name: str):
    """Vertices and faces as arrays; ValueError with one sentence when they are no surface."""
    vertices, faces = np.asarray(vertices, dtype=float), np.asarray(faces)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(
            f"{name} has vertices of shape {vertices.shape} and faces of shape {faces.shape}; "
            "both must be (n, 3)"
        )
    if len(faces) == 0:
        raise ValueError(f"{name} has no triangles; there is nothing to compare")
    if not np.issubdtype(faces.dtype, np.integer):
        raise ValueError(f"{name} has faces of type {faces.dtype}; they must be vertex indices")
    if not np.isfinite(vertices).all():
        raise ValueError(f"{name} holds NaN or infinite vertices; repair it first")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError(f"{name} has faces that name vertices it does not have")
    if not areas_of(vertices, faces).any():
        raise ValueError(f"{name} has no area: all its triangles are degenerate")
    return vertices, faces.astype(np.int64)


def check_deviation(deviation, count: int) -> np.ndarray:
    """(count,) predicted deviations, all finite and not negative."""
    deviation = np.array(deviation, dtype=float)
    if deviation.shape != (count,):
        raise ValueError(
            f"deviation has shape {deviation.shape}; one number a vertex is needed: ({count},)"
        )
    if not (np.isfinite(deviation).all() and (deviation >= 0.0).all()):
        raise ValueError("deviation holds NaN, infinite or negative values; it must be >= 0")
    return deviation
