"""A closed smooth body as shapes of the CAD kernel: Bezier faces that share edges, checked."""

from dataclasses import dataclass
from typing import Any

import igl
import networkx as nx
import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad.bezier import face_normals
from touchatlas.atlas.cad.bezier_fit import NearSurface, bezier_faces, coarse_triangles, three_quads
from touchatlas.atlas.cad.bezier_tree import BezierTree
from touchatlas.atlas.cad.kernel import NamedShape, NotWritten, is_valid, refusals, solid_or_shell
from touchatlas.atlas.records.surface import Surface


@dataclass(frozen=True, eq=False)
class BezierShapes:
    """Shapes of the kernel, one a part.

    Parameters
    ----------
    shapes : list of NamedShape
    gap : float, length
        Largest distance of a face from the surface, at the points of a grid on each.
    turn : float, rad
        Largest angle between the normals of neighbours at an edge.
    """

    shapes: list[NamedShape]
    gap: float
    turn: float


def bezier_shapes(body: Body, surface: Surface, bound: float) -> BezierShapes:
    """Shapes of a body that is one free-form face.

    Parameters
    ----------
    body : Body
    surface : Surface
        Its triangles, mended.
    bound : float, length
        Largest distance of the faces from the surface where it is smooth.

    Raises
    ------
    NotWritten
        The surface is open or torn, or the kernel refuses the faces, in words.
    """
    if not len(surface.faces) or len(igl.boundary_facets(surface.faces)[0]):
        raise NotWritten("the surface is open")
    at = NearSurface(body.field, surface, bound).at
    # A narrow triangle makes folded faces, and more triangles others.
    for least in (32, 64, 128):
        tree, errors = bezier_faces(*three_quads(*coarse_triangles(surface, least)), at, bound)
        if np.isfinite(errors).all():
            break
    worst, words = float(np.max(errors)), body.faces.faces[0].words
    # Where the field jumps faces are farther than the bound; by four of them a surface is torn.
    if worst > 4.0 * bound:
        how = f"misses the surface by {worst:.3g}" if np.isfinite(worst) else "is folded"
        raise NotWritten(f"the surface is rough: a smooth face {how}")
    with refusals():
        shapes = _solids(tree, words)
        if not all(is_valid(one.shape) for one in shapes):
            raise NotWritten("the CAD kernel finds the shape invalid")
    return BezierShapes(shapes, worst, largest_turn(tree))


def largest_turn(tree: BezierTree) -> float:
    """Largest angle between the normals of two faces at nine points of an edge, rad."""
    t, worst = np.linspace(0.0, 1.0, 9)[:, None], 0.0
    normals: dict[int, np.ndarray] = {}
    for uses, control in zip(tree.faces, tree.controls, strict=True):
        for (side, forward), first, last in tree.edges(uses):
            along = t if forward else 1.0 - t
            own = face_normals(control, *(first + along * (last - first)).T)
            other = normals.setdefault(side, own)
            # The chord between unit vectors is exact for small angles, where the cosine is not.
            chord = np.linalg.norm(own - other, axis=1).max()
            worst = max(worst, 2.0 * float(np.arcsin(min(0.5 * chord, 1.0))))
    return worst


def _solids(tree: BezierTree, name: str) -> list[NamedShape]:
    """A solid of each part of a body, all of whose faces have one name."""
    sewing, graph = _Sewing(tree), nx.Graph()
    for number, uses in enumerate(tree.faces):
        graph.add_edges_from(
            (("face", number), ("side", side)) for (side, _), *_ in tree.edges(uses)
        )
    faces = [sewing.face(*face) for face in zip(tree.faces, tree.controls, strict=True)]
    parts = [
        [faces[n] for n in sorted(n for kind, n in part if kind == "face")]
        for part in nx.connected_components(graph)
    ]
    return [NamedShape(solid_or_shell(own, True), own, [name] * len(own)) for own in parts]


class _Sewing:
    """Makes faces that share the kernel's edges and vertices."""

    def __init__(self, tree: BezierTree) -> None:
        from OCP.BRep import BRep_Builder

        # CAD systems compute to some 1e-8 of a body's size.
        gap = 1e-8 * float(np.ptp(np.array(tree.vertices), axis=0).max())
        self._build, self._gap, self._tree = BRep_Builder(), gap, tree
        self._vertices = [self._vertex(point) for point in tree.vertices]
        self._edges: dict[int, Any] = {}

    def _vertex(self, point):
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        vertex = TopoDS_Vertex()
        self._build.MakeVertex(vertex, gp_Pnt(*point.tolist()), self._gap)
        return vertex

    def _edge(self, number: int):
        """The edge of a side."""
        from OCP.TopoDS import TopoDS_Edge

        if number not in self._edges:
            side, out = self._tree.sides[number], TopoDS_Edge()
            self._build.MakeEdge(out, _space_curve(side.control), self._gap)
            self._build.Add(out, self._vertices[side.start])
            self._build.Add(out, self._vertices[side.end].Reversed())
            self._build.Range(out, 0.0, 1.0)
            self._edges[number] = out
        return self._edges[number]

    def face(self, uses, control):
        """The face of sides and control points, with its normal outward."""
        from OCP.TopLoc import TopLoc_Location
        from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

        surface, place = _surface(control), TopLoc_Location()
        out, wire = TopoDS_Face(), TopoDS_Wire()
        self._build.MakeFace(out, surface, place, self._gap)
        self._build.MakeWire(wire)
        for (side, forward), first, last in self._tree.edges(uses):
            edge = self._edge(side)
            trace = _trace(first, last) if forward else _trace(last, first)
            self._build.UpdateEdge(edge, trace, surface, place, self._gap)
            self._build.Add(wire, edge if forward else edge.Reversed())
        wire.Closed(True)
        self._build.Add(out, wire)
        return out


def _surface(control) -> Any:
    """The Bezier face of control points (n + 1, n + 1, 3)."""
    from OCP.collections import Array2_gp_Pnt
    from OCP.Geom import Geom_BezierSurface
    from OCP.gp import gp_Pnt

    poles = Array2_gp_Pnt(1, len(control), 1, len(control))
    for row, column in np.ndindex(control.shape[:2]):
        poles.SetValue(row + 1, column + 1, gp_Pnt(*control[row, column].tolist()))
    return Geom_BezierSurface(poles)


def _space_curve(control) -> Any:
    """The Bezier curve of control points (n + 1, 3)."""
    from OCP.collections import Array1_gp_Pnt
    from OCP.Geom import Geom_BezierCurve
    from OCP.gp import gp_Pnt

    poles = Array1_gp_Pnt(1, len(control))
    for number, point in enumerate(control.tolist(), start=1):
        poles.SetValue(number, gp_Pnt(*point))
    return Geom_BezierCurve(poles)


def _trace(first, last) -> Any:
    """The straight line between parameters (2,) of a surface, at which an edge begins and ends."""
    from OCP.collections import Array1_gp_Pnt2d
    from OCP.Geom2d import Geom2d_BezierCurve
    from OCP.gp import gp_Pnt2d

    poles = Array1_gp_Pnt2d(1, 2)
    poles.SetValue(1, gp_Pnt2d(*first.tolist()))
    poles.SetValue(2, gp_Pnt2d(*last.tolist()))
    return Geom2d_BezierCurve(poles)
