"""Bezier Brep: the faces of a BezierTree as a Brep, and the angles between neighbours."""

import networkx as nx
import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from touchatlas.atlas.cad.bezier import face_normals
from touchatlas.atlas.cad.bezier_tree import BezierTree, Use
from touchatlas.atlas.cad.brep import (
    LEAST_GAP,
    BezierFace,
    Brep,
    BrepEdge,
    BrepFace,
    BrepUse,
)
from touchatlas.atlas.cad.edge_shapes import Spline

# Corners of the parameters of a face, in turn; side k goes from corner k to the next.
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
# Points of an edge at which the normals of both its faces are compared. Doubled, larger angles are
# found, by a few hundredths.
_COMPARED = 9


def bezier_brep(tree: BezierTree) -> Brep:
    """The faces of a tree that share edges, the smallest parts of its sides."""
    least = LEAST_GAP * float(np.ptp(np.array(tree.vertices), axis=0).max())
    number: dict[int, int] = {}
    faces = []
    for uses, control in zip(tree.faces, tree.controls, strict=True):
        wire = tuple(
            BrepUse(number.setdefault(side, len(number)), forward, _line(first, last, forward))
            for (side, forward), first, last in traces(tree, uses)
        )
        faces.append(BrepFace(BezierFace(control), 0, (wire,)))
    edges = []
    for side in number:
        one = tree.sides[side]
        edges.append(BrepEdge(one.start, one.end, Spline(_bezier(one.control)), least))
    vertices, edges = _used(np.array(tree.vertices), edges)
    parts, closed = _parts(faces)
    gaps = np.full(len(vertices), least)
    return Brep(vertices, gaps, tuple(edges), tuple(faces), parts, closed)


def traces(tree: BezierTree, uses) -> list[tuple[Use, np.ndarray, np.ndarray]]:
    """The edges of a face in turn, each with the parameters (2,) at which it starts and ends as it
    is followed."""
    out: list[tuple[Use, np.ndarray, np.ndarray]] = []
    for k, use in enumerate(uses):
        _follow(tree, use, _CORNERS[k], _CORNERS[(k + 1) % 4], out)
    return out


def _follow(tree: BezierTree, use: Use, first, last, out) -> None:
    """Append the smallest parts of a side between parameters (2,)."""
    if tree.sides[use[0]].halves is None:
        out.append((use, first, last))
        return
    middle = 0.5 * (first + last)
    _follow(tree, tree.half(use, 0), first, middle, out)
    _follow(tree, tree.half(use, 1), middle, last, out)


def largest_turn(tree: BezierTree) -> float:
    """Largest angle between the normals of two faces at an edge that they share, rad."""
    t, worst = np.linspace(0.0, 1.0, _COMPARED)[:, None], 0.0
    normals: dict[int, np.ndarray] = {}
    for uses, control in zip(tree.faces, tree.controls, strict=True):
        for (side, forward), first, last in traces(tree, uses):
            along = t if forward else 1.0 - t
            own = face_normals(control, *(first + along * (last - first)).T)
            other = normals.setdefault(side, own)
            # The chord between unit vectors is exact for small angles, where the cosine is not.
            chord = np.linalg.norm(own - other, axis=1).max()
            worst = max(worst, 2.0 * float(np.arcsin(min(0.5 * chord, 1.0))))
    return worst


def _line(first, last, forward: bool) -> BSpline:
    """The straight trace of an edge in the parameters of a face; the edge runs from 0 to 1."""
    return make_interp_spline([0.0, 1.0], [first, last] if forward else [last, first], k=1)


def _bezier(control) -> BSpline:
    """A Bezier curve (n + 1, 3) as a spline of one piece."""
    return BSpline(np.repeat([0.0, 1.0], len(control)), control, len(control) - 1)


def _used(vertices, edges) -> tuple[np.ndarray, list[BrepEdge]]:
    """The vertices that edges use, and edges between these."""
    used, ends = np.unique([(e.start, e.end) for e in edges], return_inverse=True)
    renamed = zip(edges, ends.reshape(-1, 2).tolist(), strict=True)
    return vertices[used], [BrepEdge(a, b, e.curve, e.gap) for e, (a, b) in renamed]


def _parts(faces) -> tuple[tuple[tuple[int, ...], ...], tuple[bool, ...]]:
    """Faces connected by edges, and whether each part has no rim."""
    beside: dict[int, list[int]] = {}
    for number, face in enumerate(faces):
        for use in face.wires[0]:
            beside.setdefault(use.edge, []).append(number)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(faces)))
    graph.add_edges_from(both for both in beside.values() if len(both) == 2)
    parts = tuple(sorted(tuple(sorted(part)) for part in nx.connected_components(graph)))
    rims = {both[0] for both in beside.values() if len(both) == 1}
    return parts, tuple(not rims.intersection(part) for part in parts)
