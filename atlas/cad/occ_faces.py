"""Open CASCADE: faces of a lawful body become shells and solids that share edges and vertices."""

import numpy as np
from scipy.interpolate import BSpline

from touchatlas.atlas.cad.brep import Brep, BrepFace, BrepUse
from touchatlas.atlas.cad.edge_shapes import Arc, Line
from touchatlas.atlas.cad.occ_kernel import NamedShape, solid_or_shell

# Difference of the speed of a straight trace from 1 that is none. Doubled, nothing changes.
_UNIT = 1e-9


def face_shapes(brep: Brep, names: dict[int, str]) -> list[NamedShape]:
    """A solid or an open shell of each part of a body; ``names`` are those of the labels."""
    sewing = _Sewing(brep)
    faces = [sewing.face(face) for face in brep.faces]
    return [
        NamedShape(
            solid_or_shell([faces[k] for k in part], closed),
            [faces[k] for k in part],
            [names[brep.faces[k].label] for k in part],
            tuple(sewing.edges),
        )
        for part, closed in zip(brep.parts, brep.closed, strict=True)
    ]


def is_valid(shape) -> bool:
    """Whether the kernel finds nothing wrong with a shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return bool(BRepCheck_Analyzer(shape).IsValid())


def areas(faces) -> np.ndarray:
    """(n,) areas of faces of the kernel, length^2."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    out = []
    for face in faces:
        found = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, found)
        out.append(found.Mass())
    return np.array(out)


class _Sewing:
    """Makes faces that share the kernel's edges and vertices."""

    def __init__(self, brep: Brep) -> None:
        from OCP.BRep import BRep_Builder

        self._build, self._brep = BRep_Builder(), brep
        self._vertices = [
            self._vertex(point, gap) for point, gap in zip(brep.vertices, brep.gaps, strict=True)
        ]
        self.edges = [self._edge(edge) for edge in brep.edges]

    def _vertex(self, point, gap: float):
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        vertex = TopoDS_Vertex()
        self._build.MakeVertex(vertex, gp_Pnt(*point.tolist()), float(gap))
        return vertex

    def _edge(self, edge):
        from OCP.TopoDS import TopoDS_Edge

        out = TopoDS_Edge()
        if edge.curve is None:
            self._build.MakeEdge(out)
            self._build.Degenerated(out, True)
        else:
            self._build.MakeEdge(out, _space_curve(edge.curve), edge.gap)
        self._build.Add(out, self._vertices[edge.start])
        self._build.Add(out, self._vertices[edge.end].Reversed())
        self._build.Range(out, 0.0, 2.0 * np.pi if edge.curve is None else edge.curve.last)
        return out

    def face(self, face: BrepFace):
        """A face of the kernel with its normal outward."""
        from OCP.TopLoc import TopLoc_Location
        from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

        surface, place, out = _surface(face.surface), TopLoc_Location(), TopoDS_Face()
        gap = max(
            (self._brep.edges[use.edge].gap for wire in face.wires for use in wire), default=0.0
        )
        self._build.MakeFace(out, surface, place, gap)
        for uses in face.wires:
            self._add_traces(uses, surface, place)
            wire = TopoDS_Wire()
            self._build.MakeWire(wire)
            for use in uses:
                edge = self.edges[use.edge]
                self._build.Add(wire, edge if use.forward else edge.Reversed())
            wire.Closed(True)
            self._build.Add(out, wire)
        return out if face.surface.outward > 0.0 else out.Reversed()

    def _add_traces(self, uses: tuple[BrepUse, ...], surface, place) -> None:
        """Give edges their traces; a seam has two, the forward one first."""
        traces: dict[int, list[BrepUse]] = {}
        for use in uses:
            traces.setdefault(use.edge, []).append(use)
        for number, both in traces.items():
            curves = [
                _plane_curve(u.trace) for u in sorted(both, key=lambda u: not u.forward) if u.trace
            ]
            if curves:
                gap = self._brep.edges[number].gap
                self._build.UpdateEdge(self.edges[number], *curves, surface, place, gap)


def _surface(surface):
    if surface.kind == "bezier":
        return _bezier_surface(surface.control)
    from OCP.Geom import (
        Geom_ConicalSurface,
        Geom_CylindricalSurface,
        Geom_Plane,
        Geom_SphericalSurface,
    )

    frame = _frame(surface.origin, surface.axes)
    if surface.kind == "plane":
        return Geom_Plane(frame)
    if surface.kind == "cylinder":
        return Geom_CylindricalSurface(frame, surface.radius)
    if surface.kind == "cone":
        return Geom_ConicalSurface(frame, surface.half_angle, surface.radius)
    return Geom_SphericalSurface(frame, surface.radius)


def _bezier_surface(control):
    from OCP.collections import Array2_gp_Pnt
    from OCP.Geom import Geom_BezierSurface
    from OCP.gp import gp_Pnt

    poles = Array2_gp_Pnt(1, len(control), 1, len(control))
    for row, column in np.ndindex(control.shape[:2]):
        poles.SetValue(row + 1, column + 1, gp_Pnt(*control[row, column].tolist()))
    return Geom_BezierSurface(poles)


def _frame(origin, axes):
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

    return gp_Ax3(gp_Pnt(*origin.tolist()), gp_Dir(*axes[2].tolist()), gp_Dir(*axes[0].tolist()))


def _space_curve(curve):
    from OCP.Geom import Geom_Circle, Geom_Line
    from OCP.gp import gp_Dir, gp_Pnt

    if isinstance(curve, Line):
        along = (curve.end - curve.start).tolist()
        return Geom_Line(gp_Pnt(*curve.start.tolist()), gp_Dir(*along))
    if isinstance(curve, Arc):
        return Geom_Circle(_frame(curve.centre, curve.axes).Ax2(), curve.radius)
    return _spline(curve.curve)


def _plane_curve(trace: BSpline):
    from OCP.Geom2d import Geom2d_Line
    from OCP.gp import gp_Dir2d, gp_Pnt2d

    first, last = trace(0.0), trace(trace.t[-1])
    along = last - first
    if trace.k == 1 and abs(np.hypot(*along) / trace.t[-1] - 1.0) < _UNIT:
        return Geom2d_Line(gp_Pnt2d(*first.tolist()), gp_Dir2d(*along.tolist()))
    return _spline(trace)


def _spline(spline: BSpline):
    """The kernel's spline in space or in a plane."""
    from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_gp_Pnt2d, Array1_int
    from OCP.Geom import Geom_BSplineCurve
    from OCP.Geom2d import Geom2d_BSplineCurve
    from OCP.gp import gp_Pnt, gp_Pnt2d

    in_space = spline.c.shape[1] == 3
    array, point, curve = (
        (Array1_gp_Pnt, gp_Pnt, Geom_BSplineCurve)
        if in_space
        else (Array1_gp_Pnt2d, gp_Pnt2d, Geom2d_BSplineCurve)
    )
    knots, counts = np.unique(spline.t, return_counts=True)
    return curve(
        _array(array, [point(*pole) for pole in spline.c.tolist()]),
        _array(Array1_double, knots.tolist()),
        _array(Array1_int, counts.tolist()),
        spline.k,
    )


def _array(kind, values):
    out = kind(1, len(values))
    for index, value in enumerate(values):
        out.SetValue(index + 1, value)
    return out
