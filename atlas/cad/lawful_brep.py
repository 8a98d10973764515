"""The Brep of a lawful body: its edges, the wires of its faces, and their seams.

A face that goes around an axis has its seam twice in one wire, and at a pole an edge of no length.
"""

import networkx as nx
import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from touchatlas.atlas.cad.brep import LEAST_GAP, Brep, BrepEdge, BrepFace, BrepUse
from touchatlas.atlas.cad.edge_shapes import Arc, Curve, Line, curve_between, parameters, trace
from touchatlas.atlas.cad.face_layout import FaceLayout
from touchatlas.atlas.cad.face_regions import BEYOND, Use
from touchatlas.atlas.cad.law_surfaces import LawSurface
from touchatlas.atlas.cad.shared_points import farthest

# Factor on the largest distances found, no unit, since the largest between points may be missed by
# 1 %. With twice the excess the tolerances in the file are 1 % larger.
_GAP_FACTOR = 1.01


class _Maker:
    """Collects vertices and edges while faces are made."""

    def __init__(self, layout: FaceLayout, exact: float) -> None:
        self.layout = layout
        self.vertices = list(layout.nodes)
        self.least = LEAST_GAP * float(np.ptp(np.array(layout.nodes), axis=0).max(initial=0.0))
        self.edges = [self._edge(chain, exact) for chain in layout.chains]

    def _edge(self, chain, exact: float) -> BrepEdge:
        around = self.layout.around(chain)
        curve = curve_between(around, chain.points, exact)
        at = curve.points(parameters(curve))
        gap = max(_GAP_FACTOR * farthest(around, at), self.least)
        for surface in around:
            if surface.periodic:
                found = trace(curve, surface)
                fine = np.linspace(0.0, curve.last, 4 * len(at))
                off = surface.points(found(fine)) - curve.points(fine)
                gap = max(gap, _GAP_FACTOR * float(np.linalg.norm(off, axis=1).max()))
        return BrepEdge(chain.start, chain.end, curve, gap)

    def wires(self, region: int) -> tuple[tuple[BrepUse, ...], ...]:
        """The wires of a region."""
        surface, loops = self.layout.surfaces[region], self.layout.loops[region]
        if surface.outward < 0.0:
            loops = [[(c, not forward) for c, forward in reversed(loop)] for loop in loops]
        if region not in self.layout.seams:
            return tuple(self._wire(surface, loop) for loop in loops)
        ends = self.layout.seams[region]
        around = [self._starting(loops, node) for node in ends]
        rest = [loop for loop in loops if not any(set(loop) == set(a) for a in around)]
        return (self._seamed(surface, ends, around), *(self._wire(surface, r) for r in rest))

    def _starting(self, loops, node: int | None) -> list[Use]:
        """The loop that passes a node, from there."""
        for loop in loops:
            starts = [self._ends(use)[0] for use in loop]
            if node in starts:
                first = starts.index(node)
                return [*loop[first:], *loop[:first]]
        return []

    def _ends(self, use: Use) -> tuple[int, int]:
        edge = self.edges[use[0]]
        return (edge.start, edge.end) if use[1] else (edge.end, edge.start)

    def _wire(self, surface: LawSurface, loop) -> tuple[BrepUse, ...]:
        return tuple(BrepUse(c, f, self._trace(self.edges[c], surface)) for c, f in loop)

    def _trace(self, edge: BrepEdge, surface: LawSurface) -> BSpline | None:
        return trace(edge.curve, surface) if surface.periodic and edge.curve is not None else None

    def _seamed(self, surface: LawSurface, ends, around) -> tuple[BrepUse, ...]:
        """Around the axis, up the seam, around and back, and down the seam."""
        poles = [
            self._pole(surface, sign) if a == [] else None
            for sign, a in zip((-1, 1), around, strict=True)
        ]
        low, high = (
            end if pole is None else pole[0] for end, pole in zip(ends, poles, strict=True)
        )
        bottom, top = (
            list(self._wire(surface, a)) if pole is None else [pole[1]]
            for a, pole in zip(around, poles, strict=True)
        )
        number, (v_low, v_high) = self._seam(surface, low, high)
        last = self.edges[number].curve.last
        left, right = (
            make_interp_spline([0.0, last], [[u, v_low], [u, v_high]], k=1)
            for u in (0.0, 2.0 * np.pi)
        )
        return (*bottom, BrepUse(number, True, right), *top, BrepUse(number, False, left))

    def _pole(self, surface: LawSurface, sign: int) -> tuple[int, BrepUse]:
        """The vertex of a pole, and the edge of no length there."""
        v, around = surface.pole(sign), 2.0 * np.pi
        ends = np.array([[0.0, v], [around, v]])
        self.vertices.append(surface.points(ends)[0])
        vertex = len(self.vertices) - 1
        self.edges.append(BrepEdge(vertex, vertex, None, self.least))
        line = make_interp_spline([0.0, around], ends, k=1)
        return vertex, BrepUse(len(self.edges) - 1, sign < 0, line)

    def _seam(self, surface: LawSurface, low: int, high: int):
        """The edge of a seam between two vertices, and the parameters v of these."""
        ends = np.stack([self.vertices[low], self.vertices[high]])
        v = surface.parameters(ends)[:, 1]
        curve: Curve = Line(*ends)
        if surface.kind == "sphere":
            (x, y, z), (cosine, sine) = surface.axes, (np.cos(v[0]), np.sin(v[0]))
            axes = np.stack([cosine * x + sine * z, cosine * z - sine * x, -y])
            curve = Arc(surface.origin, axes, surface.radius, float(v[1] - v[0]))
        off = np.abs(curve.points([0.0, curve.last]) - ends).max()
        gap = max(_GAP_FACTOR * farthest([surface], curve.points(parameters(curve))), off)
        self.edges.append(BrepEdge(low, high, curve, max(gap, self.least)))
        return len(self.edges) - 1, v


