"""Open CASCADE: the surfaces of lawful faces as large faces, which end at smooth rims."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from touchatlas.atlas.cad.lawful.law_surfaces import LawSurface
from touchatlas.atlas.cad.lawful.tangent_rims import Rim, RimPlane, rim_plane
from touchatlas.atlas.cad.occ_parts import listed

# Half the size of a large face, over the extent of the samples: corners of the body lie beyond
# those. Doubled, planes divide more space beside the body, which takes three times as long.
_HALF = 0.6
# Samples that say which parts of a surface beside smooth rims are faces, and the least fraction of
# them on such a part: a label beside a rim may be wrong. Doubled, smaller parts are left out.
_ASKED, _PART = 300, 0.02


class _LargeFaces:
    """Makes faces that reach beyond a body on all sides.

    Parameters
    ----------
    points : (n, 3) float, length, world
        The samples of the body.
    extent : float, length
        Of the body.
    """

    def __init__(self, points, extent: float) -> None:
        self._middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self._half = _HALF * extent

    def face(self, surface: LawSurface):
        """The large face of a surface."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
        from OCP.gp import gp_Cone, gp_Cylinder, gp_Pln, gp_Sphere

        frame, half, turn = self._frame(surface), self._half, 2.0 * np.pi
        if surface.kind == "plane":
            return BRepBuilderAPI_MakeFace(gp_Pln(frame), -half, half, -half, half).Face()
        if surface.kind == "sphere":
            return BRepBuilderAPI_MakeFace(gp_Sphere(frame, surface.radius)).Face()
        if surface.kind == "cylinder":
            cylinder = gp_Cylinder(frame, surface.radius)
            return BRepBuilderAPI_MakeFace(cylinder, 0.0, turn, -half, half).Face()
        cone = gp_Cone(frame, surface.half_angle, surface.radius)
        height = (self._middle - surface.origin) @ surface.axes[2]
        low, high = (np.array([height - half, height + half]) / np.cos(surface.half_angle)).tolist()
        apex = -surface.radius / np.sin(surface.half_angle)
        return BRepBuilderAPI_MakeFace(cone, 0.0, turn, max(low, apex), high).Face()

    def parts(self, surface: LawSurface, planes: list[RimPlane], points) -> list[Any]:
        """The parts of a surface between rim planes on which samples (n, 3) lie."""
        if not planes:
            return [self.face(surface)]
        from OCP.BRepAlgoAPI import BRepAlgoAPI_Splitter
        from OCP.collections import List_TopoDS_Shape

        split, faces, tools = BRepAlgoAPI_Splitter(), List_TopoDS_Shape(), List_TopoDS_Shape()
        faces.Append(self.face(surface))
        for plane in planes:
            tools.Append(self._rim_face(plane))
        split.SetArguments(faces)
        split.SetTools(tools)
        split.Build()
        points = points[:: max(1, len(points) // _ASKED)]
        distance, normal = surface.at(points)
        feet = points - distance[:, None] * normal
        found = listed(split.Shape(), "Face")
        return [face for face in found if _fraction(face, feet, self._half) >= _PART]

    def _rim_face(self, plane: RimPlane):
        """The face of a rim plane, larger than that of any surface."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
        from OCP.gp import gp_Pln

        frame, half = gp_Pln(self._frame(plane.surface, plane.is_half)), 4.0 * self._half
        away = (self._middle - plane.surface.origin) @ plane.surface.axes[0]
        ends = (0.0, max(away, 0.0) + half) if plane.is_half else (-half, half)
        return BRepBuilderAPI_MakeFace(frame, *ends, -half, half).Face()

    def _frame(self, surface: LawSurface, is_half: bool = False):
        """The kernel's frame of a surface, its origin where it is nearest to the body."""
        from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt

        origin, offset = surface.origin, self._middle - surface.origin
        if is_half:
            origin = origin + (offset @ surface.axes[1]) * surface.axes[1]
        elif surface.kind == "plane":
            origin = self._middle - (offset @ surface.axes[2]) * surface.axes[2]
        elif surface.kind == "cylinder":
            origin = origin + (offset @ surface.axes[2]) * surface.axes[2]
        z, x = (gp_Dir(*axis.tolist()) for axis in surface.axes[[2, 0]])
        return gp_Ax3(gp_Pnt(*origin.tolist()), z, x)


def large_faces(
    surfaces: Mapping[int, LawSurface], rims: list[Rim], samples: Mapping[int, Any], extent: float
) -> list[tuple[int, Any]]:
    """Numbers of surfaces and their large faces.

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
    large = _LargeFaces(np.concatenate(list(samples.values())), extent)
    out = []
    for number, surface in surfaces.items():
        pairs = [(r.first, r.second) for r in rims if number in (r.first, r.second)]
        planes = [rim_plane(surfaces[a], surfaces[b]) for a, b in pairs]
        ends = [plane for plane in planes if plane is not None]
        out += [(number, face) for face in large.parts(surface, ends, samples[number])]
    return out


def _fraction(face, points, extent: float) -> float:
    """Fraction of points (k, 3) of its surface that lie on a face, up to a rounding of extents."""
    from OCP.gp import gp_Pnt
    from OCP.IntTools import IntTools_Context

    context, near = IntTools_Context(), 1e-6 * extent
    on = [context.IsValidPointForFace(gp_Pnt(*p), face, near) for p in points.tolist()]
    return sum(on) / len(on)
