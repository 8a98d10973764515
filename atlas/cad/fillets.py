"""Fillets: which edges of a solid are rounded, and with which radii, from the blunt edges of faces.

Where three blunt edges meet the kernel makes the corner a sphere only for equal radii. Edges that
differ there by no more than they are uncertain have their mean, weighted by their variances.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.cad.cells import LawfulSolid
from touchatlas.atlas.cad.kernel import (
    NamedShape,
    NotWritten,
    is_valid,
    listed,
    parts_of,
    points_along,
)
from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.pieces.laws import with_deviation


class Radius(NamedTuple):
    """A radius and its standard deviation, length."""

    value: float
    deviation: float

    @property
    def words(self) -> str:
        """What a face of a fillet is called."""
        return f"fillet, radius {with_deviation(self.value, self.deviation)}"


class SolidEdge(NamedTuple):
    """An edge of a solid: the kernel's, points (k, 3) from its start to its end, none where it has
    no length, its two vertices, and the numbers of the surfaces of its faces."""

    shape: Any
    points: np.ndarray
    ends: tuple[int, int]
    numbers: set[int]


def fillet_radii(faces: Faces, same, edges: list[SolidEdge], sure: float) -> dict[int, Radius]:
    """Radius of each edge of a solid that is blunt, by its place.

    Parameters
    ----------
    faces : Faces
        The faces of the body.
    same : (f,) int
        The face whose surface each face has, by which those of the solid are numbered.
    edges : list of SolidEdge
    sure : float
        Difference of a radius from the mean of radii that are one, in its standard deviations.
    """
    own = blunt_edges(faces, same, edges)
    group = {edge: {edge} for edge in own.values()}
    at_vertex: dict[int, set[int]] = {}
    for number, edge in own.items():
        for vertex in edges[number].ends:
            at_vertex.setdefault(vertex, set()).add(edge)
    for corner in at_vertex.values():
        joined = set().union(*(group[edge] for edge in corner))
        if len(corner) >= 3 and _is_one_radius([faces.edges[edge] for edge in joined], sure):
            group.update(dict.fromkeys(joined, joined))
    mean = {edge: _mean([faces.edges[e] for e in sorted(group[edge])]) for edge in group}
    return {number: mean[edge] for number, edge in own.items()}


def blunt_edges(faces: Faces, same, edges: list[SolidEdge]) -> dict[int, int]:
    """Place in ``faces.edges`` of the blunt edge that each edge of a solid is part of."""
    between: dict[frozenset[int], list[int]] = {}
    for place, edge in enumerate(faces.edges):
        pair = frozenset(same[[edge.first, edge.second]].tolist())
        between.setdefault(pair, []).append(place)
    out = {}
    for number, (_, points, _, numbers) in enumerate(edges):
        found = between.get(frozenset(numbers), []) if len(numbers) == 2 else []
        if not len(points) or not any(faces.edges[place].radius > 0.0 for place in found):
            continue
        nearest = min(found, key=lambda place: _distance(faces.edges[place], points))
        if faces.edges[nearest].radius > 0.0:
            out[number] = nearest
    return out


def _distance(edge: FaceEdge, points) -> float:
    """Median distance of the points of an edge of faces from points (k, 3)."""
    if not edge.curves:
        return float("inf")
    return float(np.median(cKDTree(points).query(np.concatenate(edge.curves))[0]))


def _mean(edges: list[FaceEdge]) -> Radius:
    """Mean radius of edges, by their variances."""
    radii, std = np.array([(edge.radius, edge.radius_std) for edge in edges]).T
    weights = np.maximum(std, np.finfo(float).eps * radii) ** -2.0
    return Radius(float(np.average(radii, weights=weights)), float(weights.sum() ** -0.5))


def _is_one_radius(edges: list[FaceEdge], sure: float) -> bool:
    """Whether no radius differs from the mean of all by more than ``sure`` standard deviations."""
    mean = _mean(edges).value
    return all(abs(edge.radius - mean) <= sure * edge.radius_std for edge in edges)


def solid_edges(one: LawfulSolid) -> list[SolidEdge]:
    """The edges of a solid."""
    from OCP.TopExp import TopExp

    place_of, vertices = parts_of(one.shape, "Edge"), parts_of(one.shape, "Vertex")
    numbers: dict[int, set[int]] = {}
    for face, number in zip(one.faces, one.numbers, strict=True):
        for edge in listed(face, "Edge"):
            numbers.setdefault(place_of.FindIndex(edge), set()).add(number)
    out = []
    for place, edge in enumerate(listed(one.shape, "Edge"), start=1):
        ends = TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge)
        first, last = (vertices.FindIndex(vertex) for vertex in ends)
        out.append(SolidEdge(edge, points_along(edge), (first, last), numbers[place]))
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
