"""Cells: large faces of all surfaces divide space; the cells inside of a body are its solids."""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from touchatlas.atlas.cad.kernel import NotWritten, coordinates, listed, parts_of
from touchatlas.atlas.cad.rims import Rim, RimPlane, rim_plane
from touchatlas.atlas.cad.surfaces import LawSurface

# Signed distances (n,) of points (n, 3), length, positive outside.
Distances = Callable[[Any], Any]


class LawfulSolid(NamedTuple):
    """A solid of the kernel, its faces, and the number of the surface of each."""

    shape: Any
    faces: list[Any]
    numbers: list[int]


def large_faces(
    surfaces: Mapping[int, LawSurface], rims: list[Rim], samples: Mapping[int, Any], extent: float
) -> list[tuple[int, Any]]:
    """Numbers of surfaces and their faces, which reach beyond a body on all sides but end at smooth
    rims.

    Parameters
    ----------
    surfaces : mapping of int and LawSurface
    rims : list of Rim
        At which they are tangent.
    samples : mapping of int and (n, 3) float, length, world
        Of each surface.
    extent : float, length
        Of the body.
    """
    points = np.concatenate(list(samples.values()))
    # Corners of the body lie beyond its samples, by less than a tenth of the extent.
    middle, half = 0.5 * (points.min(axis=0) + points.max(axis=0)), 0.6 * extent
    out = []
    for number, surface in surfaces.items():
        pairs = [(r.first, r.second) for r in rims if number in (r.first, r.second)]
        planes = [rim_plane(surfaces[a], surfaces[b]) for a, b in pairs]
        tools = [_rim_face(plane, middle, half) for plane in planes if plane is not None]
        face = _large_face(surface, middle, half)
        parts = _parts(face, surface, tools, samples[number], half) if tools else [face]
        out += [(number, part) for part in parts]
    return out


def _large_face(surface: LawSurface, middle, half: float):
    """The face of a surface as far as a distance ``half`` from the middle (3,) of the body."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Cone, gp_Cylinder, gp_Pln, gp_Sphere, gp_Torus

    offset, axis, turn = middle - surface.origin, surface.axes[2], 2.0 * np.pi
    if surface.kind == "plane":
        frame = _frame(middle - (offset @ axis) * axis, surface)
        return BRepBuilderAPI_MakeFace(gp_Pln(frame), -half, half, -half, half).Face()
    if surface.kind == "cylinder":
        frame = _frame(surface.origin + (offset @ axis) * axis, surface)
        cylinder = gp_Cylinder(frame, surface.radius)
        return BRepBuilderAPI_MakeFace(cylinder, 0.0, turn, -half, half).Face()
    frame = _frame(surface.origin, surface)
    if surface.kind == "sphere":
        return BRepBuilderAPI_MakeFace(gp_Sphere(frame, surface.radius)).Face()
    if surface.kind == "torus":
        return BRepBuilderAPI_MakeFace(gp_Torus(frame, surface.ring, surface.radius)).Face()
    if surface.kind != "cone":
        raise ValueError(f"no face is made of a surface of the kind {surface.kind!r}")
    cone, height = gp_Cone(frame, surface.half_angle, surface.radius), offset @ axis
    low, high = (np.array([height - half, height + half]) / np.cos(surface.half_angle)).tolist()
    apex = -surface.radius / np.sin(surface.half_angle)
    return BRepBuilderAPI_MakeFace(cone, 0.0, turn, max(low, apex), high).Face()


def _rim_face(plane: RimPlane, middle, half: float):
    """The face of a rim plane, larger than that of any surface."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Pln

    surface, size = plane.surface, 4.0 * half
    x, y, _ = surface.axes
    offset = middle - surface.origin
    if not plane.is_half:
        frame = gp_Pln(_frame(surface.origin + (offset @ x) * x + (offset @ y) * y, surface))
        return BRepBuilderAPI_MakeFace(frame, -size, size, -size, size).Face()
    frame = gp_Pln(_frame(surface.origin + (offset @ y) * y, surface))
    return BRepBuilderAPI_MakeFace(frame, 0.0, max(offset @ x, 0.0) + size, -size, size).Face()


