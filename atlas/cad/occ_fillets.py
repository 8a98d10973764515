"""Open CASCADE: edges of a solid or a shell are rounded by fillets, each with its radius."""

from typing import Any

from touchatlas.atlas.cad.fillets import Radius, SolidEdge
from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_cells import LawfulSolid
from touchatlas.atlas.cad.occ_kernel import NamedShape
from touchatlas.atlas.cad.occ_parts import (
    edges_of,
    faces_of,
    is_valid,
    parts_of,
    points_along,
    solids_of,
)


def solid_edges(one: LawfulSolid) -> list[SolidEdge]:
    """The edges of a solid."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_VERTEX
    from OCP.TopExp import TopExp

    place_of, vertices = parts_of(one.shape, TopAbs_EDGE), parts_of(one.shape, TopAbs_VERTEX)
    beside: dict[int, set[int]] = {}
    for face, number in zip(one.faces, one.numbers, strict=True):
        for edge in edges_of(face):
            beside.setdefault(place_of.FindIndex(edge), set()).add(number)
    out = []
    for place, edge in enumerate(edges_of(one.shape), start=1):
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
    rounded = [(edges[place].shape, radius) for place, radius in sorted(radii.items())]
    make = _made(one, rounded)
    shape, *others = solids_of(make.Shape())
    if others or not is_valid(shape):
        raise NotWritten("the CAD kernel finds the shape with its fillets invalid")
    words = _words(make, rounded)
    faces, names = [_left_of(make, face) for face in one.faces], list(one.names)
    for face in faces_of(shape):
        if not any(face.IsSame(other) for other in faces):
            faces.append(face)
            names.append(next((name for new, name in words if face.IsSame(new)), "fillet"))
    return NamedShape(shape, faces, names)


def _made(one: NamedShape, rounded: list[tuple[Any, Radius]]):
    """The kernel's fillets of edges."""
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet

    make = BRepFilletAPI_MakeFillet(one.shape)
    for edge, radius in rounded:
        make.Add(radius.value, edge)
    make.Build()
    if not make.IsDone() or not all(make.Contour(edge) for edge, _ in rounded):
        raise NotWritten("the CAD kernel does not make the fillets of blunt edges")
    return make


def _left_of(make, face) -> Any:
    """What fillets leave of a face."""
    left = [] if make.IsDeleted(face) else list(make.Modified(face)) or [face]
    if len(left) != 1:
        raise NotWritten(f"fillets leave {len(left)} faces of one")
    return left[0]


def _words(make, rounded: list[tuple[Any, Radius]]) -> list[tuple[Any, str]]:
    """Faces of fillets, and of corners between fillets of one radius, with their names."""
    from OCP.TopExp import TopExp

    found: list[tuple[Any, str]] = []
    around: list[tuple[Any, set[str]]] = []
    for edge, radius in rounded:
        found += [(face, radius.words) for face in make.Generated(edge)]
        for vertex in (TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)):
            names = next((names for other, names in around if other.IsSame(vertex)), None)
            if names is None:
                around.append((vertex, names := set()))
            names.add(radius.words)
    for vertex, names in around:
        if len(names) == 1:
            found += [(face, *names) for face in make.Generated(vertex)]
    return found
