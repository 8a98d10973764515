"""Edges that no contour crossed: how two faces bound each other, by the side of their samples."""

from touchatlas.atlas.field.face_trees import FaceTrees

# Distance from the samples of the second face within which those of the first say on which side of
# it they lie, over ``reach``. Doubled, faces are compared that a third keeps apart.
_NEAR = 2.0
# Noise of a sample, in root mean squares of the face. Doubled, lower steps imply no edge.
_NOISE = 4.0
# Samples of a face that are asked. Doubled, it takes twice as long.
_ASKED = 64
# Least number of samples of either face, and the largest fraction of them on its other side, which
# may have wrong labels. Doubled, faces that pass through each other bound each other.
_LEAST, _ASTRAY = 3, 0.02


def implied_edges(trees: FaceTrees, reach: float) -> list[tuple[int, int, float]]:
    """Pairs of faces that have no edge or rim in common but bound each other, and how: 1 where each
    lies inside of the other, so that they meet in a convex edge or are the sides of a wall; -1
    where each lies outside of the other, as the sides of a slot do.

    Parameters
    ----------
    trees : FaceTrees
    reach : float, length
        Distance from the samples of a face up to which it may bound another.
    """
    known = {(edge.first, edge.second) for edge in trees.faces.edges}
    found = []
    for first in range(len(trees.faces)):
        for second in range(first + 1, len(trees.faces)):
            if (first, second) in known:
                continue
            side = _side(trees, first, second, reach)
            if side != 0.0 and side == _side(trees, second, first, reach):
                found.append((first, second, -side))
    return found


def _side(trees: FaceTrees, own: int, other: int, reach: float) -> float:
    """1 where the samples of a face near another lie outside of that, -1 inside, 0 on both sides,
    on it, or nowhere."""
    faces = trees.faces
    samples = faces.faces[own].samples
    points = faces.points[samples[:: max(1, len(samples) // _ASKED)]]
    points = points[trees.away(other, points) < _NEAR * reach]
    if len(points) < _LEAST:
        return 0.0
    distance = trees.distances(other, points)
    noise = _NOISE * faces.faces[other].deviation
    outside, inside = (distance > noise).mean(), (distance < -noise).mean()
    if min(outside, inside) > _ASTRAY or outside == inside:
        return 0.0
    return 1.0 if outside > inside else -1.0
