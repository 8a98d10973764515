"""STEP export for CAD systems: the faces of a lawful body, Bezier faces of a smooth one, or
triangles.

Where all faces obey laws each becomes one face of the file: a plane, cylinder, cone, sphere or
torus by its name in STEP, trimmed by curves that two faces share, with a fillet along each blunt
edge. Any other closed body without edges becomes Bezier faces that share their edges. Triangles are
the rest. Of both there are as few as the tolerance allows. Faces that close up become a solid.
"""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import igl
import networkx as nx
import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.bezier_shapes import bezier_shapes
from touchatlas.atlas.cad.kernel import (
    STEP_UNITS,
    NamedShape,
    NotWritten,
    need_kernel,
    solid_or_shell,
    step_bytes,
)
from touchatlas.atlas.cad.lawful import LawfulOptions, lawful_shapes
from touchatlas.atlas.files import check_path, write_whole
from touchatlas.atlas.mesh.surface import extract_surface
from touchatlas.atlas.records.surface import Surface
from touchatlas.atlas.state import AtlasState

_NOTHING = "nothing of the surface is known yet; touch it more"


@dataclass(frozen=True)
class StepReport:
    """The contents of a STEP file and their accuracy.

    Parameters
    ----------
    faces : int
        Number of faces in the file: the sum of the next eight.
    planes, cylinders, cones, spheres, tori : int
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
    tori: int = 0
    fillets: int = 0
    smooth: int = 0
    triangles: int = 0
    solids: int = 0
    open_shells: int = 0
    gap: float = 0.0
    turn: float = 0.0
    note: str = ""


def save_step(
    state: AtlasState,
    path,
    lawful: LawfulOptions = LawfulOptions(),
    coarse: float = 0.5,
    unit: str = "mm",
) -> StepReport:
    """Write an atlas as a STEP file, all of it or nothing.

    Where all faces of the body obey laws that STEP has names for, there is one face for each of
    them. Any other closed body without edges is written as Bezier faces. Where neither can be done
    there are triangles.

    Parameters
    ----------
    state : AtlasState
    path : path
        The file. Equal atlases give equal bytes: the header has no date.
    lawful : LawfulOptions
        How far the solid of a lawful body may be from it.
    coarse : float, tolerances
        Largest distance of Bezier faces from the surface, or of the triangles of the file from
        those of the surface.
    unit : str
        Of the lengths of the atlas, which the file names: mm, m, in, cm, um or ft.

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
    if unit not in STEP_UNITS:
        raise ValueError(f"STEP has no unit {unit!r}; give one of {', '.join(STEP_UNITS)}")
    need_kernel()
    state = state.without_tip
    if state.body is None:
        raise ValueError(_NOTHING)
    body, bound = state.body, coarse * state.tolerance
    if body.is_one_face and not body.faces.are_lawful:
        return _save_smooth(state, body, path, bound, unit)
    try:
        return _save_faces(body, path, state.tolerance, lawful, unit)
    except NotWritten as reason:
        if body.is_one_face:
            # A law without a name in STEP is smooth, and a body with holes.
            return _save_smooth(state, body, path, bound, unit)
        return _save_triangles(state, extract_surface(state), path, bound, reason, unit)


def _save_faces(
    body: Body, path, tolerance: float, options: LawfulOptions, unit: str
) -> StepReport:
    """Write the faces of a lawful body."""
    made = lawful_shapes(body, tolerance, options)
    write_whole(path, step_bytes(made.shapes, made.gap, Path(path).name, unit))
    return StepReport(
        faces=made.kinds.total() + made.fillets,
        planes=made.kinds["plane"],
        cylinders=made.kinds["cylinder"],
        cones=made.kinds["cone"],
        spheres=made.kinds["sphere"],
        tori=made.kinds["torus"],
        fillets=made.fillets,
        solids=len(made.shapes),
        gap=made.gap,
        note=made.note,
    )


def _save_smooth(state: AtlasState, body: Body, path, bound: float, unit: str) -> StepReport:
    """Write the Bezier faces of a body without edges."""
    surface = extract_surface(state)
    try:
        made = bezier_shapes(body, surface, bound)
    except NotWritten as reason:
        return _save_triangles(state, surface, path, bound, reason, unit)
    write_whole(path, step_bytes(made.shapes, made.gap, Path(path).name, unit))
    count = sum(len(one.faces) for one in made.shapes)
    return StepReport(
        faces=count, smooth=count, solids=len(made.shapes), gap=made.gap, turn=made.turn
    )


