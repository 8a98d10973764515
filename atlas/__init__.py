"""Atlas: samples, faces and patches of a surface, the only object that changes."""

from typing import TYPE_CHECKING

from touchatlas.patch.lazy_names import lazy_names

if TYPE_CHECKING:
    from touchatlas.atlas.atlas import Atlas
    from touchatlas.atlas.cad.lawful import LawfulOptions
    from touchatlas.atlas.cad.step import StepReport, save_step
    from touchatlas.atlas.check.doubt import Doubt
    from touchatlas.atlas.check.doubts import doubts
    from touchatlas.atlas.edges.boundary import EdgeKind
    from touchatlas.atlas.faces.face_graph import write_graphml, write_json
    from touchatlas.atlas.faces.faces import Face, FaceEdge, Faces
    from touchatlas.atlas.field.face_field import FaceValues, face_values
    from touchatlas.atlas.mesh.surface import Surface, extract_surface
    from touchatlas.atlas.records.blend import Blend
    from touchatlas.atlas.records.options import AtlasOptions, Levels
    from touchatlas.atlas.records.scan import Scan
    from touchatlas.atlas.records.touch import AtlasChange, Touch, TouchStatus
    from touchatlas.atlas.store import load_atlas, save_atlas

__all__ = [
    "Atlas",
    "AtlasChange",
    "AtlasOptions",
    "Blend",
    "Doubt",
    "EdgeKind",
    "Face",
    "FaceEdge",
    "FaceValues",
    "Faces",
    "LawfulOptions",
    "Levels",
    "Scan",
    "StepReport",
    "Surface",
    "Touch",
    "TouchStatus",
    "doubts",
    "extract_surface",
    "face_values",
    "load_atlas",
    "save_atlas",
    "save_step",
    "write_graphml",
    "write_json",
]
__getattr__ = lazy_names(
    {
        "Atlas": "touchatlas.atlas.atlas",
        "AtlasChange": "touchatlas.atlas.records.touch",
        "AtlasOptions": "touchatlas.atlas.records.options",
        "Blend": "touchatlas.atlas.records.blend",
        "Doubt": "touchatlas.atlas.check.doubt",
        "EdgeKind": "touchatlas.atlas.edges.boundary",
        "Face": "touchatlas.atlas.faces.faces",
        "FaceEdge": "touchatlas.atlas.faces.faces",
        "FaceValues": "touchatlas.atlas.field.face_field",
        "face_values": "touchatlas.atlas.field.face_field",
        "Faces": "touchatlas.atlas.faces.faces",
        "LawfulOptions": "touchatlas.atlas.cad.lawful",
        "Levels": "touchatlas.atlas.records.options",
        "Scan": "touchatlas.atlas.records.scan",
        "StepReport": "touchatlas.atlas.cad.step",
        "Surface": "touchatlas.atlas.mesh.surface",
        "Touch": "touchatlas.atlas.records.touch",
        "TouchStatus": "touchatlas.atlas.records.touch",
        "doubts": "touchatlas.atlas.check.doubts",
        "extract_surface": "touchatlas.atlas.mesh.surface",
        "load_atlas": "touchatlas.atlas.store",
        "save_atlas": "touchatlas.atlas.store",
        "save_step": "touchatlas.atlas.cad.step",
        "write_graphml": "touchatlas.atlas.faces.face_graph",
        "write_json": "touchatlas.atlas.faces.face_graph",
    }
)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
