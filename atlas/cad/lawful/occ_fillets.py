"""Open CASCADE: edges of a solid are rounded by fillets, each with its radius."""

from typing import Any

from touchatlas.atlas.cad.lawful.fillets import Radius, SolidEdge
from touchatlas.atlas.cad.lawful.occ_cells import LawfulSolid
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_kernel import NamedShape
from touchatlas.atlas.cad.occ_parts import is_valid, listed, parts_of, points_along


def solid_edges(one: LawfulSolid) -> list[SolidEdge]:
    """The edges of a solid."""
    from OCP.TopExp import TopExp

    place_of, vertices = parts_of(one.shape, "Edge"), parts_of(one.shape, "Vertex")
    beside: dict[int, set[int]] = {}
    for face, number in zip(one.faces, one.numbers, strict=True):
        for edge in listed(face, "Edge"):
            beside.setdefault(place_of.FindIndex(edge), set()).add(number)
    out = []
    for place, edge in enumerate(listed(one.shape, "Edge"), start=1):
        ends = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
        first, last = (vertices.FindIndex(vertex) for vertex in ends)
        out.append(SolidEdge(edge, points_along(edge), (first, last), beside[place]))
    return out


def with_fillets(one: NamedShape, edges: list[SolidEdge], radii: dict[int, Radius]) -> NamedShape:
    """A shape with its edges rounded; the faces of fillets come after those that it had.

    Parameters
    ----------
    one : NamedShape
    edges : list of SolidEdge
        Of the shape.
    radii : dict of int and Radius
        Of edges by their places.

    Raises
    ------
    NotWritten
        The kernel does not make these fillets.
    """
    if not radii:
        return one
    rounded = [(edges[place], radius) for place, radius in sorted(radii.items())]
    make = _made(one, rounded)
    shape, *others = listed(make.Shape(), "Solid")
    if others or not is_valid(shape):
        raise NotWritten("the CAD kernel finds the shape with its fillets invalid")
    words = _words(make, one, rounded)
    faces, names = [_left_of(make, face) for face in one.faces], list(one.names)
    for face in listed(shape, "Face"):
        if not any(face.IsSame(other) for other in faces):
            faces.append(face)
            names.append(next((name for new, name in words if face.IsSame(new)), "fillet"))
    return NamedShape(shape, faces, names)


def _made(one: NamedShape, rounded: list[tuple[SolidEdge, Radius]]):
    """The kernel's fillets of edges."""
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet

    make = BRepFilletAPI_MakeFillet(one.shape)
    for edge, radius in rounded:
        make.Add(radius.value, edge.shape)
    make.Build()
    if not make.IsDone() or not all(make.Contour(edge.shape) for edge, _ in rounded):
        raise NotWritten("the CAD kernel does not make the fillets of blunt edges")
    return make


def _left_of(make, face) -> Any:
    """What fillets leave of a face."""
    left = [] if make.IsDeleted(face) else list(make.Modified(face)) or [face]
    if len(left) != 1:
        raise NotWritten(f"fillets leave {len(left)} faces of one")
    return left[0]


def _words(make, one: NamedShape, rounded: list[tuple[SolidEdge, Radius]]) -> list[tuple[Any, str]]:
    """Faces of fillets, and of corners between fillets of one radius, with their names."""
    vertices, found = parts_of(one.shape, "Vertex"), []
    around: dict[int, set[str]] = {}
    for edge, radius in rounded:
        found += [(face, radius.words) for face in make.Generated(edge.shape)]
        for vertex in edge.ends:
            around.setdefault(vertex, set()).add(radius.words)
    for vertex, names in around.items():
        if len(names) == 1:
            found += [(face, *names) for face in make.Generated(vertices.FindKey(vertex))]
    return found
