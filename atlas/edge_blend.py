"""Blending across creases: who leads where no foot lies on the surface itself.

Next to an edge most points have a foot on one of its faces, and the nearest leads. Outside of
a convex edge, and inside of a concave one, the feet on all its faces lie beyond it: there the
body is the intersection, or the union, of the half spaces behind its faces.
"""

import numpy as np

from touchatlas.atlas.creases import Creases


def lead_off_edges(creases: Creases, rows, starts, sizes, distance, feet, leader, led) -> None:
    """Let the patch lead, at points without a leader (n,), whose distance is that of the
    intersection or union of the faces at an edge.

    Parameters
    ----------
    creases : Creases
    rows : (m,) int
        Of the pairs of a patch and a point, by point.
    starts, sizes : (n,) int
        Where the pairs of each point begin, and how many they are.
    distance : (m,) float, length
        Of the pairs.
    feet : (m, 3) float, length, world
        Of the points on the patches; NaN where they are not in the patch's own cell, creases
        apart.
    leader : (n,) int
    led : (n,) bool
        Both are changed in place.
    """
    covers = np.isfinite(feet[:, 0]) & ~np.repeat(led, sizes)
    some = np.flatnonzero(covers)
    if not len(some):
        return
    behind = creases.crossed(rows[some], feet[some])
    place = np.repeat(np.arange(len(starts)), sizes)[some]
    begin = np.flatnonzero(np.r_[True, place[1:] != place[:-1]])
    for first, last in zip(begin, np.r_[begin[1:], len(some)], strict=True):
        patches = rows[some[first:last]].tolist()
        heights = distance[some[first:last]].tolist()
        # Who lies beyond an edge speaks only together with the face behind it.
        known = set(patches).union(*(creases.kin_of(i) for i in patches))
        order = sorted(range(len(patches)), key=lambda i: abs(heights[i]))
        for i in order:
            together = [j for j, other in enumerate(patches) if other in creases.of(patches[i])]
            if together and all(behind[first + j] <= known for j in (i, *together)):
                leader[place[first]] = patches[_winner(creases, patches, heights, i)]
                led[place[first]] = True
                break


def speakers(creases: Creases, rows, which, distance) -> np.ndarray:
    """(n,) of the pairs (m,) of a patch and a point, by point, the one whose distance is that of
    the body: of faces at one edge their intersection or union, of others the nearest."""
    starts = np.flatnonzero(np.r_[True, which[1:] != which[:-1]][: len(which)])
    out = []
    for first, last in zip(starts, np.r_[starts[1:], len(which)].astype(int), strict=True):
        nearest = int(np.abs(distance[first:last]).argmin())
        patches = rows[first:last].tolist()
        if creases.of(patches[nearest]):
            nearest = _winner(creases, patches, distance[first:last].tolist(), nearest)
        out.append(first + nearest)
    return np.array(out, int)


def _winner(creases: Creases, patches: list[int], distance: list[float], first: int) -> int:
    """Index of the patch whose distance is that of the body at a corner with a first patch."""
    signs = [creases.sign(patches[first], j) for j in patches]
    convex = [i for i, sign in enumerate(signs) if sign == 1]
    concave = [i for i, sign in enumerate(signs) if sign == -1]
    # With edges of both kinds the odd one binds closer.
    order = [(convex, max), (concave, min)]
    best = first
    for others, choose in sorted(order, key=lambda kind: len(kind[0])):
        best = choose([best, *others], key=lambda i: distance[i])
    return best
