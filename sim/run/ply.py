"""surface.ply: binary PLY with normals, predicted deviation and patch id at each vertex."""

import numpy as np

from touchatlas.atlas import Surface

_DOUBLES = ("x", "y", "z", "nx", "ny", "nz", "deviation")
_VERTEX = np.dtype([(name, "<f8") for name in _DOUBLES] + [("patch", "<i4")])
_FACE = np.dtype([("count", "u1"), ("indices", "<i4", (3,))])


def ply_bytes(surface: Surface) -> bytes:
    """A surface as a little-endian binary PLY."""
    vertices = np.empty(len(surface.vertices), _VERTEX)
    for axis, name in enumerate("xyz"):
        vertices[name] = surface.vertices[:, axis]
        vertices["n" + name] = surface.normals[:, axis]
    vertices["deviation"], vertices["patch"] = surface.deviation, surface.patch
    faces = np.empty(len(surface.faces), _FACE)
    faces["count"], faces["indices"] = 3, surface.faces
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property double {name}" for name in _DOUBLES] + ["property int patch"]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return ("\n".join(header) + "\n").encode() + vertices.tobytes() + faces.tobytes()
