"""Doubts about edges of which no contour shows whether they are sharp or rounded."""

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.check.doubt import Doubt, count_of, extent_of, some_apart
from touchatlas.atlas.faces.faces import FaceEdge
from touchatlas.atlas.faces.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.state import AtlasState


def edge_doubts(atlas: AtlasState) -> list[Doubt]:
    """One doubt where edges are drawn sharp that no contour crossed, though most edges of the body
    are rounded, and rounded alike they would be off by more than the tolerance."""
    if atlas.body is None:
        return []
    met = [edge for edge in atlas.body.faces.edges if edge.kind.sharp]
    radii = [edge.radius for edge in met if edge.radius > 0.0]
    if 2 * len(radii) <= len(met):
        return []
    # The surface shows edges, too, that no contour came near.
    sharp = [edge for edge in with_uncrossed_edges(atlas.body).edges if edge.kind.sharp]
    tree, radius = cKDTree(atlas.pool.points), float(np.median(radii))
    guessed = [
        np.concatenate(edge.curves)
        for edge in sharp
        if edge.radius == 0.0 and atlas.tolerance < _off(edge, radius) < _away(edge, tree)
    ]
    if not guessed:
        return []
    words = (
        f"{count_of(len(guessed), 'edge is', 'edges are')} drawn sharp that no contour crossed, "
        f"though most are rounded, by {radius:.3g} in the median; touch there."
    )
    middles = np.array([curve[len(curve) // 2] for curve in guessed])
    return [Doubt("guessed edges", words, some_apart(middles, extent_of(atlas.pool.points)))]


def _off(edge: FaceEdge, radius: float) -> float:
    """Distance of a rounding of a radius from the sharp edge, length: the ball touches both faces,
    whose normals differ by the edge's angle."""
    return float(radius * (1.0 / np.cos(0.5 * edge.angle) - 1.0))


def _away(edge: FaceEdge, tree: cKDTree) -> float:
    """Distance of the nearest sample from the curves of an edge, length; 0 where it has none. A
    contour that crosses a sharp edge has samples nearer to it than a rounding is."""
    return float(tree.query(np.concatenate(edge.curves))[0].min()) if edge.curves else 0.0
