"""Fillets: which edges of a solid are rounded, and with which radii, from the blunt edges of faces.

Where three blunt edges meet the kernel makes the corner a sphere only for equal radii. Edges that
differ there by no more than they are uncertain have their mean, weighted by their variances.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.pieces.laws import with_deviation

# Largest difference of a radius from the mean, in its standard deviations: less than one of ten
# thousand is farther. Doubled, corners of different radii are one sphere.
_EQUAL = 4.0


class Radius(NamedTuple):
    """A radius and its standard deviation, length."""

    value: float
    deviation: float

    @property
    def words(self) -> str:
        """What a face of a fillet is called."""
        return f"fillet, radius {with_deviation(self.value, self.deviation)}"


class SolidEdge(NamedTuple):
    """An edge of a solid: the kernel's, points (k, 3) from its start to its end, none where it has
    no length, its two vertices, and the numbers of the surfaces of its faces."""

    shape: Any
    points: np.ndarray
    ends: tuple[int, int]
    beside: set[int]


def fillet_radii(faces: Faces, same, edges: list[SolidEdge]) -> dict[int, Radius]:
    """Radius of each edge of a solid that is blunt, by its place.

    Parameters
    ----------
    faces : Faces
        The faces of the body.
    same : (f,) int
        The face whose surface each face has, by which those of the solid are numbered.
    edges : list of SolidEdge
    """
    own = blunt_edges(faces, same, edges)
    group = {edge: {edge} for edge in own.values()}
    for corner in _corners(edges, own):
        joined = set().union(*(group[edge] for edge in corner))
        if len(corner) >= 3 and _is_one_radius([faces.edges[edge] for edge in joined]):
            group.update(dict.fromkeys(joined, joined))
    mean = {edge: _mean([faces.edges[e] for e in sorted(group[edge])]) for edge in group}
    return {number: mean[edge] for number, edge in own.items()}


def blunt_edges(faces: Faces, same, edges: list[SolidEdge]) -> dict[int, int]:
    """Place in ``faces.edges`` of the blunt edge that each edge of a solid is part of."""
    between: dict[frozenset[int], list[int]] = {}
    for place, edge in enumerate(faces.edges):
        pair = frozenset(same[[edge.first, edge.second]].tolist())
        between.setdefault(pair, []).append(place)
    out = {}
    for number, (_, points, _, beside) in enumerate(edges):
        found = between.get(frozenset(beside), []) if len(beside) == 2 else []
        if not len(points) or not any(faces.edges[place].radius > 0.0 for place in found):
            continue
        nearest = min(found, key=lambda place: _distance(faces.edges[place], points))
        if faces.edges[nearest].radius > 0.0:
            out[number] = nearest
    return out


def _distance(edge: FaceEdge, points) -> float:
    """Median distance of the points of an edge of faces from points (k, 3)."""
    if not edge.curves:
        return float("inf")
    return float(np.median(cKDTree(points).query(np.concatenate(edge.curves))[0]))


def _corners(edges: list[SolidEdge], own: dict[int, int]) -> Iterable[set[int]]:
    """The blunt edges that meet at each vertex."""
    around: dict[int, set[int]] = {}
    for number, edge in own.items():
        for vertex in edges[number].ends:
            around.setdefault(vertex, set()).add(edge)
    return around.values()


def _mean(edges: list[FaceEdge]) -> Radius:
    """Mean radius of edges, by their variances."""
    radii, std = np.array([(edge.radius, edge.radius_std) for edge in edges]).T
    weights = np.maximum(std, np.finfo(float).eps * radii) ** -2.0
    return Radius(float(np.average(radii, weights=weights)), float(weights.sum() ** -0.5))


def _is_one_radius(edges: list[FaceEdge]) -> bool:
    """Whether no radius differs from the mean of all by more than it is uncertain."""
    mean = _mean(edges).value
    return all(abs(edge.radius - mean) <= _EQUAL * edge.radius_std for edge in edges)
