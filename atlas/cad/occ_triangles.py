"""Open CASCADE: triangles become plane faces that share edges and vertices."""

from collections import Counter
from typing import Any

import networkx as nx
import numpy as np

from touchatlas.atlas.cad.occ_kernel import NamedShape, solid_or_shell
from touchatlas.atlas.records.surface import Surface


def triangle_shapes(surface: Surface) -> list[NamedShape]:
    """A solid of the triangles of each part of a surface, or an open shell where a side is of one
    triangle only."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(surface.vertices)))
    graph.add_edges_from(surface.faces[:, [0, 1]].tolist() + surface.faces[:, [1, 2]].tolist())
    parts = [vertices for vertices in nx.connected_components(graph) if len(vertices) > 2]
    inside = [np.isin(surface.faces[:, 0], sorted(vertices)) for vertices in parts]
    return [_shape(surface, np.flatnonzero(mine)) for mine in inside]


def _shape(surface: Surface, triangles) -> NamedShape:
    """The shape of some triangles (k,)."""
    sewing = _Sewing(surface.vertices)
    corners = surface.faces[triangles].tolist()
    faces = [sewing.face(*three) for three in corners]
    sides = Counter(frozenset(two) for a, b, c in corners for two in ((a, b), (b, c), (c, a)))
    names = [f"face {number}" for number in surface.patch[surface.faces[triangles, 0]].tolist()]
    return NamedShape(solid_or_shell(faces, set(sides.values()) == {2}), faces, names)


class _Sewing:
    """Makes plane faces that share the kernel's edges and vertices."""

    def __init__(self, points) -> None:
        from OCP.BRep import BRep_Builder
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
        from OCP.gp import gp_Pnt

        self._vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*p)).Vertex() for p in points.tolist()]
        self._build = BRep_Builder()
        self._edges: dict[tuple[int, int], Any] = {}

    def face(self, a: int, b: int, c: int):
        """The plane face of three vertices, counter-clockwise as seen from outside."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
        from OCP.TopoDS import TopoDS_Wire

        wire = TopoDS_Wire()
        self._build.MakeWire(wire)
        for first, last in ((a, b), (b, c), (c, a)):
            self._build.Add(wire, self._edge(first, last))
        wire.Closed(True)
        return BRepBuilderAPI_MakeFace(wire, True).Face()

    def _edge(self, first: int, last: int):
        """The straight edge from one vertex to another."""
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

        low, high = min(first, last), max(first, last)
        if (low, high) not in self._edges:
            ends = self._vertices[low], self._vertices[high]
            self._edges[low, high] = BRepBuilderAPI_MakeEdge(*ends).Edge()
        edge = self._edges[low, high]
        return edge if first == low else edge.Reversed()
