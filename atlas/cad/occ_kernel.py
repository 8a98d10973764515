"""Open CASCADE: Bezier faces become shells and solids, and these become a STEP file.

This CAD kernel comes with the extra ``cad`` and is imported only where it is used.
"""

import io
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from touchatlas.atlas.cad.bezier import curve_poles
from touchatlas.atlas.cad.bezier_face import BezierFace


def need_kernel() -> None:
    """Raise ValueError, with the command to run, when the extra ``cad`` is not installed."""
    try:
        import OCP.STEPControl  # noqa: F401
    except ImportError as error:
        raise ValueError(
            f"STEP files need the extra cad ({error}): pip install touchatlas[cad]"
        ) from None


def step_bytes(parts: list[list[BezierFace]], gap: float, name: str) -> bytes:
    """A STEP file of connected parts: solids where they are closed, else open shells.

    Parameters
    ----------
    parts : list of list of BezierFace
    gap : float, length
        Tolerance of the file: largest distance between its surfaces and curves.
    name : str
        Name in the header and of the product.
    """
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TCollection import TCollection_HAsciiString

    with _silence():
        writer = STEPControl_Writer()
        writer.SetTolerance(gap)
        process = writer.WS().TransferWriter().FinderProcess()
        for part in parts:
            shape, faces = _shape(part)
            _check(writer.Transfer(shape, STEPControl_AsIs))
            for face, bezier in zip(faces, part, strict=True):
                item = STEPConstruct.FindEntity_s(process, face)
                item.SetName(TCollection_HAsciiString(f"patch {bezier.face.patch.id}"))
        _name(writer.Model(), name)
        stream = io.BytesIO()
        _check(writer.WriteStream(stream))
    return stream.getvalue()


def _check(status) -> None:
    """Raise RuntimeError unless the kernel reports that it is done."""
    from OCP.IFSelect import IFSelect_RetDone

    if status != IFSelect_RetDone:
        raise RuntimeError(f"the CAD kernel could not write the faces: {status}")


def _name(model, name: str) -> None:
    """Name a STEP file and its products, without the date and the number that the kernel adds."""
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.StepBasic import StepBasic_Product
    from OCP.TCollection import TCollection_HAsciiString

    # A STEP file is ASCII.
    text = TCollection_HAsciiString(name.encode("ascii", "replace").decode())
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(text)
    header.SetTimeStamp(TCollection_HAsciiString(""))
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(text)
            entity.SetName(text)


def is_closed(part: list[BezierFace]) -> bool:
    """Whether every side is of two faces."""
    counts = Counter(side.number for bezier in part for side in bezier.face.sides)
    return set(counts.values()) == {2}


@contextmanager
def _silence() -> Iterator[None]:
    """Keep the kernel's statistics off standard output."""
    from OCP.Message import Message

    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    messenger.ChangePrinters().Clear()
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


def _shape(part: list[BezierFace]):
    """A solid or an open shell of connected faces, and the kernel's face of each."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    build, shell = BRep_Builder(), TopoDS_Shell()
    build.MakeShell(shell)
    sewing = _Sewing(build, part)
    faces = [sewing.face(bezier) for bezier in part]
    for face in faces:
        build.Add(shell, face)
    if not is_closed(part):
        return shell, faces
    shell.Closed(True)
    solid = TopoDS_Solid()
    build.MakeSolid(solid)
    build.Add(solid, shell)
    return solid, faces


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