def _frame(origin, surface: LawSurface):
    """The kernel's frame of the axes of a surface at an origin (3,)."""
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

    z, x = (gp_Dir(*axis.tolist()) for axis in surface.axes[[2, 0]])
    return gp_Ax3(gp_Pnt(*origin.tolist()), z, x)


def _parts(face, surface: LawSurface, rim_faces, points, half: float) -> list[Any]:
    """The parts of a large face between rim planes on which samples (n, 3) of its surface lie."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Splitter
    from OCP.collections import List_TopoDS_Shape

    split, faces, tools = BRepAlgoAPI_Splitter(), List_TopoDS_Shape(), List_TopoDS_Shape()
    faces.Append(face)
    for tool in rim_faces:
        tools.Append(tool)
    split.SetArguments(faces)
    split.SetTools(tools)
    split.Build()
    points = points[:: max(1, len(points) // 300)]
    distance, normal = surface.at(points)
    feet = points - distance[:, None] * normal
    # A part with one of fifty samples or fewer has them by wrong labels near a rim.
    return [part for part in listed(split.Shape(), "Face") if _fraction(part, feet, half) >= 0.02]


def _fraction(face, points, half: float) -> float:
    """Fraction of points (k, 3) of its surface that lie on a face, up to a rounding of extents."""
    from OCP.gp import gp_Pnt
    from OCP.IntTools import IntTools_Context

    context, near = IntTools_Context(), 1e-6 * half
    on = [context.IsValidPointForFace(gp_Pnt(*p), face, near) for p in points.tolist()]
    return sum(on) / len(on)


def solids_inside(
    large: list[tuple[int, Any]], distances: Distances, fuzzy: float, extent: float
) -> list[LawfulSolid]:
    """The solids that large faces bound, without the faces inside of them.

    Parameters
    ----------
    large : list of int and face
        Numbers of surfaces and their faces.
    distances : callable
        Signed distances of points from the surface of the body.
    fuzzy : float, length
        Distance up to which edges and vertices are one.
    extent : float, length
        Of the body.
    """
    maker = _volumes([face for _, face in large], True, fuzzy)
    # Points that are nearer than a billionth of the extent are one.
    cells, least = listed(maker.Shape(), "Solid"), 1e-9 * extent
    inside = [cell for cell in cells if _is_inside(cell, distances, least)]
    if not inside:
        raise NotWritten("the faces enclose nothing")
    pieces = [(n, piece) for n, face in large for piece in list(maker.Modified(face)) or [face]]
    solids = listed(_volumes(_boundary(inside), False, 0.0).Shape(), "Solid")
    return [_united(solid, pieces, fuzzy) for solid in solids]


def _volumes(faces, crossing: bool, fuzzy: float):
    """The kernel's volumes between faces, which may be crossing each other."""
    from OCP.BOPAlgo import BOPAlgo_MakerVolume

    maker = BOPAlgo_MakerVolume()
    for face in faces:
        maker.AddArgument(face)
    maker.SetIntersect(crossing)
    maker.SetAvoidInternalShapes(True)
    maker.SetFuzzyValue(fuzzy)
    maker.Perform()
    if maker.HasErrors():
        raise NotWritten("the CAD kernel does not intersect the faces")
    return maker


def _is_inside(cell, distances: Distances, least: float) -> bool:
    """Whether most of a cell is inside of the body: the middles of chords, weighted by length."""
    chords = [chord for face in listed(cell, "Face") for chord in _chords(cell, face, least)]
    if not chords:
        return False
    middles, lengths = (np.array(column) for column in zip(*chords, strict=True))
    return bool((np.sign(distances(middles)) * lengths).sum() < 0.0)


