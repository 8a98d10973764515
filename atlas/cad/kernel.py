"""Open CASCADE: shapes with named faces, their parts, and STEP files of them.

This CAD kernel comes with the extra ``cad`` and is imported only where it is used.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np


class NotWritten(Exception):
    """Faces of a body that cannot be written as such; the message says why."""


class NamedShape(NamedTuple):
    """A solid or a shell of the kernel, with its faces and their names."""

    shape: Any
    faces: list[Any]
    names: list[str]

    @property
    def is_solid(self) -> bool:
        """Whether the shape closes up."""
        from OCP.TopAbs import TopAbs_SOLID

        return bool(self.shape.ShapeType() == TopAbs_SOLID)


def need_kernel() -> None:
    """Raise ValueError, with the command to run, when the extra ``cad`` is not installed."""
    try:
        import OCP.STEPControl  # noqa: F401
    except ImportError as error:
        raise ValueError(
            f"STEP files need the extra cad ({error}): pip install touchatlas[cad], or in a "
            "clone pip install -e '.[cad]'"
        ) from None


@contextmanager
def refusals() -> Iterator[None]:
    """Raise NotWritten where the kernel raises an error of its own."""
    try:
        yield
    except Exception as error:
        # The kernel's errors have no class in common in Python.
        if not type(error).__module__.startswith("OCP."):
            raise
        raise NotWritten(f"the CAD kernel refuses a face: {error}") from None


# Names of units in STEP, and their millimetres.
STEP_UNITS = {
    "um": ("UM", 1e-3),
    "mm": ("MM", 1.0),
    "cm": ("CM", 10.0),
    "m": ("M", 1e3),
    "in": ("INCH", 25.4),
    "ft": ("FT", 304.8),
}


def step_bytes(shapes: list[NamedShape], gap: float, name: str, unit: str = "mm") -> bytes:
    """A STEP file of shapes.

    Parameters
    ----------
    shapes : list of NamedShape
    gap : float, length
        Tolerance of the file: largest distance between its surfaces and curves.
    name : str
        Name in the header and of the product.
    unit : str
        Of the lengths of the shapes; the file holds it, and the same numbers.
    """
    from OCP.Interface import Interface_Static
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    with silence():
        writer = STEPControl_Writer()
        writer.SetTolerance(gap)
        process = writer.WS().TransferWriter().FinderProcess()
        writer.Model().SetLocalLengthUnit(STEP_UNITS[unit][1])
        Interface_Static.SetCVal_s("write.step.unit", STEP_UNITS[unit][0])
        try:
            for one in shapes:
                _check(writer.Transfer(one.shape, STEPControl_AsIs))
                for face, words in zip(one.faces, one.names, strict=True):
                    STEPConstruct.FindEntity_s(process, face).SetName(_ascii(words))
        finally:
            Interface_Static.SetCVal_s("write.step.unit", "MM")
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

    header = APIHeaderSection_MakeHeader(model)
    header.SetName(_ascii(name))
    header.SetTimeStamp(_ascii(""))
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(_ascii(name))
            entity.SetName(_ascii(name))


def _ascii(text: str):
    """Words for a STEP file, which is ASCII."""
    from OCP.TCollection import TCollection_HAsciiString

    plain = text.replace("\N{PLUS-MINUS SIGN}", "+-")
    return TCollection_HAsciiString(plain.encode("ascii", "replace").decode())


@contextmanager
def silence() -> Iterator[None]:
    """Keep the kernel's words off standard output."""
    from OCP.Message import Message

    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    messenger.ChangePrinters().Clear()
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


def solid_or_shell(faces, is_closed: bool):
    """A solid of faces that close up, or an open shell."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeSolid
    from OCP.TopoDS import TopoDS_Shell

    build, shell = BRep_Builder(), TopoDS_Shell()
    build.MakeShell(shell)
    for face in faces:
        build.Add(shell, face)
    shell.Closed(is_closed)
    return BRepBuilderAPI_MakeSolid(shell).Solid() if is_closed else shell


def parts_of(shape, kind: str):
    """The kernel's map of the parts of a shape that are of a kind, such as "Face", each once."""
    from OCP import TopAbs
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
    from OCP.TopExp import TopExp

    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, getattr(TopAbs, f"TopAbs_{kind.upper()}"), found)
    return found


def listed(shape, kind: str) -> list[Any]:
    """The parts of a shape that are of a kind, each once."""
    from OCP.TopoDS import TopoDS

    parts = parts_of(shape, kind)
    return [getattr(TopoDS, kind)(parts.FindKey(n)) for n in range(1, parts.Extent() + 1)]


def coordinates(point) -> np.ndarray:
    """(3,) numbers of a point or a direction of the kernel."""
    return np.array([point.X(), point.Y(), point.Z()])


def points_along(edge) -> np.ndarray:
    """(33, 3) points of an edge from its start to its end, (0, 3) where it has no length."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    if BRep_Tool.Degenerated_s(edge):
        return np.zeros((0, 3))
    curve = BRepAdaptor_Curve(edge)
    # By 32 chords the largest distance of a half circle from a plane is found to 0.1 %.
    at = np.linspace(curve.FirstParameter(), curve.LastParameter(), 33)
    return np.array([coordinates(curve.Value(t)) for t in at.tolist()])


def largest_tolerance(shape) -> float:
    """The largest tolerance of the faces, edges and vertices of a shape, length."""
    from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance

    return float(ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1))


def is_valid(shape) -> bool:
    """Whether the kernel finds nothing wrong with a shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    return bool(BRepCheck_Analyzer(shape).IsValid())


def triangles_of(shapes, sagitta: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and triangles (f, 3) within a distance ``sagitta`` of shapes, length."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    vertices, triangles, count = [], [], 0
    for shape in shapes:
        BRepMesh_IncrementalMesh(shape, sagitta)
        for points, corners in map(_triangles, listed(shape, "Face")):
            vertices.append(points)
            triangles.append(count + corners)
            count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def _triangles(face) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and triangles (f, 3) of a face."""
    from OCP.BRep import BRep_Tool
    from OCP.TopLoc import TopLoc_Location

    found = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    if found is None:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    nodes = range(1, found.NbNodes() + 1)
    triangles = range(1, found.NbTriangles() + 1)
    points = np.array([coordinates(found.Node(n)) for n in nodes])
    return points, np.array([found.Triangle(n).Get() for n in triangles]) - 1
