"""Open CASCADE: trimmed Bezier faces become shells and solids that share edges and vertices."""

from collections import Counter

import numpy as np

from touchatlas.atlas.cad.bezier import curve_poles
from touchatlas.atlas.cad.bezier_face import BezierFace
from touchatlas.atlas.cad.occ_kernel import NamedShape, solid_or_shell


def is_closed(part: list[BezierFace]) -> bool:
    """Whether every side is of two faces."""
    counts = Counter(side.number for bezier in part for side in bezier.face.sides)
    return set(counts.values()) == {2}


def patch_shape(part: list[BezierFace]) -> NamedShape:
    """A solid of connected faces, or an open shell where some side is of one face only."""
    from OCP.BRep import BRep_Builder

    sewing = _Sewing(BRep_Builder(), part)
    faces = [sewing.face(bezier) for bezier in part]
    names = [f"patch {bezier.face.patch.id}" for bezier in part]
    return NamedShape(solid_or_shell(faces, is_closed(part)), faces, names)


class _Sewing:
    """Makes faces that share the kernel's edges and vertices."""

    def __init__(self, build, part: list[BezierFace]) -> None:
        self._build = build
        self._gap_of: dict = {}
        for bezier in part:
            for side, gap in zip(bezier.face.sides, bezier.gaps, strict=True):
                for key in (side.number, side.points[0].tobytes(), side.points[-1].tobytes()):
                    self._gap_of[key] = max(self._gap_of.get(key, 0.0), float(gap))
        self._vertices: dict = {}
        self._edges: dict = {}

    def face(self, bezier: BezierFace):
        """The trimmed surface as a face of the kernel, with its normal outward."""
        from OCP.collections import Array2_gp_Pnt
        from OCP.Geom import Geom_BezierSurface
        from OCP.gp import gp_Pnt
        from OCP.TopLoc import TopLoc_Location
        from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

        poles = bezier.poles
        table = Array2_gp_Pnt(1, len(poles), 1, len(poles))
        for a, b in np.ndindex(*poles.shape[:2]):
            table.SetValue(a + 1, b + 1, gp_Pnt(*poles[a, b].tolist()))
        surface, place = Geom_BezierSurface(table), TopLoc_Location()
        face, wire = TopoDS_Face(), TopoDS_Wire()
        self._build.MakeFace(face, surface, place, float(bezier.gaps.max()))
        self._build.MakeWire(wire)
        for side, trace in zip(bezier.face.sides, bezier.traces, strict=True):
            edge, forward = self._edge(side)
            curve = _plane_curve(trace if forward else trace[::-1])
            self._build.UpdateEdge(edge, curve, surface, place, self._gap_of[side.number])
            self._build.Add(wire, edge if forward else edge.Reversed())
        wire.Closed(True)
        self._build.Add(face, wire)
        return face

    def _edge(self, side):
        """The edge of a side, and whether both have the same direction."""
        from OCP.TopoDS import TopoDS_Edge

        if side.number in self._edges:
            return self._edges[side.number], False
        edge, curve = TopoDS_Edge(), _space_curve(curve_poles(side.points))
        self._build.MakeEdge(edge, curve, self._gap_of[side.number])
        self._build.Add(edge, self._vertex(side.points[0]))
        self._build.Add(edge, self._vertex(side.points[-1]).Reversed())
        self._build.Range(edge, 0.0, 1.0)
        self._edges[side.number] = edge
        return edge, True

    def _vertex(self, point):
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        key = point.tobytes()
        if key not in self._vertices:
            vertex = TopoDS_Vertex()
            self._build.MakeVertex(vertex, gp_Pnt(*point.tolist()), self._gap_of[key])
            self._vertices[key] = vertex
        return self._vertices[key]


def _space_curve(poles):
    from OCP.collections import Array1_gp_Pnt
    from OCP.Geom import Geom_BezierCurve
    from OCP.gp import gp_Pnt

    table = Array1_gp_Pnt(1, len(poles))
    for index, pole in enumerate(poles.tolist()):
        table.SetValue(index + 1, gp_Pnt(*pole))
    return Geom_BezierCurve(table)


def _plane_curve(poles):
    from OCP.collections import Array1_gp_Pnt2d
    from OCP.Geom2d import Geom2d_BezierCurve
    from OCP.gp import gp_Pnt2d

    table = Array1_gp_Pnt2d(1, len(poles))
    for index, pole in enumerate(poles.tolist()):
        table.SetValue(index + 1, gp_Pnt2d(*pole))
    return Geom2d_BezierCurve(table)