def brep_of(layout: FaceLayout, labels, exact: float) -> Brep:
    """The body of a layout whose seams are cut.

    Parameters
    ----------
    layout : FaceLayout
    labels : (r,) int
        Face of the lawful body that each region is of.
    exact : float, length
        Distance from both faces at which an edge may be a straight line or an arc.
    """
    maker = _Maker(layout, exact)
    faces = tuple(
        BrepFace(surface, int(label), maker.wires(region))
        for region, (surface, label) in enumerate(zip(layout.surfaces, labels, strict=True))
    )
    parts = _parts(layout)
    rims = {chain.left for chain in layout.chains if chain.right == BEYOND}
    closed = tuple(not rims.intersection(part) for part in parts)
    vertices = np.array(maker.vertices)
    gaps = _vertex_gaps(vertices, maker.edges, maker.least)
    return Brep(vertices, gaps, tuple(maker.edges), faces, parts, closed)


def _parts(layout: FaceLayout) -> tuple[tuple[int, ...], ...]:
    """Regions connected by chains, each part ascending."""
    graph = nx.Graph()
    graph.add_nodes_from(range(len(layout.surfaces)))
    graph.add_edges_from((c.left, c.right) for c in layout.chains if c.right != BEYOND)
    return tuple(sorted(tuple(sorted(part)) for part in nx.connected_components(graph)))


def _vertex_gaps(vertices, edges, least: float) -> np.ndarray:
    """(v,) largest distance of vertices from the ends of their edges, and gap of these."""
    gaps = np.full(len(vertices), least)
    for edge in edges:
        ends = [0.0, 0.0] if edge.curve is None else edge.curve.points([0.0, edge.curve.last])
        for vertex, end in zip((edge.start, edge.end), ends, strict=True):
            off = 0.0 if edge.curve is None else float(np.linalg.norm(vertices[vertex] - end))
            gaps[vertex] = max(gaps[vertex], _GAP_FACTOR * off, edge.gap)
    return gaps
