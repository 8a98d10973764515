"""The patches of a body as a graph: each in its Darboux frame, and where it meets others."""

import networkx as nx
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.pieces.piece import Piece
from touchatlas.patch.geometry.frame import DarbouxFrame, any_tangent


def patch_graph(body: Body | None) -> nx.Graph:
    """The patches as nodes, and where two of them meet as edges; none without a body.

    Nodes have ``face`` (id), ``frame`` (DarbouxFrame: principal directions and outward normal at a
    point of the patch), ``k1`` and ``k2`` (1/length, positive where the surface bends toward the
    normal), ``radius`` (length) and ``deviation`` (length, at the origin of the frame). Edges have
    a ``kind``: that of an edge between faces, or "artificial" between patches of one surface.
    """
    graph = nx.Graph()
    if body is None:
        return graph
    patches = body.field.trees.patches()
    for number, (face, piece) in enumerate(patches):
        graph.add_node(number, face=face, **_node(piece))
    for one, other in _overlapping(patches):
        graph.add_edge(one, other, kind="artificial")
    for edge in body.faces.edges:
        first, second = (body.field.trees.first_of(k) for k in (edge.first, edge.second))
        if first != second:
            for one, other in _along(edge, (first, second), patches):
                graph.add_edge(one, other, kind=edge.kind.value)
    return graph


def _node(piece: Piece) -> dict:
    """What a node says of a patch: do Carmo, section 3-2. The derivative of the normal is minus the
    shape operator of the convention in which a ball seen from inside bends toward its normal."""
    foot = piece.feet(piece.origin[None])
    normal = piece.at(foot)[1][0]
    values, vectors = np.linalg.eigh(-piece.shape_operators(foot)[0])
    # One eigenvector is the normal, of eigenvalue 0.
    order = np.argsort(np.abs(vectors.T @ normal))[:2]
    first, second = order[np.argsort(-values[order])]
    along = vectors[:, first] - (vectors[:, first] @ normal) * normal
    size = float(np.linalg.norm(along))
    along = along / size if size > 0.5 else any_tangent(normal)
    axes = np.stack([along, np.cross(normal, along), normal])
    return {
        "frame": DarbouxFrame(foot[0], axes),
        "k1": float(values[first]),
        "k2": float(values[second]),
        "radius": piece.scale,
        "deviation": float(np.sqrt(piece.predicted(foot)[2][0])),
    }


def _overlapping(patches) -> list[tuple[int, int]]:
    """Pairs of patches of one face whose middles are within 1.2 radii of each other, so that their
    weights overlap, and whose normals differ by less than a right angle."""
    found = []
    for face in dict.fromkeys(face for face, _ in patches):
        own = [k for k, (its, _) in enumerate(patches) if its == face]
        tree = cKDTree([patches[k][1].origin for k in own])
        for i, j in sorted(tree.query_pairs(1.2 * max(patches[k][1].scale for k in own))):
            a, b = patches[own[i]][1], patches[own[j]][1]
            near = np.linalg.norm(a.origin - b.origin) < 1.2 * max(a.scale, b.scale)
            if near and a.axes[2] @ b.axes[2] > 0.0:
                found.append((own[i], own[j]))
    return found


def _along(edge: FaceEdge, faces: tuple[int, int], patches) -> set[tuple[int, int]]:
    """Pairs of the patches of two faces that are nearest to points of the edge between them; of an
    edge that no contour crossed, which has no points, the pair nearest to each other."""
    owns = [[k for k, (its, _) in enumerate(patches) if its == face] for face in faces]
    trees = [cKDTree([patches[k][1].origin for k in own]) for own in owns]
    if edge.curves:
        points = np.concatenate(edge.curves)
    else:
        away = trees[1].query(trees[0].data)[0]
        points = trees[0].data[[away.argmin()]]
    sides = [np.array(own)[tree.query(points)[1]] for own, tree in zip(owns, trees, strict=True)]
    return {(int(a), int(b)) for a, b in zip(*sides, strict=True)}
