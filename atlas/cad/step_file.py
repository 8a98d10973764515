"""STEP export for CAD systems: the faces of a lawful body, or the triangles of a surface.

Where all faces obey laws each becomes one face of the file: a plane, cylinder, cone or sphere by
its name in STEP, trimmed by curves that two faces share, with a fillet along each blunt edge.
Any other surface is written as triangles, as few as the tolerance allows. Faces that close up
become a solid.
"""

from dataclasses import dataclass
from pathlib import Path

from touchatlas.atlas.cad.face_layout import NotWritten
from touchatlas.atlas.cad.fewer_triangles import fewer_triangles
from touchatlas.atlas.cad.lawful_shapes import lawful_shapes
from touchatlas.atlas.cad.occ_kernel import is_solid, need_kernel, step_bytes
from touchatlas.atlas.cad.occ_triangles import triangle_shapes
from touchatlas.atlas.faces.body import Body
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.mesh.extract import extract_surface
from touchatlas.atlas.state import AtlasState

# Largest distance of the triangles in a file from those of the surface, in tolerances: what most of
# a surface errs by. Doubled, files are half as large.
_COARSER = 0.5


@dataclass(frozen=True)
class StepReport:
    """The contents of a STEP file and their accuracy.

    Parameters
    ----------
    faces : int
        Number of faces in the file: the sum of the next six.
    planes, cylinders, cones, spheres : int
        Faces of a lawful body.
    fillets : int
        Faces that round its blunt edges, and the corners between them.
    triangles : int
        Plane faces of a surface that has no other names in STEP; 0 where it is written by its laws.
    solids, open_shells : int
        Numbers of each in the file.
    left_out : int
        Small stray parts of the surface of a lawful body.
    gap : float, length
        Tolerance of the file: largest distance of an edge from its faces, or of the triangles from
        the surface.
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
    solids: int = 0
    open_shells: int = 0
    left_out: int = 0
    gap: float = 0.0
    note: str = ""


def save_step(state: AtlasState, path) -> StepReport:
    """Write an atlas as a STEP file, all of it or nothing.

    Where all faces of the body obey laws there is one face for each of them; where that cannot be
    done, or they do not, there are triangles.

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
        When nothing of the surface is known, or the extra ``cad`` is not installed.
    OSError
        When the file cannot be written; an old one is left as it was.
    """
    need_kernel()
    if state.body is None:
        return _save_triangles(state, path, "")
    try:
        return _save_faces(state, state.body, path)
    except NotWritten as reason:
        return _save_triangles(state, path, f"written as triangles: {reason}")


def _save_faces(state: AtlasState, body: Body, path) -> StepReport:
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


def _save_triangles(state: AtlasState, path, note: str) -> StepReport:
    """Write the triangles of the surface."""
    coarser = _COARSER * state.tolerance
    shapes = triangle_shapes(fewer_triangles(extract_surface(state), coarser))
    if not shapes:
        raise ValueError("nothing of the surface is known yet; touch it more")
    gap = coarser + state.options.facets * state.tolerance
    write_whole(path, step_bytes(shapes, gap, Path(path).name))
    count, solids = sum(len(one.faces) for one in shapes), sum(map(is_solid, shapes))
    return StepReport(
        faces=count,
        triangles=count,
        solids=solids,
        open_shells=len(shapes) - solids,
        gap=gap,
        note=note,
    )
