"""surface.ply: binary PLY with normal, predicted deviation, face and colour at each vertex."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from touchatlas.atlas import Surface

# MeshLab and VTK drop properties that they do not know, and keep quality.
_NUMBERS = ("x", "y", "z", "nx", "ny", "nz", "deviation", "quality")
_COLOURS = ("red", "green", "blue")
_FACE = np.dtype([("count", "u1"), ("indices", "<i4", (3,))])
_WORDS = {"<f4": "float", "<f8": "double"}
_CODES = {"float": "<f4", "double": "<f8", "int": "<i4", "uchar": "u1"}
_NAMES = (*_NUMBERS, "patch", *_COLOURS)


def stored(surface: Surface, tolerance: float) -> Surface:
    """A surface rounded as surface.ply holds it, so that who reads the file finds its numbers."""
    kind = _kind(surface, tolerance)
    rounded = {
        name: getattr(surface, name).astype(kind).astype(float)
        for name in ("vertices", "normals", "deviation")
    }
    return replace(surface, **rounded)


def ply_bytes(surface: Surface, tolerance: float) -> bytes:
    """A surface as a little-endian binary PLY.

    The property ``patch`` is the id of the face that a vertex lies on. Coordinates are in single
    precision where that rounds by a hundredth of the tolerance at most. Colours show the deviation:
    those of viridis, from 0 to the tolerance.
    """
    kind = _kind(surface, tolerance)
    columns = [(name, kind) for name in _NUMBERS]
    columns += [("patch", "<i4"), *((name, "u1") for name in _COLOURS)]
    vertices = np.empty(len(surface.vertices), np.dtype(columns))
    for axis, name in enumerate("xyz"):
        vertices[name] = surface.vertices[:, axis]
        vertices["n" + name] = surface.normals[:, axis]
    vertices["deviation"] = vertices["quality"] = surface.deviation
    vertices["patch"] = surface.patch
    colours = deviation_colours(surface.deviation, tolerance)
    for channel, name in enumerate(_COLOURS):
        vertices[name] = colours[:, channel]
    faces = np.empty(len(surface.faces), _FACE)
    faces["count"], faces["indices"] = 3, surface.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property {_WORDS[kind]} {name}" for name in _NUMBERS] + ["property int patch"]
    header += [f"property uchar {name}" for name in _COLOURS]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return ("\n".join(header) + "\n").encode() + vertices.tobytes() + faces.tobytes()


def read_ply(path) -> Surface:
    """The surface of a file that ``ply_bytes`` made; its curvatures, which are not kept, are zero.

    Raises
    ------
    ValueError
        When it is another file, or cut off.
    """
    content = Path(path).read_bytes()
    head, _, body = content.partition(b"end_header\n")
    words = [line.split() for line in head.decode("ascii", "replace").splitlines()]
    counts = [int(line[2]) for line in words if line[:1] == ["element"] and line[2].isdigit()]
    columns = [(line[2], _CODES.get(line[1], "u1")) for line in words if len(line) == 3]
    kind = np.dtype([(name, code) for name, code in columns if name != "1.0" and name in _NAMES])
    # Runs of earlier versions hold no quality.
    if not {*_NAMES} - {"quality"} <= {name for name, _ in columns} or len(counts) != 2:
        raise ValueError(f"{path} is no surface.ply of a run; give one")
    if len(body) != counts[0] * kind.itemsize + counts[1] * _FACE.itemsize:
        raise ValueError(f"{path} is cut off; give a whole one")
    table = np.frombuffer(body, kind, counts[0])
    faces = np.frombuffer(body, _FACE, counts[1], counts[0] * kind.itemsize)["indices"]
    point, normal = (
        np.stack([table[f"{before}{axis}"] for axis in "xyz"], axis=1).astype(float)
        for before in ("", "n")
    )
    deviation, face = table["deviation"].astype(float), table["patch"].astype(int)
    return Surface(point, faces.astype(int), normal, deviation, face, np.zeros(len(table)))


def deviation_colours(deviation, tolerance: float) -> np.ndarray:
    """(v, 3) bytes of red, green and blue for deviations (v,) from 0 to the tolerance."""
    from matplotlib import colormaps

    fraction = np.clip(np.asarray(deviation) / tolerance, 0.0, 1.0)
    return colormaps["viridis"](fraction, bytes=True)[:, :3]


def _kind(surface: Surface, tolerance: float) -> str:
    """Single precision, or double where that rounds too much."""
    largest = float(np.abs(surface.vertices).max(initial=0.0))
    return "<f4" if largest * np.finfo("f4").epsneg <= 0.01 * tolerance else "<f8"