def _chords(cell, face, least: float) -> list[tuple[np.ndarray, float]]:
    """The middle and length of the chord that is normal to a face of a cell in some point of it."""
    from OCP.BRepIntCurveSurface import BRepIntCurveSurface_Inter

    line = _normal_line(face, least)
    if line is None:
        return []
    found, at = BRepIntCurveSurface_Inter(), []
    found.Init(cell, line, least)
    while found.More():
        at.append(found.W())
        found.Next()
    start, along, out = coordinates(line.Location()), coordinates(line.Direction()), []
    for way in (1.0, -1.0):
        ahead = [way * w for w in at if way * w > least]
        # Where the line leaves the cell as often as it enters, it does not start inside.
        if len(ahead) % 2 == 1:
            out.append((start + 0.5 * way * min(ahead) * along, min(ahead)))
    return out


def _normal_line(face, least: float):
    """The kernel's line that is normal to a face in some point of it, if one is found."""
    from OCP.BOPTools import BOPTools_AlgoTools3D
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepLProp import BRepLProp_SLProps
    from OCP.gp import gp_Lin, gp_Pnt, gp_Pnt2d
    from OCP.IntTools import IntTools_Context

    point, uv = gp_Pnt(), gp_Pnt2d()
    if BOPTools_AlgoTools3D.PointInFace_s(face, point, uv, IntTools_Context()) != 0:
        return None
    at = BRepLProp_SLProps(BRepAdaptor_Surface(face), uv.X(), uv.Y(), 1, least)
    return gp_Lin(point, at.Normal()) if at.IsNormalDefined() else None


def _boundary(cells) -> list[Any]:
    """The faces of cells that are of one of them only."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher

    known = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    count = Counter(known.Add(face) for cell in cells for face in listed(cell, "Face"))
    return [known.FindKey(number) for number, cells_of in count.items() if cells_of == 1]


def _united(solid, pieces, fuzzy: float) -> LawfulSolid:
    """A solid whose faces and edges of one surface or curve are one; ``pieces`` are numbers of
    surfaces and the parts of their large faces."""
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain

    unite = ShapeUpgrade_UnifySameDomain(solid, True, True, False)
    if fuzzy > 0.0:
        unite.SetLinearTolerance(fuzzy)
    unite.Build()
    shape, history = unite.Shape(), unite.History()
    own = parts_of(shape, "Face")
    number_of: dict[int, int] = {}
    for number, piece in pieces:
        for face in list(history.Modified(piece)) or [piece]:
            if own.Contains(face):
                number_of[own.FindIndex(face)] = number
    if len(number_of) != own.Extent():
        raise NotWritten("the CAD kernel makes faces of no surface")
    numbers = [number_of[k + 1] for k in range(own.Extent())]
    return LawfulSolid(shape, listed(shape, "Face"), numbers)


def make_circles(shape, exact: float) -> None:
    """Let ellipses of a shape be circles where both are within ``exact`` (length) of each other.

    A plane cuts a cylinder in an ellipse, whose lesser half axis is the radius; the tolerance of
    the edge becomes the difference of its half axes.
    """
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepLib import BRepLib
    from OCP.Geom import Geom_Circle
    from OCP.GeomAbs import GeomAbs_Ellipse

    for edge in listed(shape, "Edge"):
        curve = None if BRep_Tool.Degenerated_s(edge) else BRepAdaptor_Curve(edge)
        if curve is None or curve.GetType() != GeomAbs_Ellipse:
            continue
        ellipse = curve.Ellipse()
        off = ellipse.MajorRadius() - ellipse.MinorRadius()
        if off <= exact:
            circle = Geom_Circle(ellipse.Position(), ellipse.MinorRadius())
            BRep_Builder().UpdateEdge(edge, circle, off + BRep_Tool.Tolerance_s(edge))
    BRepLib.UpdateTolerances_s(shape, False)
