"""Faces of a lawful body placed on their surfaces: from triangles to a FaceLayout."""

from collections import Counter

import igl
import numpy as np

from touchatlas.atlas.cad.face_layout import FaceLayout, NotWritten, PlacedChain
from touchatlas.atlas.cad.face_regions import BEYOND, Regions, regions_of
from touchatlas.atlas.cad.law_surfaces import LawSurface, law_surface
from touchatlas.atlas.cad.shared_points import LEAST_SINE, shared_points
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.surface import Surface
from touchatlas.patch.geometry.arrays import cross

# Distance by which the points of a true edge move onto both faces, in edges of the triangles.
# Doubled, faces are drawn with parts that are not theirs.
_MOVED = 3.0
# Least length of the moved points of a true edge over that of the triangles' edges, whose teeth make
# it 1.5 times longer. Doubled, true edges with teeth are taken for wrong.
_SHRUNK = 0.4
# Least distance of points of a chain, in edges of the triangles: teeth of the border go back by
# less. Doubled, short edges have no points but their ends.
_SPACING = 0.6
# Least distance of the ends of an edge, in edges of the triangles: nearer ones are one corner.
# Doubled, bodies with shorter edges are open there.
_SHORT = 1e-3
# Rounds in which the points of a rim take the mean of their neighbours: it is as jagged as cubes
# are. Doubled, rims are rounded over twice as many cubes.
_SMOOTHED = 8


def place_faces(
    body: LawfulBody, drawn: Surface, edge: float
) -> tuple[FaceLayout, Regions, Surface]:
    """The faces of a body as its triangles show them, the triangles of each, and all triangles that
    stay: where two faces do not intersect between their triangles, the surface is open.

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
            placed = _placed(chain, found, around, nodes, _SPACING * edge)
            if not _meet(around, points, found, edge) or _is_short(placed.points, edge):
                wrong.append(chain)
            chains.append(placed)
        if not wrong:
            break
        labels, kept = _without(regions, wrong, drawn.faces)
        drawn, labels = _only(drawn, kept), labels[kept]
        if not len(labels):
            raise NotWritten("no two faces intersect where their triangles meet")
        regions = regions_of(drawn.faces, labels)
    index = {vertex: number for number, vertex in enumerate(nodes)}
    ends = Counter(int(v) for chain in regions.chains for v in chain.vertices[[0, -1]])
    for chain, placed in zip(regions.chains, chains, strict=True):
        first, last = chain.vertices[[0, -1]].tolist()
        placed.start, placed.end = index[first], index[last]
        placed.is_free = first == last and ends[first] == 2
    loops = [[list(loop) for loop in own] for own in regions.loops]
    return FaceLayout(of_region, loops, chains, list(nodes.values()), {}), regions, drawn


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


def _is_short(points, edge: float) -> bool:
    """Whether points (k, 3) are no curve: too few of a closed one, or without length."""
    if np.array_equal(points[0], points[-1]):
        return len(points) < 4
    return bool(np.linalg.norm(points[-1] - points[0]) < _SHORT * edge)


def _placed(chain, points, around, nodes, spacing: float) -> PlacedChain:
    """A chain with points (k, 3) on both faces, from node to node, no nearer than ``spacing``."""
    start, end = (nodes[int(v)] for v in chain.vertices[[0, -1]])
    points = np.concatenate([start[None], points[1:-1], end[None]])
    if len(around) < 2 or _are_tangent(*around, points):
        points = _smoothed(points)
    # Where more than three faces meet, a vertex may lie off the edges that end there.
    points = shared_points(around, points)
    return PlacedChain(chain.left, chain.right, _spaced(points, spacing), 0, 0, False)


def _are_tangent(first: LawSurface, second: LawSurface, points) -> bool:
    """Whether two surfaces have about the same tangent plane at points (k, 3)."""
    across = cross(first.at(points)[1], second.at(points)[1])
    return bool(np.median(np.linalg.norm(across, axis=1)) < LEAST_SINE)


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


def _without(regions: Regions, wrong, triangles) -> tuple[np.ndarray, np.ndarray]:
    """Labels of the triangles (f,) without wrong chains, and which of them stay (f,).

    The smaller region beside a wrong chain becomes part of the larger one, unless it is the largest
    of its face. Then the triangles about the chain go: the surface is open there.
    """
    sizes = np.bincount(regions.of)
    labels, kept = regions.labels.copy(), np.ones(len(regions.of), bool)
    largest = {int(k): max(sizes[regions.labels == k]) for k in np.unique(regions.labels)}
    for chain in wrong:
        both = [r for r in (chain.left, chain.right) if r != BEYOND]
        small = min(both, key=lambda r: sizes[r])
        if len(both) == 2 and sizes[small] < largest[int(regions.labels[small])]:
            labels[small] = labels[sum(both) - small]
        else:
            kept &= ~np.isin(triangles, chain.vertices).any(axis=1)
    return labels[regions.of], kept


def _only(drawn: Surface, kept) -> Surface:
    """The triangles that stay (f,), with a vertex for each fan of them."""
    faces, index = igl.split_nonmanifold(drawn.faces[kept])
    return drawn.taken(index, faces)
