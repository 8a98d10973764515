"""Blending across creases: who leads where no foot lies on the surface itself.

Next to an edge most points have a foot on one of its faces, and the nearest leads. Outside of
a convex edge, and inside of a concave one, the feet on all its faces lie beyond it: there the
body is the intersection, or the union, of the half spaces behind its faces.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.surface_graph import SurfaceGraph

# Faces at an edge lead instead of a foot so many times as far.
_NEARER = 0.5


def own_beyond_edges(
    graph: SurfaceGraph, rows, starts, sizes, distance, feet, owner, is_owned
) -> None:
    """Let the patch lead, at points without a leader (n,), or with one much farther off, whose
    distance is that of the intersection or union of the faces at an edge.

    Parameters
    ----------
    graph : SurfaceGraph
    rows : (m,) int
        Of the pairs of a patch and a point, by point.
    starts, sizes : (n,) int
        Where the pairs of each point begin, and how many they are.
    distance : (m,) float, length
        Of the pairs.
    feet : (m, 3) float, length, world
        Of the points on the patches; NaN where they are not in the patch's own cell, creases
        apart.
    owner : (n,) int
    is_owned : (n,) bool
        Both are changed in place.
    """
    height = np.abs(distance)
    place = np.repeat(np.arange(len(starts)), sizes)
    covers = np.isfinite(feet[:, 0])
    led_by = np.where((rows == owner[place]) & is_owned[place], height, np.inf)
    far = np.minimum.reduceat(led_by, starts)
    near = np.minimum.reduceat(np.where(covers, height, np.inf), starts)
    # Creases are known within a deviation or two: beside an edge a foot at its far end may pass for
    # one on the body.
    some = np.flatnonzero(covers & (~is_owned | (near < _NEARER * far))[place])
    if not len(some):
        return
    behind, place = graph.visibility.crossed(rows[some], feet[some]), place[some]
    begin = np.flatnonzero(np.r_[True, place[1:] != place[:-1]])
    for first, last in zip(begin, np.r_[begin[1:], len(some)], strict=True):
        patches, point = rows[some[first:last]].tolist(), place[first]
        heights = distance[some[first:last]].tolist()
        # Who lies beyond an edge speaks only together with the face behind it.
        known = set(patches).union(*(graph.neighbours[i] for i in patches))
        order = sorted(range(len(patches)), key=lambda i: abs(heights[i]))
        for i in order:
            partners = graph.creases.of(patches[i])
            together = [j for j, other in enumerate(patches) if other in partners]
            if not (together and all(behind[first + j] <= known for j in (i, *together))):
                continue
            # Beyond the edge that it shares with a face: other edges of its are elsewhere.
            crossed = [j for j in together if patches[j] in behind[first + i]]
            crossed = crossed or [j for j in together if patches[i] in behind[first + j]]
            best = _winner(graph.creases, patches, heights, i, crossed)
            if not is_owned[point] or abs(heights[best]) < _NEARER * far[point]:
                owner[point], is_owned[point] = patches[best], True
            break


def nearest_at_edges(creases: Creases, rows, which, distance) -> np.ndarray:
    """(n,) of the pairs (m,) of a patch and a point, by point, the one whose distance is that of
    the body: of faces at one edge their intersection or union, of others the nearest."""
    starts = np.flatnonzero(np.r_[True, which[1:] != which[:-1]][: len(which)])
    out = []
    for first, last in zip(starts, np.r_[starts[1:], len(which)].astype(int), strict=True):
        nearest = int(np.abs(distance[first:last]).argmin())
        patches = rows[first:last].tolist()
        if creases.of(patches[nearest]):
            heights = distance[first:last].tolist()
            nearest = _winner(creases, patches, heights, nearest, range(len(patches)))
        out.append(first + nearest)
    return np.array(out, int)


def _winner(
    creases: Creases, patches: list[int], distance: list[float], first: int, others: Iterable[int]
) -> int:
    """Index of the patch, a first one or one of others, whose distance is that of the body at the
    edges that these have with it."""
    signs = {i: creases.sign(patches[first], patches[i]) for i in others}
    convex = [i for i, sign in signs.items() if sign == 1]
    concave = [i for i, sign in signs.items() if sign == -1]
    # With edges of both kinds the odd one binds closer.
    order = [(convex, max), (concave, min)]
    best = first
    for some, choose in sorted(order, key=lambda kind: len(kind[0])):
        best = choose([best, *some], key=lambda i: distance[i])
    return best
