"""A surface in the formats of other programs: GLB and 3MF, in their units, and tables of faces."""

import csv
import io

import numpy as np
import trimesh

from touchatlas.atlas import Surface
from touchatlas.sim.folder.ply import deviation_colours
from touchatlas.sim.world.units import MILLIMETRES


def glb_bytes(surface: Surface, tolerance: float, unit: str) -> bytes:
    """A surface as binary glTF 2.0, which is in metres, with y up as it is: axes are not changed.

    Vertices have normals, colours of the deviation from 0 to the tolerance, and the attribute
    ``_DEVIATION`` in metres.
    """
    metres = MILLIMETRES[unit] / 1e3
    mesh = surface.to_trimesh()
    colours = deviation_colours(surface.deviation, tolerance)
    opaque = np.c_[colours, np.full(len(colours), 255, np.uint8)]
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=opaque)
    mesh.vertex_attributes.clear()
    mesh.vertex_attributes["_DEVIATION"] = (metres * surface.deviation).astype(np.float32)
    mesh.apply_scale(metres)
    return _bytes(mesh.export(file_type="glb", include_normals=True))


def model_bytes(surface: Surface, unit: str) -> bytes:
    """The triangles of a surface as 3MF, in millimetres.

    Raises
    ------
    ValueError
        When the extra ``formats`` is not installed.
    """
    mesh = surface.to_trimesh()
    mesh.vertex_attributes.clear()
    mesh.apply_scale(MILLIMETRES[unit])
    try:
        return _bytes(mesh.export(file_type="3mf"))
    except ImportError:
        raise ValueError("3MF needs `pip install 'touchatlas[formats]'`") from None


def _bytes(content) -> bytes:
    """What an exporter of one file gives."""
    assert isinstance(content, bytes)
    return content


def csv_bytes(rows: list[dict]) -> bytes:
    """A table as CSV, with a column for each key of any row."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()
