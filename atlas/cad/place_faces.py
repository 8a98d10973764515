"""Faces of a lawful body placed on their surfaces: from triangles to a FaceLayout."""

from collections import Counter

import numpy as np

from touchatlas.atlas.cad.face_layout import FaceLayout, NotWritten, PlacedChain
from touchatlas.atlas.cad.face_regions import BEYOND, Regions, regions_of
from touchatlas.atlas.cad.law_surfaces import LawSurface, law_surface
from touchatlas.atlas.cad.shared_points import shared_points
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.surface import Surface

# Distance by which the points of a true edge move onto both faces, in edges of the triangles.
# Doubled, faces are drawn with parts that are not theirs.
_MOVED = 3.0
# Least length of the moved points of a true edge over that of the triangles' edges, whose teeth make
# it 1.5 times longer. Doubled, true edges with teeth are taken for wrong.
_SHRUNK = 0.4
# Least distance of points of a chain, in edges of the triangles: teeth of the border go back by
# less. Doubled, short edges have no points but their ends.
_SPACING = 0.6
# Rounds in which the points of a rim take the mean of their neighbours: it is as jagged as cubes
# are. Doubled, rims are rounded over twice as many cubes.
_SMOOTHED = 8


def place_faces(body: LawfulBody, drawn: Surface, edge: float) -> tuple[FaceLayout, Regions]:
    """The faces of a body as its triangles show them, and the triangles of each.

    Parameters
    ----------
    body : LawfulBody
    drawn : Surface
        Its surface.
    edge : float, length
        Of the cubes in which it was drawn.

    Raises
    ------
    NotWritten
        A face has no surface in STEP, or two do not intersect where they meet.
    """
    labels = body.at(drawn.vertices[drawn.faces].mean(axis=1))[0].face
    surfaces = {int(k): _surface(body, int(k)) for k in np.unique(labels)}
    regions = regions_of(drawn.faces, labels)
    while True:
        of_region = [surfaces[int(k)] for k in regions.labels]
        nodes = _nodes(regions, of_region, drawn.vertices)
        chains, wrong = [], []
        for chain in regions.chains:
            around = [of_region[r] for r in (chain.left, chain.right) if r != BEYOND]
            points = drawn.vertices[chain.vertices]
            found = shared_points(around, points)
            if not _meet(around, points, found, edge):
                wrong.append(chain)
            chains.append(_placed(chain, found, around, nodes, _SPACING * edge))
        if not wrong:
            break
        regions = regions_of(drawn.faces, _without(regions, wrong))
    index = {vertex: number for number, vertex in enumerate(nodes)}
    ends = Counter(int(v) for chain in regions.chains for v in chain.vertices[[0, -1]])
    for chain, placed in zip(regions.chains, chains, strict=True):
        first, last = chain.vertices[[0, -1]].tolist()
        placed.start, placed.end = index[first], index[last]
        placed.is_free = first == last and ends[first] == 2
    loops = [[list(loop) for loop in own] for own in regions.loops]
    return FaceLayout(of_region, loops, chains, list(nodes.values()), {}), regions


def _surface(body: LawfulBody, number: int) -> LawSurface:
    face = body.faces.faces[number]
    found = law_surface(face, body.samples.points[face.samples])
    if found is None:
        raise NotWritten(f"face {number} is a {face.kind} face, which has no name in STEP")
    return found


def _nodes(regions: Regions, surfaces, vertices) -> dict[int, np.ndarray]:
    """Vertices of the mesh at the ends of chains, and the point where all faces meet there."""
    around: dict[int, set[int]] = {}
    for chain in regions.chains:
        for vertex in chain.vertices[[0, -1]].tolist():
            around.setdefault(vertex, set()).update({chain.left, chain.right} - {BEYOND})
    return {
        vertex: shared_points([surfaces[r] for r in sorted(own)], vertices[vertex][None])[0]
        for vertex, own in around.items()
    }


def _meet(around, points, found, edge: float) -> bool:
    """Whether faces intersect near points (k, 3) of a chain, which were moved onto both."""
    far = np.sqrt(((found - points) ** 2).sum(axis=1)).max()
    before, after = (np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in (points, found))
    is_closed = np.array_equal(points[0], points[-1])
    # Two planes meet in no closed curve.
    if is_closed and len(around) == 2 and not any(s.periodic for s in around):
        return False
    return bool(far <= _MOVED * edge and after >= _SHRUNK * before)


def _placed(chain, points, around, nodes, spacing: float) -> PlacedChain:
    """A chain with points (k, 3) on both faces, from node to node, no nearer than ``spacing``."""
    start, end = (nodes[int(v)] for v in chain.vertices[[0, -1]])
    points = np.concatenate([start[None], points[1:-1], end[None]])
    if len(around) < 2:
        points = shared_points(around, _smoothed(points))
    return PlacedChain(chain.left, chain.right, _spaced(points, spacing), 0, 0, False)


def _smoothed(points) -> np.ndarray:
    """Points (k, 3) of a line, each in the middle of its neighbours, the ends kept."""
    points = points.copy()
    for _ in range(_SMOOTHED):
        points[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
    return points


def _spaced(points, spacing: float) -> np.ndarray:
    """Points (k, 3) of a line without those nearer than ``spacing`` to the last or to the end."""
    kept = [0]
    for i in range(1, len(points) - 1):
        away = np.linalg.norm(points[[kept[-1], -1]] - points[i], axis=1)
        if away.min() >= spacing:
            kept.append(i)
    return np.asarray(points[[*kept, len(points) - 1]])


def _without(regions: Regions, wrong) -> np.ndarray:
    """(f,) labels of the triangles where the smaller region beside a wrong chain is part of the
    larger one; the largest region of a face stays."""
    sizes = np.bincount(regions.of)
    labels = regions.labels.copy()
    largest = {int(k): max(sizes[regions.labels == k]) for k in np.unique(regions.labels)}
    for chain in wrong:
        if chain.right == BEYOND:
            raise NotWritten("the rim of a face lies far from its surface")
        small, large = sorted((chain.left, chain.right), key=lambda r: sizes[r])
        if sizes[small] == largest[int(regions.labels[small])]:
            raise NotWritten(
                f"faces {regions.labels[small]} and {regions.labels[large]} do not intersect where "
                "their triangles meet"
            )
        labels[small] = labels[large]
    return np.asarray(labels[regions.of])
