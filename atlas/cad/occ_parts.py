"""Open CASCADE: parts of shapes, and numbers of these."""

from typing import Any

import numpy as np

# Points of an edge that are compared with the body. Doubled, the largest distance is found to 0.1 %
# instead of 0.5 %.
_SAMPLED = 33


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
    """(k, 3) points of an edge from its start to its end, none where it has no length."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    if BRep_Tool.Degenerated_s(edge):
        return np.zeros((0, 3))
    curve = BRepAdaptor_Curve(edge)
    at = np.linspace(curve.FirstParameter(), curve.LastParameter(), _SAMPLED)
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
