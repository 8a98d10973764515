"""STEP export for CAD systems: the faces of a lawful body, Bezier faces of a smooth one, or
triangles.

Where all faces obey laws each becomes one face of the file: a plane, cylinder, cone or sphere by
its name in STEP, trimmed by curves that two faces share, with a fillet along each blunt edge.
Any other closed body without edges becomes Bezier faces that share their edges. Triangles are the
rest. Of both there are as few as the tolerance allows. Faces that close up become a solid.
"""

from dataclasses import dataclass
from pathlib import Path

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.bezier.bezier_shapes import bezier_shapes
from touchatlas.atlas.cad.fewer_triangles import fewer_triangles
from touchatlas.atlas.cad.lawful.lawful_shapes import lawful_shapes
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_kernel import is_solid, need_kernel, step_bytes
from touchatlas.atlas.cad.occ_triangles import triangle_shapes
from touchatlas.atlas.contouring.body_surface import is_smooth
from touchatlas.atlas.files import check_path, write_whole
from touchatlas.atlas.mesh.extract import extract_surface
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.state import AtlasState

# Largest distance of Bezier faces from the surface, or of the triangles in a file from those of the
# surface, in tolerances: what most of a surface errs by. Doubled, files of triangles are half as
# large, and those of Bezier faces up to a tenth smaller.
_COARSER = 0.5
_NOTHING = "nothing of the surface is known yet; touch it more"


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
    smooth : int
        Bezier faces of a closed body without edges.
    triangles : int
        Plane faces of a surface that could be written by nothing else.
    solids, open_shells : int
        Numbers of each in the file.
    gap : float, length
        Tolerance of the file: largest distance of an edge from its faces, or of Bezier faces or
        triangles from the surface.
    turn : float, rad
        Largest angle between the normals of two Bezier faces at their edge.
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
    smooth: int = 0
    triangles: int = 0
    solids: int = 0
    open_shells: int = 0
    gap: float = 0.0
    turn: float = 0.0
    note: str = ""


def save_step(state: AtlasState, path) -> StepReport:
    """Write an atlas as a STEP file, all of it or nothing.

    Where all faces of the body obey laws that STEP has names for, there is one face for each of
    them. Any other closed body without edges is written as Bezier faces. Where neither can be done
    there are triangles.

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
        When the arguments are no Atlas and no path, nothing of the surface is known, or the extra
        ``cad`` is not installed.
    OSError
        When the file cannot be written; an old one is left as it was.
    """
    if not isinstance(state, AtlasState):
        raise ValueError(f"got {type(state).__name__} for the atlas; call save_step(atlas, path)")
    check_path(path)
    need_kernel()
    if state.body is None:
        raise ValueError(_NOTHING)
    body, smooth = state.body, is_smooth(state.body)
    if smooth and not body.faces.are_lawful:
        return _save_smooth(state, body, path)
    try:
        return _save_faces(state, body, path)
    except NotWritten as reason:
        if smooth:
            # A law without a name in STEP is smooth, and a body with holes.
            return _save_smooth(state, body, path)
        return _save_triangles(state, extract_surface(state), path, reason)


def _save_faces(state: AtlasState, body: Body, path) -> StepReport:
    """Write the faces of a lawful body."""
    made = lawful_shapes(body, state.tolerance)
    write_whole(path, step_bytes(made.shapes, made.gap, Path(path).name))
    return StepReport(
        faces=made.kinds.total() + made.fillets,
        planes=made.kinds["plane"],
        cylinders=made.kinds["cylinder"],
        cones=made.kinds["cone"],
        spheres=made.kinds["sphere"],
        fillets=made.fillets,
        solids=len(made.shapes),
        gap=made.gap,
        note=made.note,
    )


def _save_smooth(state: AtlasState, body: Body, path) -> StepReport:
    """Write the Bezier faces of a body without edges."""
    surface = extract_surface(state)
    try:
        made = bezier_shapes(body, surface, _COARSER * state.tolerance)
    except NotWritten as reason:
        return _save_triangles(state, surface, path, reason)
    write_whole(path, step_bytes(made.shapes, made.gap, Path(path).name))
    count = sum(len(one.faces) for one in made.shapes)
    return StepReport(
        faces=count, smooth=count, solids=len(made.shapes), gap=made.gap, turn=made.turn
    )


def _save_triangles(state: AtlasState, surface: Surface, path, reason) -> StepReport:
    """Write the triangles of the surface, for a reason."""
    coarser = _COARSER * state.tolerance
    shapes = triangle_shapes(fewer_triangles(surface, coarser))
    if not shapes:
        raise ValueError(_NOTHING)
    gap = coarser + state.options.facets * state.tolerance
    write_whole(path, step_bytes(shapes, gap, Path(path).name))
    count, solids = sum(len(one.faces) for one in shapes), sum(map(is_solid, shapes))
    return StepReport(
        faces=count,
        triangles=count,
        solids=solids,
        open_shells=len(shapes) - solids,
        gap=gap,
        note=f"written as triangles: {reason}",
    )