def _save_triangles(state, surface: Surface, path, bound: float, reason, unit) -> StepReport:
    """Write the triangles of the surface, for a reason."""
    shapes = triangle_shapes(fewer_triangles(surface, bound))
    if not shapes:
        raise ValueError(_NOTHING)
    gap = bound + state.options.facets * state.tolerance
    write_whole(path, step_bytes(shapes, gap, Path(path).name, unit))
    count, solids = sum(len(one.faces) for one in shapes), sum(one.is_solid for one in shapes)
    return StepReport(
        faces=count,
        triangles=count,
        solids=solids,
        open_shells=len(shapes) - solids,
        gap=gap,
        note=f"written as triangles: {reason}",
    )


def fewer_triangles(surface: Surface, bound: float) -> Surface:
    """The surface with fewer triangles: three tenths are removed as long as a bound holds.

    Edges are collapsed in the order of quadric errors (Garland and Heckbert, Surface
    Simplification Using Quadric Error Metrics, 1997). Each result is compared with the surface.

    Parameters
    ----------
    surface : Surface
    bound : float, length
        Largest distance of the vertices of either from the triangles of the other.
    """
    best, fewer = surface, _collapsed(surface, 7 * len(surface.faces) // 10)
    while fewer is not None and max(_farthest(surface, fewer), _farthest(fewer, surface)) <= bound:
        best, fewer = fewer, _collapsed(surface, 7 * len(fewer.faces) // 10)
    return best


def _collapsed(surface: Surface, count: int) -> Surface | None:
    """The surface with about ``count`` triangles; None where there are more, or some turn over."""
    # Four triangles are the fewest of a closed surface.
    if count < 4:
        return None
    vertices, faces, triangle, vertex = igl.qslim(surface.vertices, surface.faces, count, True)
    if not 0 < len(faces) <= count + 1:
        return None
    old = igl.per_face_normals(surface.vertices, surface.faces[triangle], np.zeros(3))
    new = igl.per_face_normals(vertices, faces, np.zeros(3))
    if (np.einsum("ij,ij->i", old, new) <= 0.0).any():
        return None
    return replace(surface.taken(vertex, faces), vertices=vertices)


def _farthest(one: Surface, other: Surface) -> float:
    """Largest distance of the vertices and middles of triangles of one surface from another."""
    points = np.concatenate([one.vertices, one.vertices[one.faces].mean(axis=1)])
    squares = igl.point_mesh_squared_distance(points, other.vertices, other.faces)[0]
    return float(np.sqrt(squares.max()))


def triangle_shapes(surface: Surface) -> list[NamedShape]:
    """A solid of the triangles of each part of a surface, or an open shell where an edge has one
    triangle only."""
    graph = nx.Graph()
    graph.add_edges_from(surface.faces[:, [0, 1]].tolist() + surface.faces[:, [1, 2]].tolist())
    parts = [sorted(vertices) for vertices in nx.connected_components(graph)]
    return [_shape(surface, np.isin(surface.faces[:, 0], part)) for part in parts]


def _shape(surface: Surface, triangles) -> NamedShape:
    """The shape of the triangles of a mask (f,)."""
    sewing = _Sewing(surface.vertices)
    corners = surface.faces[triangles].tolist()
    faces = [sewing.face(*three) for three in corners]
    sides = Counter(frozenset(two) for a, b, c in corners for two in ((a, b), (b, c), (c, a)))
    names = [f"face {number}" for number in surface.patch[surface.faces[triangles, 0]].tolist()]
    return NamedShape(solid_or_shell(faces, set(sides.values()) == {2}), faces, names)


class _Sewing:
    """Makes plane faces that share the kernel's edges and vertices."""

    def __init__(self, points) -> None:
        from OCP.BRep import BRep_Builder
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
        from OCP.gp import gp_Pnt

        self._vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex() for p in points.tolist()]
        self._build = BRep_Builder()
        self._edges: dict[tuple[int, int], Any] = {}

    def face(self, a: int, b: int, c: int):
        """The plane face of three vertices, counter-clockwise as seen from outside."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
        from OCP.TopoDS import TopoDS_Wire

        wire = TopoDS_Wire()
        self._build.MakeWire(wire)
        for first, last in ((a, b), (b, c), (c, a)):
            self._build.Add(wire, self._edge(first, last))
        wire.Closed(True)
        return BRepBuilderAPI_MakeFace(wire, True).Face()

    def _edge(self, first: int, last: int):
        """The straight edge from one vertex to another."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

        low, high = min(first, last), max(first, last)
        if (low, high) not in self._edges:
            ends = self._vertices[low], self._vertices[high]
            self._edges[low, high] = BRepBuilderAPI_MakeEdge(*ends).Edge()
        edge = self._edges[low, high]
        return edge if first == low else edge.Reversed()
