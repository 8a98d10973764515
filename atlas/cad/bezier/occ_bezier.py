"""Open CASCADE: Bezier faces become solids that share edges and vertices."""

from typing import Any

import numpy as np

from touchatlas.atlas.cad.bezier.bezier_brep import BezierBrep, BezierFace
from touchatlas.atlas.cad.occ_kernel import NamedShape, solid_or_shell


def bezier_solids(brep: BezierBrep, name: str) -> list[NamedShape]:
    """A solid of each part of a body, all of whose faces have one name."""
    sewing = _Sewing(brep)
    faces = [sewing.face(face) for face in brep.faces]
    parts = [[faces[k] for k in part] for part in brep.parts]
    return [NamedShape(solid_or_shell(own, True), own, [name] * len(own)) for own in parts]


class _Sewing:
    """Makes faces that share the kernel's edges and vertices."""

    def __init__(self, brep: BezierBrep) -> None:
        from OCP.BRep import BRep_Builder

        self._build, self._gap = BRep_Builder(), brep.gap
        self._vertices = [self._vertex(point) for point in brep.vertices]
        self._edges = [self._edge(edge) for edge in brep.edges]

    def _vertex(self, point):
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        vertex = TopoDS_Vertex()
        self._build.MakeVertex(vertex, gp_Pnt(*point.tolist()), self._gap)
        return vertex

    def _edge(self, edge):
        from OCP.TopoDS import TopoDS_Edge

        out = TopoDS_Edge()
        self._build.MakeEdge(out, _space_curve(edge.control), self._gap)
        self._build.Add(out, self._vertices[edge.start])
        self._build.Add(out, self._vertices[edge.end].Reversed())
        self._build.Range(out, 0.0, 1.0)
        return out

    def face(self, face: BezierFace):
        """A face of the kernel with its normal outward."""
        from OCP.TopLoc import TopLoc_Location
        from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

        surface, place = _surface(face.control), TopLoc_Location()
        out, wire = TopoDS_Face(), TopoDS_Wire()
        self._build.MakeFace(out, surface, place, self._gap)
        self._build.MakeWire(wire)
        for use in face.uses:
            edge = self._edges[use.edge]
            trace = _trace(use.first, use.last)
            self._build.UpdateEdge(edge, trace, surface, place, self._gap)
            self._build.Add(wire, edge if use.forward else edge.Reversed())
        wire.Closed(True)
        self._build.Add(out, wire)
        return out


def _surface(control) -> Any:
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
