"""STEP export: the faces of a lawful body, or the trimmed patches of an atlas, for CAD systems.

Where all faces obey laws each becomes one face of the file: a plane, cylinder, cone or sphere by
its name in STEP, trimmed by curves that two faces share, with a fillet along each blunt edge.
Where some of its faces are free-form, a body is written as the triangles of its surface. Otherwise
every patch becomes one trimmed Bezier surface, off its sides by half the gap between the patches.
The file states these distances as tolerances of the edges. Faces that close up become a solid.
"""

from dataclasses import dataclass
from pathlib import Path

import networkx as nx

from touchatlas.atlas.cad.bezier_face import BezierFace, bezier_face
from touchatlas.atlas.cad.face_layout import NotWritten
from touchatlas.atlas.cad.lawful_shapes import lawful_shapes
from touchatlas.atlas.cad.occ_kernel import is_solid, need_kernel, step_bytes
from touchatlas.atlas.cad.occ_patches import is_closed, patch_shape
from touchatlas.atlas.cad.occ_triangles import triangle_shapes
from touchatlas.atlas.cad.trimmed_patches import trimmed_patches
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.mesh.lawful_surface import fine_edge, lawful_surface
from touchatlas.atlas.state import AtlasState

# Largest error of a face's height, in tolerances: negligible beside the patch's own error. Doubled,
# some faces get a lower degree.
_HEIGHT_ERROR = 1e-4


@dataclass(frozen=True)
class StepReport:
    """The contents of a STEP file and their accuracy.

    Parameters
    ----------
    faces : int
        Number of faces in the file: the sum of the next seven.
    planes, cylinders, cones, spheres : int
        Faces of a lawful body.
    fillets : int
        Faces that round its blunt edges, and the corners between them.
    triangles : int
        Plane faces of a body that has no other names in STEP; 0 where it is written by its laws.
    patches : int
        Bezier faces of overlapping patches; 0 where the faces of a body are written.
    solids, open_shells : int
        Numbers of each in the file.
    left_out : int
        Faces of patches that stand upright within their own cells, or small stray parts of the
        surface of a lawful body.
    height_error : float, length
        Largest difference between a patch and its Bezier surface on its cell.
    gap : float, length
        Largest distance of an edge from its faces: the tolerance of the file.
    note : str
        Why the faces of a body were written as triangles, or its blunt edges sharp; empty
        otherwise.
    """

    faces: int
    planes: int = 0
    cylinders: int = 0
    cones: int = 0
    spheres: int = 0
    fillets: int = 0
    triangles: int = 0
    patches: int = 0
    solids: int = 0
    open_shells: int = 0
    left_out: int = 0
    height_error: float = 0.0
    gap: float = 0.0
    note: str = ""


def save_step(state: AtlasState, path) -> StepReport:
    """Write an atlas as a STEP file, all of it or nothing.

    Where all faces of the body obey laws there is one face for each of them; where that cannot be
    done, or they do not, one trimmed Bezier face a patch.

    Parameters
    ----------
    state : AtlasState
    path : path
        The file. One unit of length of the atlas is one millimetre there. Equal atlases give equal
        bytes: the header has no date.

    Returns
    -------
    StepReport

    Raises
    ------
    ValueError
        When the atlas has no patch, or none with a height, or the extra ``cad`` is not
        installed.
    OSError
        When the file cannot be written; an old one is left as it was.
    """
    need_kernel()
    if state.body is None:
        return _save_patches(state, path)
    try:
        return _save_faces(state, state.body, path)
    except NotWritten as reason:
        return _save_triangles(state, state.body, path, f"written as triangles: {reason}")


def _save_faces(state: AtlasState, body: LawfulBody, path) -> StepReport:
    """Write the faces of a lawful body."""
    made = lawful_shapes(body, state.tolerance, state.options.facets * state.tolerance)
    write_whole(path, step_bytes(made.shapes, made.gap, Path(path).name))
    solids = sum(made.brep.closed)
    return StepReport(
        faces=len(made.brep.faces) + made.fillets,
        planes=made.count("plane"),
        cylinders=made.count("cylinder"),
        cones=made.count("cone"),
        spheres=made.count("sphere"),
        fillets=made.fillets,
        solids=solids,
        open_shells=len(made.brep.closed) - solids,
        left_out=made.left_out,
        gap=made.gap,
        note=made.note,
    )


def _save_triangles(state: AtlasState, body: LawfulBody, path, note: str) -> StepReport:
    """Write the triangles of a body."""
    sagitta = state.options.facets * state.tolerance
    shapes = triangle_shapes(lawful_surface(body, fine_edge(body, sagitta)))
    if not shapes:
        raise ValueError("nothing of the surface is known yet; touch it more")
    write_whole(path, step_bytes(shapes, sagitta, Path(path).name))
    count, solids = sum(len(one.faces) for one in shapes), sum(map(is_solid, shapes))
    return StepReport(
        faces=count,
        triangles=count,
        solids=solids,
        open_shells=len(shapes) - solids,
        gap=sagitta,
        note=note,
    )


def _save_patches(state: AtlasState, path) -> StepReport:
    """Write the trimmed patches."""
    found = [bezier_face(face, _HEIGHT_ERROR * state.tolerance) for face in trimmed_patches(state)]
    faces = [face for face in found if face is not None]
    if not faces:
        raise ValueError("every patch stands upright within its own cell; touch more closely")
    parts = components(faces)
    gap = max(float(face.gaps.max()) for face in faces)
    write_whole(path, step_bytes([patch_shape(part) for part in parts], gap, Path(path).name))
    solids = sum(map(is_closed, parts))
    return StepReport(
        faces=len(faces),
        patches=len(faces),
        solids=solids,
        open_shells=len(parts) - solids,
        left_out=len(found) - len(faces),
        height_error=max(face.error for face in faces),
        gap=gap,
    )


def components(faces: list[BezierFace]) -> list[list[BezierFace]]:
    """Faces that are connected by shared sides, each component in the given order."""
    graph = nx.Graph()
    for index, face in enumerate(faces):
        graph.add_edges_from((("face", index), side.number) for side in face.face.sides)
    parts = [
        sorted(node[1] for node in part if isinstance(node, tuple))
        for part in nx.connected_components(graph)
    ]
    return [[faces[index] for index in part] for part in sorted(parts)]
