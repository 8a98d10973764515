"""Open CASCADE: named shapes become a STEP file.

This CAD kernel comes with the extra ``cad`` and is imported only where it is used.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from touchatlas.atlas.cad.not_written import NotWritten


class NamedShape(NamedTuple):
    """A solid or a shell of the kernel, with its faces and their names."""

    shape: Any
    faces: list[Any]
    names: list[str]


def need_kernel() -> None:
    """Raise ValueError, with the command to run, when the extra ``cad`` is not installed."""
    try:
        import OCP.STEPControl  # noqa: F401
    except ImportError as error:
        raise ValueError(
            f"STEP files need the extra cad ({error}): pip install touchatlas[cad]"
        ) from None


def step_bytes(shapes: list[NamedShape], gap: float, name: str) -> bytes:
    """A STEP file of shapes.

    Parameters
    ----------
    shapes : list of NamedShape
    gap : float, length
        Tolerance of the file: largest distance between its surfaces and curves.
    name : str
        Name in the header and of the product.
    """
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    with _silence():
        writer = STEPControl_Writer()
        writer.SetTolerance(gap)
        process = writer.WS().TransferWriter().FinderProcess()
        for one in shapes:
            _check(writer.Transfer(one.shape, STEPControl_AsIs))
            for face, words in zip(one.faces, one.names, strict=True):
                item = STEPConstruct.FindEntity_s(process, face)
                item.SetName(_ascii(words))
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

    text = _ascii(name)
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(text)
    header.SetTimeStamp(TCollection_HAsciiString(""))
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(text)
            entity.SetName(text)


def _ascii(text: str):
    """Words for a STEP file, which is ASCII."""
    from OCP.TCollection import TCollection_HAsciiString

    plain = text.replace("\N{PLUS-MINUS SIGN}", "+-")
    return TCollection_HAsciiString(plain.encode("ascii", "replace").decode())


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


def is_solid(one: NamedShape) -> bool:
    """Whether a shape closes up."""
    from OCP.TopAbs import TopAbs_SOLID

    return bool(one.shape.ShapeType() == TopAbs_SOLID)


@contextmanager
def refusals() -> Iterator[None]:
    """Let what the kernel refuses be a reason why faces are not written."""
    try:
        yield
    except Exception as error:
        # The kernel's errors have no class in common in Python.
        if not type(error).__module__.startswith("OCP."):
            raise
        raise NotWritten(f"the CAD kernel refuses a face: {error}") from None


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
