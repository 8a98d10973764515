"""BezierBrep: the faces of a closed BezierTree in numbers, and the angles between neighbours."""

from dataclasses import dataclass
from typing import NamedTuple

import networkx as nx
import numpy as np

from touchatlas.atlas.cad.bezier.bezier import face_normals
from touchatlas.atlas.cad.bezier.bezier_tree import BezierTree, Use

# Tolerance of an edge that is exact, over the extent: CAD systems compute to some 1e-8 of a body's
# size. Doubled, so is the tolerance that the file states.
_LEAST_GAP = 1e-8
# Corners of the parameters of a face, in turn; side k goes from corner k to the next.
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
# Points of an edge at which the normals of both its faces are compared. Doubled, larger angles are
# found, by a few hundredths.
_COMPARED = 9


class BezierEdge(NamedTuple):
    """A Bezier curve between two vertices, with control points (n + 1, 3), length; its parameter
    runs from 0 to 1."""

    start: int
    end: int
    control: np.ndarray


class BezierUse(NamedTuple):
    """An edge on a face, followed forward or not; ``first`` and ``last`` are the parameters (2,) of
    the face at the start and the end of the edge."""

    edge: int
    forward: bool
    first: np.ndarray
    last: np.ndarray


class BezierFace(NamedTuple):
    """A Bezier face, whose derivatives by u and by v make its outward normal, with control points
    (n + 1, n + 1, 3), length, the first index of which belongs to u. Both parameters run from 0 to
    1. Edges follow in turn, counter-clockwise as seen against the normal."""

    control: np.ndarray
    uses: tuple[BezierUse, ...]


@dataclass(frozen=True, eq=False)
class BezierBrep:
    """Faces that share edges and vertices, each edge by two of them.

    Parameters
    ----------
    vertices : (v, 3) float, length, world
    edges : tuple of BezierEdge
    faces : tuple of BezierFace
    parts : tuple of tuple of int
        Connected faces.
    gap : float, length
        Tolerance of edges and vertices.
    """

    vertices: np.ndarray
    edges: tuple[BezierEdge, ...]
    faces: tuple[BezierFace, ...]
    parts: tuple[tuple[int, ...], ...]
    gap: float


def bezier_brep(tree: BezierTree) -> BezierBrep:
    """The faces of a tree that share edges, the smallest parts of its sides."""
    number: dict[int, int] = {}
    faces = []
    for uses, control in zip(tree.faces, tree.controls, strict=True):
        own = [
            BezierUse(number.setdefault(side, len(number)), forward, *ends[:: 1 if forward else -1])
            for (side, forward), *ends in traces(tree, uses)
        ]
        faces.append(BezierFace(control, tuple(own)))
    sides = [tree.sides[side] for side in number]
    used, ends = np.unique([(side.start, side.end) for side in sides], return_inverse=True)
    edges = tuple(
        BezierEdge(start, end, side.control)
        for (start, end), side in zip(ends.reshape(-1, 2).tolist(), sides, strict=True)
    )
    points = np.array(tree.vertices)
    gap = _LEAST_GAP * float(np.ptp(points, axis=0).max())
    return BezierBrep(points[used], edges, tuple(faces), _parts(faces), gap)


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


def _parts(faces) -> tuple[tuple[int, ...], ...]:
    """Faces connected by edges."""
    graph = nx.Graph()
    for number, face in enumerate(faces):
        graph.add_edges_from((("face", number), ("edge", use.edge)) for use in face.uses)
    parts = nx.connected_components(graph)
    return tuple(sorted(tuple(sorted(n for kind, n in p if kind == "face")) for p in parts))
