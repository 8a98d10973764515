"""Edges of a lawful body that are drawn sharp by a guess: most of its edges are rounded."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.faces.faces import FaceEdge


@dataclass(frozen=True, eq=False)
class GuessedEdges:
    """Edges that no contour crossed, of a body most of whose edges are rounded.

    Parameters
    ----------
    points, normals : (k, 3) float, length; unit, world
        A point amid the curves of each edge, and the direction half-way between the normals of its
        faces.
    radius : float, length
        Median radius of the rounded edges; 0 where most are sharp.
    """

    points: np.ndarray
    normals: np.ndarray
    radius: float


def guessed_edges(body: Body, tolerance: float) -> GuessedEdges:
    """The edges of a body that are drawn sharp though no contour crossed them and most others are
    rounded, if rounded alike they would be off by more than the tolerance."""
    met = [edge for edge in body.faces.edges if edge.kind.sharp]
    radii = [edge.radius for edge in met if edge.radius > 0.0]
    if 2 * len(radii) <= len(met):
        return GuessedEdges(np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    # The surface shows edges, too, that no contour came near.
    sharp = [edge for edge in with_uncrossed_edges(body).edges if edge.kind.sharp]
    tree, radius = cKDTree(body.samples.points), float(np.median(radii))
    found = [
        edge
        for edge in sharp
        if edge.radius == 0.0 and tolerance < _off(edge, radius) < _away(edge, tree)
    ]
    curves = [np.concatenate(edge.curves) for edge in found]
    middles = np.reshape([curve[len(curve) // 2] for curve in curves], (-1, 3))
    pairs = zip(found, middles, strict=True)
    normals = [_between(body, (edge.first, edge.second), point) for edge, point in pairs]
    return GuessedEdges(middles, np.reshape(normals, (-1, 3)), radius)


def _between(body: Body, pair, point) -> np.ndarray:
    """The direction (3,) half-way between the normals of a pair of faces at a point (3,)."""
    both = np.sum([body.field.trees.of(k).values(point[None])[0, 1:4] for k in pair], axis=0)
    return np.asarray(both / np.linalg.norm(both))


def _off(edge: FaceEdge, radius: float) -> float:
    """Distance of a rounding of a radius from the sharp edge, length: the ball touches both faces,
    whose normals differ by the edge's angle."""
    return float(radius * (1.0 / np.cos(0.5 * edge.angle) - 1.0))


def _away(edge: FaceEdge, tree: cKDTree) -> float:
    """Distance of the nearest sample from the curves of an edge, length; 0 where it has none. A
    contour that crosses a sharp edge has samples nearer to it than a rounding is."""
    return float(tree.query(np.concatenate(edge.curves))[0].min()) if edge.curves else 0.0
