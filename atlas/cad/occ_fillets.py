"""Open CASCADE: edges of a solid or a shell are rounded by fillets, each with its radius."""

from typing import Any

import numpy as np

from touchatlas.atlas.cad.face_layout import NotWritten
from touchatlas.atlas.cad.fillets import Radius
from touchatlas.atlas.cad.occ_faces import is_valid
from touchatlas.atlas.cad.occ_kernel import NamedShape

# Points of an edge of a fillet that are compared with the body. Doubled, the largest distance is
# found to 0.1 % instead of 0.5 %.
_SAMPLED = 33


def with_fillets(one: NamedShape, radii: dict[int, Radius]) -> NamedShape:
    """A shape with its edges rounded; the faces of fillets come after those that it had.

    Parameters
    ----------
    one : NamedShape
        With its ``edges``.
    radii : dict of int and Radius
        Of edges by their numbers; those that are not of this shape are passed over.

    Raises
    ------
    NotWritten
        The kernel does not make these fillets.
    """
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE

    own = _parts(one.shape, TopAbs_EDGE)
    radii = {n: r for n, r in sorted(radii.items()) if own.Contains(one.edges[n])}
    if not radii:
        return one
    make = _made(one, radii)
    shape = _only(make.Shape(), one.shape.ShapeType())
    if not is_valid(shape):
        raise NotWritten("the CAD kernel finds the shape with its fillets invalid")
    words = _words(make, one, radii)
    faces, names = [_left_of(make, face) for face in one.faces], list(one.names)
    for face in _listed(_parts(shape, TopAbs_FACE)):
        if not any(face.IsSame(other) for other in faces):
            faces.append(face)
            names.append(next((name for new, name in words if face.IsSame(new)), "fillet"))
    return NamedShape(shape, faces, names)


def _made(one: NamedShape, radii: dict[int, Radius]):
    """The kernel's fillets of edges."""
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet

    make = BRepFilletAPI_MakeFillet(one.shape)
    for number, radius in radii.items():
        make.Add(radius.value, one.edges[number])
    make.Build()
    if not make.IsDone() or not all(make.Contour(one.edges[number]) for number in radii):
        raise NotWritten("the CAD kernel does not make the fillets of blunt edges")
    return make


def _left_of(make, face) -> Any:
    """What fillets leave of a face."""
    left = [] if make.IsDeleted(face) else list(make.Modified(face)) or [face]
    if len(left) != 1:
        raise NotWritten(f"fillets leave {len(left)} faces of one")
    return left[0]


def _words(make, one: NamedShape, radii: dict[int, Radius]) -> list[tuple[Any, str]]:
    """Faces of fillets, and of corners between fillets of one radius, with their names."""
    from OCP.TopExp import TopExp

    found: list[tuple[Any, str]] = []
    around: list[tuple[Any, set[str]]] = []
    for number, radius in radii.items():
        edge = one.edges[number]
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


def edge_points(face) -> np.ndarray:
    """(k, 3) points of all edges of a face of the kernel."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopoDS import TopoDS

    out = [np.zeros((0, 3))]
    for edge in map(TopoDS.Edge, _listed(_parts(face, TopAbs_EDGE))):
        if not BRep_Tool.Degenerated_s(edge):
            curve = BRepAdaptor_Curve(edge)
            at = np.linspace(curve.FirstParameter(), curve.LastParameter(), _SAMPLED)
            points = [curve.Value(t) for t in at.tolist()]
            out.append(np.array([[p.X(), p.Y(), p.Z()] for p in points]))
    return np.concatenate(out)


def largest_tolerance(shape) -> float:
    """The largest tolerance of the faces, edges and vertices of a shape, length."""
    from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance

    return float(ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1))


def _parts(shape, kind):
    """The kernel's map of the parts of a shape that are of a kind, such as faces, each once."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
    from OCP.TopExp import TopExp

    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, found)
    return found


def _listed(parts) -> list[Any]:
    return [parts.FindKey(number) for number in range(1, parts.Extent() + 1)]


def _only(shape, kind):
    """The one solid or shell of a compound."""
    found = _listed(_parts(shape, kind))
    if len(found) != 1:
        raise NotWritten(f"{len(found)} shapes are left with fillets")
    return found[0]
