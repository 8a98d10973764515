"""Mesh files: vertices and faces, or one sentence on what is wrong with the file."""

import warnings
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh

from touchatlas.patch.geometry.arrays import has_powers
from touchatlas.sim.world.polygon_file import load_polygons
from touchatlas.sim.world.step_file import load_step
from touchatlas.sim.world.triangles import areas_of
from touchatlas.sim.world.units import UNITS


class MeshFile(NamedTuple):
    """Vertices (v, 3) and faces (f, 3) of a mesh file, the unit that it names, or "", and what a
    user should know about it, in sentences."""

    vertices: np.ndarray
    faces: np.ndarray
    unit: str
    notes: list[str]


def load_mesh(path):
    """Vertices (v, 3) and faces (f, 3) of a mesh file; see ``read_mesh``."""
    return read_mesh(path)[:2]


def read_mesh(path) -> MeshFile:
    """A mesh file, or the triangles of a STEP file, equal vertices merged.

    Raises
    ------
    ValueError
        In one sentence: missing, unreadable or cut-off file, no triangles, NaN, no extent.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(
            f"{path} is no file; give the path of a mesh (PLY, STL, OBJ, OFF, 3MF, ...) or STEP"
        )
    if path.suffix.lower() in (".step", ".stp"):
        vertices, faces, unit = load_step(path)
        vertices, faces = _checked(path, vertices, faces)
        return MeshFile(vertices, faces, unit, [])
    try:
        # Where a number cannot be stored, numpy warns and takes another one.
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            if own := load_polygons(path) or _binary_stl(path):
                mesh: Any = trimesh.Trimesh(own[0], own[1], process=False)
            else:
                mesh = trimesh.load(path, force="mesh", process=False)
        vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
        if vertices.shape[1:] != (3,) or (faces.size and faces.shape[1:] != (3,)):
            raise ValueError
    except PermissionError:
        raise
    except Exception as error:
        if path.suffix.lower() == ".3mf" and isinstance(error, ImportError):
            raise ValueError(f"{path}: 3MF needs `pip install 'touchatlas[formats]'`") from None
        # The messages of trimesh and numpy for a broken file do not name the cause.
        raise ValueError(
            f"{path} cannot be read as a mesh: it is cut off, damaged, or no {_kind(path)}; export "
            "it again as PLY or STL"
        ) from None
    if _is_cut_off(mesh) or len(faces) < _declared_in_off(path):
        raise ValueError(f"{path} is cut off: it holds less than it declares; export it again")
    unit = UNITS.get(str(mesh.units or ""), "")
    vertices, faces = _checked(path, vertices, faces)
    return MeshFile(vertices, faces, unit, _notes_on_digits(path, vertices))


def _checked(path: Path, vertices, faces):
    """Vertices and faces with equal vertices merged, without faces of no area; else refused."""
    if len(faces) == 0:
        raise ValueError(
            f"{path} holds no triangles: it is empty, cut off, or holds points only, which "
            "`touchatlas learn` takes; give a surface mesh"
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


def _notes_on_digits(path: Path, vertices) -> list[str]:
    """A note where single precision rounds by more than a tenth of the usual tolerance."""
    if np.abs(vertices).max() > np.finfo(np.float32).max:
        return []
    step = float(np.spacing(np.abs(vertices).max().astype(np.float32)))
    diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    # A thousandth of the diagonal is the tolerance.
    if step < 1e-4 * diagonal or not (vertices == vertices.astype(np.float32)).all():
        return []
    return [
        f"{path.name} holds coordinates in single precision, {step / (1e-3 * diagonal):.2g} "
        "tolerances apart so far from the origin; move the body to the origin before it is stored"
    ]


def _binary_stl(path: Path):
    """Corners and triangles of a binary STL that goes on after the last one it declares; None for
    any other file. trimesh takes such a file for a text."""
    if path.suffix.lower() != ".stl":
        return None
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if not 0 < 84 + 50 * count < len(data) or data[:5] == b"solid" and b"facet" in data[:400]:
        return None
    rows = np.frombuffer(data, np.dtype([("numbers", "<f4", (12,)), ("more", "<u2")]), count, 84)
    return rows["numbers"][:, 3:].reshape(-1, 3).astype(float), np.arange(3 * count).reshape(-1, 3)


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
        lines = list(islice(file, 50))
    words = " ".join(line.partition("#")[0] for line in lines).split()
    return int(words[2]) if len(words) > 2 and words[2].isdigit() else 0


def _merged(path: Path, vertices, faces):
    """Vertices and faces with equal vertices merged, in any unit: trimesh compares decimals."""
    span = float(np.abs(vertices[faces].reshape(-1, 3)).max())
    if span == 0.0:
        raise ValueError(f"{path} has no extent: all its vertices are at one point")
    if not has_powers(span, span):
        raise ValueError(
            f"{path} has coordinates up to {span:.3g}; that is no size that double precision can "
            "take powers of: use another unit"
        )
    # By a power of two, which rounds nothing; 1 for hand-sized objects in millimetres. trimesh
    # merges vertices that differ by less than 1e-8.
    unit = 2.0 ** np.round(np.log2(span / 64.0))
    mesh = trimesh.Trimesh(vertices / unit, faces, process=False)
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return unit * np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
