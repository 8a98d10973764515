"""Open CASCADE: large faces divide space into cells, and those inside of a body are its solids."""

from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from touchatlas.atlas.cad.not_written import NotWritten
from touchatlas.atlas.cad.occ_parts import coordinates, listed, parts_of

# Least distance of points that are two, over the extent. Doubled, thinner cells are outside.
_LEAST = 1e-9

# Signed distances (n,) of points (n, 3), length, positive outside.
Distances = Callable[[Any], Any]


class LawfulSolid(NamedTuple):
    """A solid of the kernel, its faces, and the number of the surface of each."""

    shape: Any
    faces: list[Any]
    numbers: list[int]


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
    inside = [
        cell for cell in listed(maker.Shape(), "Solid") if _is_inside(cell, distances, extent)
    ]
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


def _is_inside(cell, distances: Distances, extent: float) -> bool:
    """Whether most of a cell is inside of the body: of the chords through it from its faces, whose
    middles are asked, by length."""
    chords = [chord for face in listed(cell, "Face") for chord in _chords(cell, face, extent)]
    if not chords:
        return False
    middles, lengths = (np.array(column) for column in zip(*chords, strict=True))
    return bool((np.sign(distances(middles)) * lengths).sum() < 0.0)


def _chords(cell, face, extent: float) -> list[tuple[np.ndarray, float]]:
    """The middle and length of the chord that is normal to a face of a cell in some point of it."""
    from OCP.BRepIntCurveSurface import BRepIntCurveSurface_Inter

    line, least = _normal_line(face, _LEAST * extent), _LEAST * extent
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
    surfaces and faces before."""
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
    return LawfulSolid(
        shape, listed(shape, "Face"), [number_of[k + 1] for k in range(own.Extent())]
    )
