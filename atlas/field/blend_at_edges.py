"""Blending at creases: the owner of a point where all feet lie beyond an edge.

Most points near an edge have a foot on one of its faces, and the nearest face owns them. Outside of
a convex edge, and inside of a concave one, the feet on all faces lie beyond the edge. There the
body is the intersection, or the union, of the half spaces behind the faces: its distance is the
largest, or the least, of theirs.
"""

from collections.abc import Iterable

import numpy as np

from touchatlas.atlas.field.padded_groups import runs
from touchatlas.atlas.graph.creases import Creases
from touchatlas.atlas.graph.surface_graph import SurfaceGraph

# A face at an edge replaces the owner of a point when its distance is below this fraction of the
# owner's. Creases are known within a deviation or two, so a foot at the far end of a face may pass
# for one on the body. Doubled, a face as near as the owner replaces it.
_NEARER = 0.5


def own_beyond_edges(
    graph: SurfaceGraph, rows, starts, sizes, distance, feet, owner, is_owned
) -> None:
    """Give points that have no owner, or one much farther off, to a face at an edge.

    Parameters
    ----------
    graph : SurfaceGraph
    rows : (m,) int
        Patches of the pairs of a patch and a point, sorted by point.
    starts, sizes : (n,) int
        Index of the first pair of each point, and number of its pairs.
    distance : (m,) float, length
        Signed distance of each pair.
    feet : (m, 3) float, length, world
        Foot of the point on the patch; NaN where it is not in the cell as it is without creases.
    owner : (n,) int
    is_owned : (n,) bool
        Both are changed in place.
    """
    height = np.abs(distance)
    place = np.repeat(np.arange(len(starts)), sizes)
    covers = np.isfinite(feet[:, 0])
    to_owner = np.where((rows == owner[place]) & is_owned[place], height, np.inf)
    far = np.minimum.reduceat(to_owner, starts)
    near = np.minimum.reduceat(np.where(covers, height, np.inf), starts)
    some = np.flatnonzero(covers & (~is_owned | (near < _NEARER * far))[place])
    behind, place = graph.visibility.crossed(rows[some], feet[some]), place[some]
    for first, size in zip(*runs(place), strict=True):
        pairs, point = some[first : first + size], place[first]
        patches, heights = rows[pairs].tolist(), distance[pairs].tolist()
        best = _face_at_edge(graph, patches, heights, behind[first : first + size])
        if best is None:
            continue
        if not is_owned[point] or abs(heights[best]) < _NEARER * far[point]:
            owner[point], is_owned[point] = patches[best], True


def _face_at_edge(
    graph: SurfaceGraph, patches: list[int], distance: list[float], behind: list[set[int]]
) -> int | None:
    """Index of the patch whose distance is that of the body at a point beyond an edge; None where
    a face behind the edge does not reach the point. ``behind`` are the faces behind the edges that
    the foot on each patch has crossed."""
    known = set(patches).union(*(graph.neighbours[i] for i in patches))
    for i in sorted(range(len(patches)), key=lambda i: abs(distance[i])):
        partners = graph.creases.of(patches[i])
        together = [j for j, other in enumerate(patches) if other in partners]
        if together and all(behind[j] <= known for j in (i, *together)):
            # Only edges that a foot has crossed: the other edges of the faces are elsewhere.
            crossed = [j for j in together if patches[j] in behind[i]]
            crossed = crossed or [j for j in together if patches[i] in behind[j]]
            return _bounding_face(graph.creases, patches, distance, i, crossed)
    return None


def nearest_at_edges(creases: Creases, rows, which, distance) -> np.ndarray:
    """The patch whose distance is that of the body at each point.

    Parameters
    ----------
    creases : Creases
    rows, which : (m,) int
        Pairs of a patch and a point, sorted by point.
    distance : (m,) float, length
        Signed distance of each pair.

    Returns
    -------
    (n,) int
        Index of a pair for each point: of the nearest patch, or of the face that bounds the body
        at the edges of that patch.
    """
    out = []
    for first, size in zip(*runs(which), strict=True):
        here = slice(first, first + size)
        nearest = int(np.abs(distance[here]).argmin())
        patches = rows[here].tolist()
        if creases.of(patches[nearest]):
            heights = distance[here].tolist()
            nearest = _bounding_face(creases, patches, heights, nearest, range(len(patches)))
        out.append(first + nearest)
    return np.array(out, int)


def _bounding_face(
    creases: Creases, patches: list[int], distance: list[float], first: int, others: Iterable[int]
) -> int:
    """Index of the first patch or one of others: the one whose distance is that of the body at the
    edges of the first with the others."""
    signs = {i: creases.sign(patches[first], patches[i]) for i in others}
    convex = [i for i, sign in signs.items() if sign == 1]
    concave = [i for i, sign in signs.items() if sign == -1]
    # With edges of both kinds, those of the rarer kind are combined first.
    order = [(convex, max), (concave, min)]
    best = first
    for some, choose in sorted(order, key=lambda kind: len(kind[0])):
        best = choose([best, *some], key=lambda i: distance[i])
    return best
