"""Fillets: which edges of a Brep are rounded, and with which radii, from the blunt edges of faces.

Where three blunt edges meet the kernel makes the corner a sphere only for equal radii. Edges that
differ there by no more than they are uncertain have their mean, weighted by their variances.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas.cad.brep import Brep, BrepEdge
from touchatlas.atlas.cad.edge_shapes import parameters
from touchatlas.atlas.faces.faces import FaceEdge, Faces
from touchatlas.atlas.faces.laws import with_deviation

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


def fillet_radii(faces: Faces, brep: Brep) -> dict[int, Radius]:
    """Radius of each edge of a Brep that is blunt, by its number.

    Parameters
    ----------
    faces : Faces
        The faces of the body, by whose ids those of the Brep are labelled.
    brep : Brep
    """
    own = blunt_edges(faces, brep)
    group = {edge: {edge} for edge in own.values()}
    for corner in _corners(brep, own):
        joined = set().union(*(group[edge] for edge in corner))
        if len(corner) >= 3 and _is_one_radius([faces.edges[edge] for edge in joined]):
            group.update(dict.fromkeys(joined, joined))
    mean = {edge: _mean([faces.edges[e] for e in sorted(group[edge])]) for edge in group}
    return {number: mean[edge] for number, edge in own.items()}


def blunt_edges(faces: Faces, brep: Brep) -> dict[int, int]:
    """Place in ``faces.edges`` of the blunt edge that each edge of a Brep is part of."""
    between: dict[tuple[int, int], list[int]] = {}
    for place, edge in enumerate(faces.edges):
        between.setdefault((edge.first, edge.second), []).append(place)
    out = {}
    for number, beside in sorted(brep.beside.items()):
        labels = {brep.faces[face].label for face in beside}
        found = between.get((min(labels), max(labels)), []) if len(labels) == 2 else []
        points = points_along(brep.edges[number])
        if not len(points) or not any(faces.edges[place].radius > 0.0 for place in found):
            continue
        nearest = min(found, key=lambda place: _distance(faces.edges[place], points))
        if faces.edges[nearest].radius > 0.0:
            out[number] = nearest
    return out


def points_along(edge: BrepEdge) -> np.ndarray:
    """(k, 3) points of an edge of a Brep from its start to its end, none at a pole."""
    return np.zeros((0, 3)) if edge.curve is None else edge.curve.points(parameters(edge.curve))


def _distance(edge: FaceEdge, points) -> float:
    """Median distance of the points of an edge of faces from points (k, 3)."""
    if not edge.curves:
        return float("inf")
    return float(np.median(cKDTree(points).query(np.concatenate(edge.curves))[0]))


def _corners(brep: Brep, own: dict[int, int]) -> Iterable[set[int]]:
    """The blunt edges that meet at each vertex."""
    around: dict[int, set[int]] = {}
    for number, edge in own.items():
        for vertex in (brep.edges[number].start, brep.edges[number].end):
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
