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
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "atlas": "Atlas",
        "cad.lawful": "LawfulOptions",
        "cad.step": "StepReport save_step",
        "check.doubt": "Doubt",
        "check.doubts": "doubts",
        "edges.boundary": "EdgeKind",
        "faces.face_graph": "write_graphml write_json",
        "faces.faces": "Face FaceEdge Faces",
        "field.face_field": "FaceValues face_values",
        "mesh.surface": "Surface extract_surface",
        "records.blend": "Blend",
        "records.options": "AtlasOptions Levels",
        "records.scan": "Scan",
        "records.touch": "AtlasChange Touch TouchStatus",
        "store": "load_atlas save_atlas",
    },
)
