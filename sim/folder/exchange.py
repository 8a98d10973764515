"""A surface in the formats of other programs: GLB and 3MF, in their units, and tables of faces."""

import csv
import io
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

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


_MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US"
 xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model"><mesh>
<vertices>
{vertices}
</vertices>
<triangles>
{triangles}
</triangles>
</mesh></object></resources>
<build><item objectid="1"/></build>
</model>
"""
_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0"
 Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""


def model_bytes(surface: Surface, unit: str) -> bytes:
    """The triangles of a surface as 3MF, core specification 1.3, in millimetres.

    Equal surfaces give equal bytes: the archive has no date of today.
    """
    points = (MILLIMETRES[unit] * surface.vertices).tolist()
    vertices = [f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in points]
    triangles = [f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in surface.faces.tolist()]
    model = _MODEL.format(vertices="\n".join(vertices), triangles="\n".join(triangles))
    parts = {"[Content_Types].xml": _TYPES, "_rels/.rels": _RELATIONS, "3D/3dmodel.model": model}
    archive = io.BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED) as file:
        for name, text in parts.items():
            entry = ZipInfo(name)
            entry.compress_type = ZIP_DEFLATED
            file.writestr(entry, text)
    return archive.getvalue()


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
