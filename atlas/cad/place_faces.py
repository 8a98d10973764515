"""Faces of a lawful body placed on their surfaces: from triangles to a FaceLayout."""

from collections import Counter
from dataclasses import dataclass

import igl
import numpy as np

from touchatlas.atlas.cad.face_layout import FaceLayout, NoName, NotWritten, PlacedChain
from touchatlas.atlas.cad.face_regions import BEYOND, Chain, Regions, regions_of
from touchatlas.atlas.cad.law_surfaces import LawSurface, law_surface
from touchatlas.atlas.cad.place_chains import placed_chain
from touchatlas.atlas.cad.shared_points import shared_points
from touchatlas.atlas.faces.body import Body
from touchatlas.atlas.mesh.surface import Surface

# Least area of a connected part, over that of all: smaller ones are strays beyond open edges.
# Doubled, larger parts are left out, and counted.
_LEAST_PART = 0.01
# Distance of a rounded corner from where its faces intersect, over that of its edges: 1.8 for that
# of a box. Doubled, faces beside blunt edges are drawn with parts that are not theirs.
_CORNER = 2.0


@dataclass(frozen=True, eq=False)
class PlacedFaces:
    """Faces on their surfaces.

    Parameters
    ----------
    layout : FaceLayout
    regions : Regions
    drawn : Surface
        The triangles of the regions.
    left_out : int
        Number of small connected parts that were left out.
    """

    layout: FaceLayout
    regions: Regions
    drawn: Surface
    left_out: int


def place_faces(body: Body, drawn: Surface, edge: float) -> PlacedFaces:
    """The faces of a body as its triangles show them.

    Where two faces do not intersect between their triangles, the surface is open.

    Parameters
    ----------
    body : Body
    drawn : Surface
        Its surface.
    edge : float, length
        Of the cubes in which it was drawn.

    Raises
    ------
    NoName
        A face has no name in STEP.
    NotWritten
        Nothing is left.
    """
    labels = body.at(drawn.vertices[drawn.faces].mean(axis=1))[0].face
    surfaces = {int(k): _surface(body, int(k)) for k in np.unique(labels)}
    blunt = _blunt(body)
    left_out = 0
    while True:
        kept, strays = _large_parts(drawn)
        drawn, labels, left_out = _only(drawn, kept), labels[kept], left_out + strays
        if not len(labels):
            raise NotWritten("no two faces intersect where their triangles meet")
        regions = regions_of(drawn.faces, labels)
        of_region = [surfaces[int(k)] for k in regions.labels]
        nodes = _nodes(regions, of_region, drawn.vertices)
        chains = [
            placed_chain(c, of_region, drawn.vertices, nodes, edge, _beside(c, regions, blunt))
            for c in regions.chains
        ]
        wrong = [c for c, placed in zip(regions.chains, chains, strict=True) if placed is None]
        if not wrong:
            break
        labels, kept = _without(regions, wrong, drawn.faces)
        drawn, labels = _only(drawn, kept), labels[kept]
    layout = _layout(regions, of_region, nodes, [c for c in chains if c is not None])
    return PlacedFaces(layout, regions, drawn, left_out)


def _blunt(body: Body) -> dict[int, float]:
    """Largest distance of the surface from where faces intersect, length, for each face that has
    blunt edges."""
    out: dict[int, float] = {}
    for edge in body.faces.edges:
        away = _CORNER * edge.radius * (1.0 / np.cos(0.5 * edge.angle) - 1.0)
        for face in (edge.first, edge.second):
            out[face] = max(out.get(face, 0.0), float(away))
    return out


def _beside(chain: Chain, regions: Regions, blunt: dict[int, float]) -> float:
    """The larger of these distances of the faces on both sides of a chain, length."""
    both = [int(regions.labels[r]) for r in (chain.left, chain.right) if r != BEYOND]
    return max(blunt.get(label, 0.0) for label in both)


def _layout(regions: Regions, surfaces, nodes, chains: list[PlacedChain]) -> FaceLayout:
    """Chains from node to node; a closed one that no other meets may begin anywhere."""
    index = {vertex: number for number, vertex in enumerate(nodes)}
    ends = Counter(int(v) for chain in regions.chains for v in chain.vertices[[0, -1]])
    for chain, placed in zip(regions.chains, chains, strict=True):
        first, last = chain.vertices[[0, -1]].tolist()
        placed.start, placed.end = index[first], index[last]
        placed.is_free = first == last and ends[first] == 2
    loops = [[list(loop) for loop in own] for own in regions.loops]
    return FaceLayout(surfaces, loops, chains, list(nodes.values()), {})


def _surface(body: Body, number: int) -> LawSurface:
    face = body.faces.faces[number]
    found = law_surface(face, body.samples.points[face.samples])
    if found is None:
        raise NoName(f"face {number} is a {face.kind} face, which has no name in STEP")
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


def _without(regions: Regions, wrong: list[Chain], triangles) -> tuple[np.ndarray, np.ndarray]:
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


def _large_parts(drawn: Surface) -> tuple[np.ndarray, int]:
    """Which triangles (f,) are of large connected parts, and the number of the other parts."""
    part = igl.facet_components(drawn.faces)
    part = part[1] if isinstance(part, tuple) else part
    share = np.bincount(part, igl.doublearea(drawn.vertices, drawn.faces))
    large = share >= _LEAST_PART * share.sum()
    return large[part], int((~large).sum())
